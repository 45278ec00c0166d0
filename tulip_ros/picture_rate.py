"""Thins out pictures, which take most of a recording."""

from __future__ import annotations

import math

PICTURE_RATE = 8.0  # [1/s] every second one of the head camera's, unless somebody wants more
TOLERANCE = 0.9  # share of the time between two pictures after which the next one counts as due: a camera's own jitter


class PictureRate:
    """Says which of a camera's pictures to keep.

    Example:
        >>> rate = PictureRate(8.0)
        >>> [rate.keeps("camera", 64_000_000 * number) for number in range(5)]
        [True, False, True, False, True]
    """

    def __init__(self, rate: float) -> None:
        """Begin.

        Args:
            rate: Pictures to keep of each topic in a second of their own stamps; 0 for all.

        Raises:
            ValueError: if that is negative or not finite.
        """
        if not (math.isfinite(rate) and rate >= 0.0):
            raise ValueError(f"picture_rate is {rate}; expected a finite number >= 0, and 0 for all")
        self._least = TOLERANCE * 1e9 / rate if rate else 0.0
        self._kept: dict[str, int] = {}

    def keeps(self, topic: str, stamp: int) -> bool:
        """Return whether to keep a picture; a stamp [ns] before the last one begins anew."""
        last = self._kept.get(topic)
        if last is not None and 0 <= stamp - last < self._least:
            return False
        self._kept[topic] = stamp
        return True
