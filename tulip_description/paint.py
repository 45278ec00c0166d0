"""Names of colours as red, green and blue, 0 to 1."""

from __future__ import annotations

COLOURS: dict[str, tuple[float, float, float]] = {
    "grey": (0.72, 0.72, 0.74),
    "black": (0.08, 0.08, 0.09),
    "cyan": (0.0, 0.75, 0.85),
    "magenta": (0.85, 0.1, 0.65),
    "yellow": (0.9, 0.78, 0.0),
    "blue": (0.05, 0.2, 0.7),
    "orange": (0.95, 0.45, 0.05),
    "white": (0.95, 0.95, 0.95),
    "green": (0.1, 0.4, 0.15),
    "net": (0.85, 0.85, 0.85),
}
