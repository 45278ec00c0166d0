"""Velocity commands: towards places, inside the limits, without jumps."""

from __future__ import annotations

import math

from tulip_description.planar import wrap_angle
from tulip_strategy.parameters import StrategyParameters

Point = tuple[float, float]
Velocity = tuple[float, float, float]
STILL: Velocity = (0.0, 0.0, 0.0)


def limited(velocity: Velocity, parameters: StrategyParameters) -> Velocity:
    """Return the velocity brought inside the limits; the direction of travel stays as it is."""
    forward, left, turn = velocity
    most_forward = parameters.forward_speed if forward >= 0.0 else parameters.backward_speed
    scale = max(1.0, abs(forward) / most_forward, abs(left) / parameters.sideways_speed)
    turn = max(-parameters.turning_speed, min(parameters.turning_speed, turn))
    return forward / scale, left / scale, turn


def towards(
    waypoint: Point, way_left: float, heading: float, face_travel: bool, parameters: StrategyParameters
) -> Velocity:
    """Return the velocity that leads to a waypoint.

    Args:
        waypoint: Where to walk [m], in base_footprint.
        way_left: Length of the whole way still to go [m]; the speed falls with it.
        heading: Where to face at the end [rad], relative to the robot.
        face_travel: Face the waypoint instead.
        parameters: Limits and gains.
    """
    direction = math.atan2(waypoint[1], waypoint[0])
    speed = min(parameters.forward_speed, parameters.position_gain * way_left)
    if face_travel:
        heading = direction
        speed *= max(0.0, math.cos(direction))  # turn first, then walk
    turn = parameters.heading_gain * wrap_angle(heading)
    return limited((speed * math.cos(direction), speed * math.sin(direction), turn), parameters)


def in_aim_frame(point: Point, aim: float) -> Point:
    """Return a vector of base_footprint along (first) and to the left of (second) a direction [rad]."""
    c, s = math.cos(aim), math.sin(aim)
    return c * point[0] + s * point[1], -s * point[0] + c * point[1]


def from_aim_frame(along: float, left: float, aim: float) -> Point:
    """Return a vector given along and to the left of a direction [rad] in base_footprint."""
    c, s = math.cos(aim), math.sin(aim)
    return c * along - s * left, s * along + c * left


class Acceleration:
    """Lets a commanded velocity change no faster than the limits."""

    def __init__(self, parameters: StrategyParameters) -> None:
        self._limits = (
            parameters.forward_acceleration,
            parameters.sideways_acceleration,
            parameters.turning_acceleration,
        )
        self._velocity = STILL

    def reset(self) -> None:
        """Start from rest."""
        self._velocity = STILL

    def step(self, wanted: Velocity, dt: float) -> Velocity:
        """Return the velocity `dt` [s] after the last, as near to the wanted one as the limits allow."""
        forward, left, turn = (
            last + max(-limit * dt, min(limit * dt, value - last))
            for value, last, limit in zip(wanted, self._velocity, self._limits, strict=True)
        )
        self._velocity = (forward, left, turn)
        return self._velocity
