"""Robots that touch each other fall: no step nearer to one that is near already, and no kick into it."""

from __future__ import annotations

import math
from collections.abc import Iterable

from tulip_strategy.behaviour.steering import Velocity
from tulip_strategy.parameters import StrategyParameters

Point = tuple[float, float]


def kept_off(velocity: Velocity, opponents: Iterable[Point], parameters: StrategyParameters) -> Velocity:
    """Return a velocity without what leads too near an opponent, or with what leads away from one that is too near.

    The speed towards an opponent falls with the distance that is left, and none is left at `keep_off`.

    Args:
        velocity: Wished, in base_footprint [m/s], [m/s], [rad/s].
        opponents: In base_footprint [m].
        parameters: Distances and gain.
    """
    forward, left, turn = velocity
    for x, y in sorted(opponents, key=lambda each: -math.hypot(*each)):  # the nearest has the last word
        distance = max(math.hypot(x, y), 1e-6)
        towards = (forward * x + left * y) / distance
        most = parameters.keep_off_gain * (distance - parameters.keep_off)
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
