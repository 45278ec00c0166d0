"""Game state, user commands and behaviour."""
