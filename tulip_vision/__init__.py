"""From a picture to features with two angles each."""
