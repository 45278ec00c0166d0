"""Who walks into a robot or a goal post falls: no step nearer to one that is near already, and no kick into a robot."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from tulip_strategy.behaviour.steering import Velocity
from tulip_strategy.parameters import StrategyParameters

Point = tuple[float, float]


@dataclass(frozen=True)
class Obstacle:
    """Something upright that a robot can walk into.

    Attributes:
        position: In base_footprint [m].
        keep_off: Between the middles, at which none walks towards it any more [m].
        clearance: With which a way leads round it [m].
    """

    position: Point
    keep_off: float
    clearance: float


def kept_off(velocity: Velocity, obstacles: Iterable[Obstacle], gain: float) -> Velocity:
    """Return a velocity without what leads too near an obstacle, or with what leads away from one that is too near.

    The speed towards an obstacle falls with the distance that is left, and none is left at `keep_off`.

    Args:
        velocity: Wished, in base_footprint [m/s], [m/s], [rad/s].
        obstacles: Robots, posts and poles.
        gain: Speed towards an obstacle per distance that is left [1/s].
    """
    forward, left, turn = velocity
    for each in sorted(obstacles, key=lambda each: -math.hypot(*each.position)):  # the nearest has the last word
        x, y = each.position
        distance = max(math.hypot(x, y), 1e-6)
        towards = (forward * x + left * y) / distance
        most = gain * (distance - each.keep_off)
        if towards > most:
            forward -= (towards - most) * x / distance
            left -= (towards - most) * y / distance
    return forward, left, turn


def in_kicks_way(direction: float, opponents: Iterable[Point], parameters: StrategyParameters) -> bool:
    """Tell whether the kicking leg could meet somebody.

    Args:
        direction: Of the kick, in base_footprint [rad].
        opponents: In base_footprint [m].
        parameters: Distance and angle.
    """
    return any(
        math.hypot(x, y) < parameters.kick_clear_distance
        and abs(math.remainder(math.atan2(y, x) - direction, 2.0 * math.pi)) < parameters.kick_clear_angle
        for x, y in opponents
    )
