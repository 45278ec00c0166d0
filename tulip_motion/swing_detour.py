"""The way of a swing foot around the stance foot. On a fast curve the straight way leads through it."""

from __future__ import annotations

from typing import NamedTuple

from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import Foot
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import FootMotion
from tulip_motion.interface import Side

LOOKS = tuple(k / 10.0 for k in range(2, 9))  # progress at which the way is looked at


class Detour(NamedTuple):
    """How far a swing foot goes aside, at most, in its middle: (x, y) in odom [m]."""

    x: float
    y: float

    def added_to(self, foot: FootMotion, progress: float, rate: float) -> FootMotion:
        """Return a foot that has gone aside. The way aside is 64 s^3 (1 - s)^3: it begins and ends at rest.

        Args:
            foot: On its straight way.
            progress: s, of the swing, 0 to 1.
            rate: Of the progress [1/s].
        """
        s = min(progress, 1.0)
        g, slope = s * (1.0 - s), 1.0 - 2.0 * s
        share = 64.0 * g**3
        speed = 192.0 * g**2 * slope * rate
        acceleration = 384.0 * g * (slope**2 - g) * rate**2
        (x, y, z), (vx, vy, vz), (ax, ay, az) = foot.position, foot.velocity, foot.acceleration
        return foot._replace(
            position=(x + share * self.x, y + share * self.y, z),
            velocity=(vx + speed * self.x, vy + speed * self.y, vz),
            acceleration=(ax + acceleration * self.x, ay + acceleration * self.y, az),
        )


def detour(soles: tuple[Foot, Foot], stance: Footstep, start: Pose2D, landing: Pose2D, gap: float) -> Detour | None:
    """Return how far the foot has to go aside; None if the straight way is free.

    Args:
        soles: Left and right sole.
        stance: The foot that stands.
        start: Where the other one stands.
        landing: Where it is to land.
        gap: That has to be free beside the stance foot [m].
    """
    to_stance = stance.pose.inverse()
    begin, end = to_stance @ start, to_stance @ landing
    outward = 1.0 if stance.side is Side.RIGHT else -1.0  # from the stance foot to the other, along its y axis
    standing, swinging = soles[stance.side], soles[stance.side.other]
    beside = outward * standing.y[1 if outward > 0.0 else 0] + gap
    most = 0.0
    for progress in LOOKS:
        # Place and heading move alike, with minimum jerk.
        u = progress**3 * (10.0 + progress * (6.0 * progress - 15.0))
        yaw = begin.yaw + u * wrap_angle(end.yaw - begin.yaw)
        pose = Pose2D(begin.x + u * (end.x - begin.x), begin.y + u * (end.y - begin.y), yaw)
        nearest = _nearest(pose, swinging, standing.x, outward)
        most = max(most, (beside - nearest) / (64.0 * (progress * (1.0 - progress)) ** 3))
    if most == 0.0:
        return None
    x, y = Pose2D(yaw=stance.pose.yaw).transform((0.0, outward * most))
    return Detour(x, y)


def _nearest(pose: Pose2D, sole: Foot, between: tuple[float, float], outward: float) -> float:
    """Return how far outward the nearest point of a sole lies of all its points between two x [m]; else infinity."""
    corners = [pose.transform((x, y)) for x, y in zip((*sole.x, *reversed(sole.x)), sorted(sole.y * 2), strict=True)]
    found = float("inf")
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0]), strict=True):
        if between[0] <= x0 <= between[1]:
            found = min(found, outward * y0)
        for edge in between:
            if (x0 - edge) * (x1 - edge) < 0.0:
                found = min(found, outward * (y0 + (y1 - y0) * (edge - x0) / (x1 - x0)))
    return found
