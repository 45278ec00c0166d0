"""Where the head sweeps while the robot looks for something: level rows, one below the other, there and back."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class SearchPattern:
    """Rows of a fixed tilt over the whole pan, walked to and fro, for ever."""

    def __init__(self, pan: float, tilts: tuple[float, ...], arrived: float) -> None:
        """Describe the rows.

        Args:
            pan: To both sides [rad].
            tilts: Of the rows, from far to near [rad].
            arrived: From the end of a row, where the next begins [rad].
        """
        self._pan, self._tilts, self._arrived = pan, tilts, arrived
        self._ends: list[Array] = []

    def begin(self, lost: tuple[float, float, float], near_distance: float) -> None:
        """Begin a round on the side, and in the row, where a target was lost.

        Args:
            lost: Its last place in base_footprint [m].
            near_distance: A target nearer than this is looked for in the nearest row first [m].
        """
        near = math.hypot(lost[0], lost[1]) < near_distance
        rows = tuple(reversed(self._tilts)) if near else self._tilts
        side = self._pan if lost[1] >= 0.0 else -self._pan
        self._ends = []
        for tilt in rows:
            self._ends += [np.array([side, tilt]), np.array([-side, tilt])]
            side = -side

    def goal(self, position: Array) -> Array:
        """Return (2,) the end of the present row [rad], given pan and tilt now (2,) [rad]."""
        if float(np.max(np.abs(self._ends[0] - position))) < self._arrived:
            self._ends = [*self._ends[1:], self._ends[0]]
        return self._ends[0]
