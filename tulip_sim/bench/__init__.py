"""Measurements whose figures are published in docs/results.md: one file a bench."""
