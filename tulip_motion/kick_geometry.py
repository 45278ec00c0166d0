"""Where foot and ball meet: the face that strikes, the place of the foot at the contact, room beside the other foot."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import Foot
from tulip_motion.interface import KickKind, Side

Point = tuple[float, float]


@dataclass(frozen=True)
class Face:
    """The flat face of a foot that strikes the ball.

    A ball that is struck in the middle of a face, which moves along its normal, leaves along that normal.

    Attributes:
        middle: (x, y) of the face's middle in the sole frame [m].
        normal: Direction that it looks to, in the sole frame [rad].
    """

    middle: Point
    normal: float

    def sole_at_contact(self, ball: Point, direction: float, ball_radius: float) -> Pose2D:
        """Return the pose of the sole that touches the ball with the face's middle, its normal along a direction.

        Args:
            ball: (x, y) of the ball's centre, in the frame of the answer [m].
            direction: In that frame [rad].
            ball_radius: [m]. The face is flat up to above the ball's centre, so it touches there.
        """
        yaw = wrap_angle(direction - self.normal)
        reach = (
            self.middle[0] + ball_radius * math.cos(self.normal),
            self.middle[1] + ball_radius * math.sin(self.normal),
        )
        x, y = Pose2D(ball[0], ball[1], yaw).transform((-reach[0], -reach[1]))
        return Pose2D(x, y, yaw)

    def ball_before(self, sole: Pose2D, gap: float, ball_radius: float) -> Point:
        """Return where the ball lies when `gap` [m] are free between it and the face of a foot at `sole`."""
        away = gap + ball_radius
        return sole.transform(
            (self.middle[0] + away * math.cos(self.normal), self.middle[1] + away * math.sin(self.normal))
        )


def striking_face(kind: KickKind, side: Side, foot: Foot) -> Face:
    """Return the toe's face, or for a side kick the outer one.

    Args:
        kind: See `KickKind`.
        side: Which foot.
        foot: Its rectangle.
    """
    if kind is not KickKind.SIDE:
        return Face((foot.x[1], 0.5 * (foot.y[0] + foot.y[1])), 0.0)
    middle = 0.5 * (foot.x[0] + foot.x[1])
    return Face((middle, foot.y[1]), 0.5 * math.pi) if side is Side.LEFT else Face((middle, foot.y[0]), -0.5 * math.pi)


def gap_between(pose: Pose2D, foot: Foot, other_pose: Pose2D, other: Foot) -> float:
    """Return the distance of two soles seen from above [m], negative by their overlap, along the best separating axis.

    For rectangles that do not overlap it is at most their true distance, so it never says more room than there is.
    """
    corners = np.array([_corners(pose, foot), _corners(other_pose, other)])
    best = -math.inf
    for yaw in (pose.yaw, other_pose.yaw):
        for axis in ((math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))):
            first, second = corners @ axis
            best = max(best, float(first.min() - second.max()), float(second.min() - first.max()))
    return best


def _corners(pose: Pose2D, foot: Foot) -> list[Point]:
    return [pose.transform((x, y)) for x in foot.x for y in foot.y]
