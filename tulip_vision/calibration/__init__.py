"""What the camera's lens, its mount and the colours of a hall are, found from pictures."""
