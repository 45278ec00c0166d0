"""How the camera pose that a walking robot believes in errs: slowly, and the same for all features of a picture."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tulip_vision.view import SpreadParameters

Array = NDArray[np.float64]

MEMORY = 0.5  # [s] how long an error lasts: about a step


class CameraSway:
    """A small rotation that wanders, of the size that vision says."""

    def __init__(self, spread: SpreadParameters, rng: np.random.Generator) -> None:
        """Begin anywhere.

        Args:
            spread: Of which the errors of the camera's pose count.
            rng: Of all that is random.
        """
        self._spreads = np.array([spread.pose_elevation, spread.pose_elevation, spread.pose_azimuth])
        self._rng = rng
        self._error = self._spreads * rng.normal(size=3)  # [rad] about x, y, z of base_footprint

    def of(self, camera_in_footprint: Array, elapsed: float) -> Array:
        """Return the (4, 4) camera pose that is believed, given the true one and the time since the last [s]."""
        keep = math.exp(-elapsed / MEMORY)
        self._error = keep * self._error + math.sqrt(1.0 - keep**2) * self._spreads * self._rng.normal(size=3)
        believed = camera_in_footprint.copy()
        believed[:3, :3] = _rotation(self._error) @ camera_in_footprint[:3, :3]
        return believed


def _rotation(vector: Array) -> Array:
    """Return the (3, 3) rotation by a vector (3,) [rad] (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / max(angle, 1e-12)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)
