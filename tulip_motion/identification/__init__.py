"""The robot identifies its own body: section 2 of the team description, eq. (2)."""
