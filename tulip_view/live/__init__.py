"""The page that shows a robot while it plays, or a recording of it, and steers it."""
