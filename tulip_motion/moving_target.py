"""A target whose place comes now and then: how it moves, and where it is meanwhile."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class MovingTarget:
    """Follows the places given with their stamps.

    The velocity is the median, for each axis, of the last three differences between places. A tracker gives places that
    move on smoothly from one picture to the next and jump by the correction at each picture. Places come three times as
    often as pictures, so that at most one of three differences holds a jump, and the median is free of it.
    """

    def __init__(self, longest_gap: float, greatest_speed: float) -> None:
        """Begin without a target.

        Args:
            longest_gap: After a longer time between two places the velocity begins anew [s].
            greatest_speed: A faster difference is another target [m/s].
        """
        self._longest_gap, self._greatest_speed = longest_gap, greatest_speed
        self._stamp = 0  # [ns]
        self._place: Array | None = None
        self._velocities: deque[Array] = deque(maxlen=3)
        self.velocity = np.zeros(3)
        """(3,) [m/s]; zero until three differences are known, and for jumps that no ball makes."""

    def see(self, stamp: int, place: tuple[float, float, float]) -> None:
        """Take a place [m] at a stamp [ns]; the one known already, or an older one, changes nothing."""
        here = np.array(place)
        if self._place is None:
            self._stamp, self._place = stamp, here
            return
        gap = (stamp - self._stamp) * 1e-9
        if gap <= 0.0:
            if gap < -self._longest_gap:  # time began anew
                self._forget()
            elif gap < 0.0 or np.array_equal(here, self._place):
                return
            self._stamp, self._place = stamp, here
            return
        if gap > self._longest_gap:
            self._forget()
        else:
            self._velocities.append((here - self._place) / gap)
            if len(self._velocities) == 3:
                median: Array = np.sort(np.array(self._velocities), axis=0)[1]
                self.velocity = median if float(np.linalg.norm(median)) <= self._greatest_speed else np.zeros(3)
        self._stamp, self._place = stamp, here

    def _forget(self) -> None:
        self._velocities.clear()
        self.velocity = np.zeros(3)

    def at(self, stamp: int) -> tuple[float, float, float]:
        """Return where the target is at a stamp [ns], carried on from its last place by `longest_gap` at most.

        Raises:
            LookupError: before the first place.
        """
        if self._place is None:
            raise LookupError("no target yet; expected at least one place before it is asked for")
        ahead = min(self._longest_gap, max(0.0, (stamp - self._stamp) * 1e-9))
        x, y, z = (self._place + self.velocity * ahead).tolist()
        return x, y, z
