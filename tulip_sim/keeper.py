"""The goalkeeper: a figure that stands or goes to and fro along a path."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tulip_description.planar import Pose2D


@dataclass(frozen=True)
class Keeper:
    """Where a keeper is and how it moves.

    Attributes:
        pose: Where it stands at the start, in map.
        path: Further points (x, y) in map [m]: it goes from its pose to the first, on to the last, back, and so on,
            without turning. Empty for one that stands.
        speed: Along the path [m/s].
    """

    pose: Pose2D
    path: tuple[tuple[float, float], ...] = ()
    speed: float = 0.2

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if the speed is not positive, or a path point repeats the one before.
        """
        if not self.speed > 0.0:
            raise ValueError(f"speed is {self.speed} m/s; expected > 0 (leave path empty for a keeper that stands)")
        for a, b in zip(self.points, self.points[1:], strict=False):
            if a == b:
                raise ValueError(f"path goes from {a} to {b}; expected different points")

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """Start and path points [m]."""
        return ((self.pose.x, self.pose.y), *self.path)

    def pose_at(self, stamp: int) -> Pose2D:
        """Return where the keeper is at a time since the start [ns]."""
        if not self.path:
            return self.pose
        legs = list(zip(self.points, self.points[1:], strict=False))
        total = sum(math.dist(a, b) for a, b in legs)
        walked = (stamp * 1e-9 * self.speed) % (2.0 * total)
        along = min(walked, 2.0 * total - walked)  # out, and back again
        for a, b in legs:
            length = math.dist(a, b)
            if along <= length:
                share = along / length
                return Pose2D(a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), self.pose.yaw)
            along -= length
        x, y = self.points[-1]
        return Pose2D(x, y, self.pose.yaw)
