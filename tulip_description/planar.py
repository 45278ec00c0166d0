"""Poses and angles in the plane (SE(2))."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


def wrap_angle(angle: float) -> float:
    """Return the angle [rad] brought into [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@dataclass(frozen=True)
class Pose2D:
    """A pose in the plane: where a child frame lies in a parent frame.

    Attributes:
        x: Position along the parent's x axis [m].
        y: Position along the parent's y axis [m].
        yaw: Rotation about the parent's z axis [rad].
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def __matmul__(self, other: Pose2D) -> Pose2D:
        """Compose: (child in parent) @ (grandchild in child) = grandchild in parent."""
        x, y = self.transform((other.x, other.y))
        return Pose2D(x, y, wrap_angle(self.yaw + other.yaw))

    def inverse(self) -> Pose2D:
        """Return the pose of the parent frame in the child frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2D(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.yaw))

    def transform(self, point: tuple[float, float] | NDArray[np.float64]) -> tuple[float, float]:
        """Return a point of the child frame in the parent frame [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        px, py = float(point[0]), float(point[1])
        return self.x + c * px - s * py, self.y + s * px + c * py

    def rotation(self) -> NDArray[np.float64]:
        """Return the (2, 2) rotation matrix from the child to the parent frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, -s], [s, c]])

    def as_array(self) -> NDArray[np.float64]:
        """Return (3,): x [m], y [m], yaw [rad]."""
        return np.array([self.x, self.y, self.yaw])
