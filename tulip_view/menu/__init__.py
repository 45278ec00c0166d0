"""The menu in the terminal: watches a robot and steers it by keys."""
