"""Live view and reports."""
