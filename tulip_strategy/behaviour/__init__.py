"""The behaviour tree, one idea a file."""
