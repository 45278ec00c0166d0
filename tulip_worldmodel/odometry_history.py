"""The recent path in odom, so that a picture can be used at the moment when it was taken."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.quaternion import pose_on_ground
from tulip_motion.interface import Odometry
from tulip_worldmodel.positive_part import positive_part

Array = NDArray[np.float64]

TURN_PORTION = 0.1
"""[rad] Turning is counted when it has grown to this: the trunk's swinging at each step is no turning."""
PATH_PORTION = 0.15
"""[m] Likewise for the path: the trunk sways to both sides at each step."""
PLANE = np.ix_((0, 1, 5), (0, 1, 5))  # x, y and yaw among the six of a pose


@dataclass(frozen=True)
class PathPoint:
    """Where dead reckoning had the robot at one moment.

    Attributes:
        stamp: [ns].
        pose: base_footprint in odom.
        distance: Path length since the start [m], in portions of `PATH_PORTION`.
        turned: Sum of all turning, left and right, since the start [rad], in portions of `TURN_PORTION`.
        covariance: (3, 3) of x, y [m] and yaw [rad] in odom as odometry says, or None.
    """

    stamp: int
    pose: Pose2D
    distance: float = 0.0
    turned: float = 0.0
    covariance: Array | None = None


@dataclass(frozen=True)
class Increment:
    """Movement between two moments, in base_footprint of the first.

    Attributes:
        pose: The later base_footprint in the earlier one.
        distance: Path length between them [m].
        turned: Turning between them [rad], >= 0.
        duration: [s].
        slip: (2, 2) covariance of x, y [m^2] that odometry itself says the movement added, or None.
    """

    pose: Pose2D
    distance: float
    turned: float
    duration: float
    slip: Array | None = None


def increment(earlier: PathPoint, later: PathPoint) -> Increment:
    """Return the movement from one moment to another."""
    return Increment(
        earlier.pose.inverse() @ later.pose,
        max(0.0, later.distance - earlier.distance),
        max(0.0, later.turned - earlier.turned),
        (later.stamp - earlier.stamp) * 1e-9,
        slip_between(earlier, later),
    )


def slip_between(earlier: PathPoint, later: PathPoint) -> Array | None:
    """Return the (2, 2) position covariance that odometry added between two moments, in axes of the earlier one.

    Odometry tells the covariance since its start: P2 = F P1 F^T + Q, where F carries the heading's error along the way.
    Q is what is asked for; what of it is negative (parts of P that do not add up, as the sway of the trunk) is cut off.
    """
    if earlier.covariance is None or later.covariance is None:
        return None
    carried = np.eye(3)
    carried[:2, 2] = earlier.pose.y - later.pose.y, later.pose.x - earlier.pose.x
    added = (later.covariance - carried @ earlier.covariance @ carried.T)[:2, :2]
    turn = earlier.pose.rotation()
    return positive_part(turn.T @ added @ turn)


class OdometryHistory:
    """Path points of the last seconds; older ones are forgotten."""

    def __init__(self, duration: float) -> None:
        """Start empty.

        Args:
            duration: How far back to remember [s].
        """
        self._duration = round(duration * 1e9)  # [ns]
        self._points: deque[PathPoint] = deque()
        self._counted = Pose2D()  # pose up to which `distance` and `turned` were counted

    def append(self, odometry: Odometry) -> bool:
        """Add a reading; False, and no change, if it is not newer than the newest one."""
        pose = pose_on_ground(odometry.position, odometry.orientation)
        distance = turned = 0.0
        if not self._points:
            self._counted = pose
        else:
            last = self._points[-1]
            if odometry.stamp <= last.stamp:
                return False
            distance, turned = last.distance, last.turned
            path = math.hypot(pose.x - self._counted.x, pose.y - self._counted.y)
            if path >= PATH_PORTION:
                distance += path
                self._counted = Pose2D(pose.x, pose.y, self._counted.yaw)
            turn = abs(wrap_angle(pose.yaw - self._counted.yaw))
            if turn >= TURN_PORTION:
                turned += turn
                self._counted = Pose2D(self._counted.x, self._counted.y, pose.yaw)
        covariance = odometry.covariance[PLANE] if odometry.covariance.any() else None
        self._points.append(PathPoint(odometry.stamp, pose, distance, turned, covariance))
        while len(self._points) > 2 and self._points[1].stamp < odometry.stamp - self._duration:
            self._points.popleft()
        return True

    @property
    def newest(self) -> PathPoint | None:
        """The newest point, or None before the first reading."""
        return self._points[-1] if self._points else None

    def at(self, stamp: int) -> PathPoint:
        """Return the path at a stamp, interpolated; the first or last point outside the remembered time.

        Raises:
            LookupError: before the first reading.
        """
        if not self._points:
            raise LookupError("no odometry yet; expected at least one reading before the path is asked for")
        index = bisect_right(self._points, stamp, key=lambda point: point.stamp)
        if index == 0:
            return self._points[0]
        if index == len(self._points):
            return self._points[-1]
        before, after = self._points[index - 1], self._points[index]
        part = (stamp - before.stamp) / (after.stamp - before.stamp)
        pose = Pose2D(
            before.pose.x + part * (after.pose.x - before.pose.x),
            before.pose.y + part * (after.pose.y - before.pose.y),
            wrap_angle(before.pose.yaw + part * wrap_angle(after.pose.yaw - before.pose.yaw)),
        )
        distance = before.distance + part * (after.distance - before.distance)
        turned = before.turned + part * (after.turned - before.turned)
        covariance = None
        if before.covariance is not None and after.covariance is not None:
            covariance = before.covariance + part * (after.covariance - before.covariance)
        return PathPoint(stamp, pose, distance, turned, covariance)
