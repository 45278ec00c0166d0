"""The middles of all lines of a field, straight and round: the nearest places on them, and points along them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field

Array = NDArray[np.float64]


class FieldLines:
    """The nearest places on the lines of a field."""

    def __init__(self, field: Field) -> None:
        self._starts = np.array([line.start for line in field.line_segments])
        self._along = np.array([line.end for line in field.line_segments]) - self._starts
        self._circle = field.centre_circle

    def nearest(self, points: Array) -> Array:
        """Return (n, 2) places on the middles of the lines nearest to (n, 2) points in map [m]."""
        offsets = points[:, None] - self._starts
        share = np.clip((offsets * self._along).sum(axis=2) / (self._along**2).sum(axis=1), 0.0, 1.0)
        feet = self._starts + share[..., None] * self._along
        distances = np.linalg.norm(feet - points[:, None], axis=2)
        best = distances.argmin(axis=1)
        rows = np.arange(len(points))
        found: Array = feet[rows, best]
        middle = np.array([self._circle.x, self._circle.y])
        out = points - middle
        length = np.maximum(np.linalg.norm(out, axis=1), 1e-9)
        on_circle = np.abs(length - self._circle.radius) < distances[rows, best]
        found[on_circle] = middle + (out * (self._circle.radius / length)[:, None])[on_circle]
        return found

    def outlines(self) -> list[Array]:
        """Return each line as (n, 2) points close together, for drawing [m]."""
        drawn = [
            start + np.linspace(0.0, 1.0, 120)[:, None] * along
            for start, along in zip(self._starts, self._along, strict=True)
        ]
        turn = np.linspace(0.0, 2.0 * math.pi, 120)
        radius = self._circle.radius
        drawn.append(np.stack([self._circle.x + radius * np.cos(turn), self._circle.y + radius * np.sin(turn)], axis=1))
        return drawn
