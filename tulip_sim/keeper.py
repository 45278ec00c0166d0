"""The goalkeeper: a figure that stands, goes to and fro along a path, or follows the ball along its line."""

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
        speed: At which it moves [m/s].
        follows: How far to each side of the goal's middle it goes to stay level with the ball [m]; 0 for one that does
            not follow it.
    """

    pose: Pose2D
    path: tuple[tuple[float, float], ...] = ()
    speed: float = 0.2
    follows: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if the speed is not positive, a path point repeats the one before, or it has both a path and a
                ball to follow.
        """
        if self.follows < 0.0 or (self.follows > 0.0 and self.path):
            raise ValueError(f"follows is {self.follows} m with path {self.path}; expected >= 0 m, and no path if > 0")
        if not self.speed > 0.0:
            raise ValueError(f"speed is {self.speed} m/s; expected > 0 (leave path empty for a keeper that stands)")
        for a, b in zip(self.points, self.points[1:], strict=False):
            if a == b:
                raise ValueError(f"path goes from {a} to {b}; expected different points")

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """Start and path points [m]."""
        return ((self.pose.x, self.pose.y), *self.path)

    @property
    def moves(self) -> bool:
        """Whether it ever leaves its place."""
        return bool(self.path) or self.follows > 0.0

    def after(self, pose: Pose2D, ball_y: float, seconds: float) -> Pose2D:
        """Return where a keeper that follows the ball, at y [m] in map, is some seconds later."""
        wanted = max(-self.follows, min(self.follows, ball_y))
        most = self.speed * seconds
        return Pose2D(pose.x, pose.y + max(-most, min(most, wanted - pose.y)), pose.yaw)

    def pose_at(self, stamp: int) -> Pose2D:
        """Return where a keeper that does not follow the ball is at a time since the start [ns]."""
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
