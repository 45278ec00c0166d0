"""Validation of the simulator: its own balances, and the same robot computed by other means beside it."""
