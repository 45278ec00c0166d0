"""Where the feet go for a velocity command."""

from __future__ import annotations

from typing import NamedTuple

from tulip_description.planar import Pose2D
from tulip_motion.interface import Side


class Footstep(NamedTuple):
    """A foot on the ground: which one, and the pose of its sole in odom."""

    side: Side
    pose: Pose2D


def centre_beside(foot: Footstep, stance_width: float) -> Pose2D:
    """Return the pose midway between the feet when the other foot stands `stance_width` [m] beside this one."""
    return foot.pose @ Pose2D(0.0, -0.5 * stance_width if foot.side is Side.LEFT else 0.5 * stance_width)


def foot_beside(centre: Pose2D, side: Side, stance_width: float) -> Footstep:
    """Return the foot of a side when the middle between the feet is at `centre`; inverse of `centre_beside`."""
    return Footstep(side, centre @ Pose2D(0.0, 0.5 * stance_width if side is Side.LEFT else -0.5 * stance_width))


def next_footstep(
    stance: Footstep, velocity: tuple[float, float, float], step_time: float, stance_width: float
) -> Footstep:
    """Return where the other foot lands.

    Forward motion is shared by both feet. Sideways and turning, the leading foot moves for two steps and
    the trailing foot closes up, so that the feet never come nearer than `stance_width`.

    Args:
        stance: The foot that stands.
        velocity: Forward [m/s], left [m/s], turning rate [rad/s].
        step_time: Duration of a whole step [s].
        stance_width: Distance between the feet [m].
    """
    side = stance.side.other
    forward, left, turn = velocity
    sign = 1.0 if side is Side.LEFT else -1.0
    sideways = 2.0 * left * step_time if left * sign > 0.0 else 0.0
    yaw = 2.0 * turn * step_time if turn * sign > 0.0 else 0.0
    centre = centre_beside(stance, stance_width) @ Pose2D(forward * step_time, sideways, yaw)
    return foot_beside(centre, side, stance_width)


def plan_footsteps(
    stance: Footstep, velocity: tuple[float, float, float], step_time: float, stance_width: float, count: int
) -> list[Footstep]:
    """Return the next `count` footsteps, then one that closes up so that the robot could stop there."""
    steps: list[Footstep] = []
    for _ in range(count):
        stance = next_footstep(stance, velocity, step_time, stance_width)
        steps.append(stance)
    steps.append(next_footstep(stance, (0.0, 0.0, 0.0), step_time, stance_width))
    return steps
