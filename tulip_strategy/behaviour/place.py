"""Walk to a place on the field and stand there."""

from __future__ import annotations

import math

from tulip_description.planar import Pose2D
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.steering import limited, towards


def go_to(context: Context, place: Pose2D, tolerance: float) -> bool:
    """Wish to walk to a pose in map, or to stand where the robot is there; return whether it is.

    Args:
        context: With a world state.
        place: Where base_footprint shall be, in map.
        tolerance: [m] of the place; the same number in rad of the heading.
    """
    assert context.world is not None
    parameters = context.parameters
    relative = context.world.robot.pose.inverse() @ place
    way_left = math.hypot(relative.x, relative.y)
    if way_left > tolerance:
        far = way_left > parameters.face_travel_distance
        context.walk(towards((relative.x, relative.y), way_left, relative.yaw, far, parameters))
        return False
    if abs(relative.yaw) > tolerance:
        context.walk(limited((0.0, 0.0, parameters.heading_gain * relative.yaw), parameters))
        return False
    context.stand()
    return True
