"""What is rehearsed: walks, stands and kicks, one after the other, as a user writes them.

walk 0.3 0 0 10 stand 2 kick left
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tulip_motion.interface import KickGoal, KickKind, Side
from tulip_motion.kick_plan import KickStyle, refused_numbers
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Velocity

LONGEST = 600.0  # [s] of one part
KICK_TIME = 4.0  # [s] until the robot stands again after a kick, with time to spare
STAND, WALK = "stand", "walk"
KINDS = {"kick": KickKind.FORWARD, "sidekick": KickKind.SIDE}
GRAMMAR = "walk FORWARD LEFT TURN [SECONDS], stand [SECONDS], kick left|right [SPEED], sidekick left|right [SPEED]"


@dataclass(frozen=True)
class Part:
    """One motion.

    Attributes:
        words: As told to people.
        seconds: How long it is [s].
        velocity: Of a walk: forward [m/s], left [m/s], turning rate [rad/s]; None: the robot stands.
        kick: That the part begins with, or None.
    """

    words: str
    seconds: float
    velocity: Velocity | None = None
    kick: KickGoal | None = None


def everything(parameters: MotionParameters) -> tuple[Part, ...]:
    """Return a bit of everything that the walk is allowed: its top speed each way, a curve, and a stop after each."""
    forward, back, left, turn = limits(parameters)
    walks = [(forward, 0.0, 0.0), (-back, 0.0, 0.0), (0.0, left, 0.0), (0.0, 0.0, turn)]
    walks = [walk for walk in walks if any(walk)] + [(0.5 * forward, 0.0, 0.5 * turn)]
    parts = [Part(STAND, 1.0)]
    for walk in walks:
        parts += [_walk(walk, 4.0), Part(STAND, 3.0)]
    return tuple(parts)


def limits(parameters: MotionParameters) -> tuple[float, float, float, float]:
    """Return the greatest speeds of the walk: forward, backward, sideways [m/s] and turning [rad/s]."""
    p = parameters
    if p.gait == "paper":
        return p.paper_max_speed, p.paper_max_speed, 0.0, p.paper_max_turn_rate
    return p.max_speed_forward, p.max_speed_backward, p.max_speed_sideways, p.max_turn_rate


def parse(words: Sequence[str], parameters: MotionParameters, seconds: float = 10.0) -> tuple[Part, ...]:
    """Return the motions that words name.

    Args:
        words: See the module's first lines, and `GRAMMAR`.
        parameters: Of motion control, which the motions are for.
        seconds: Of walks and stands that do not say how long they are.

    Raises:
        ValueError: for an unknown motion, numbers that are missing or none, or beyond what the walk or kick can do.
    """
    starts = [index for index, word in enumerate(words) if not _is_value(word)]
    if not starts or starts[0] != 0:
        raise ValueError(f"motions are {' '.join(words)!r}; expected {GRAMMAR}, one after the other")
    ends = [*starts[1:], len(words)]
    return tuple(
        _part(words[start], list(words[start + 1 : end]), parameters, seconds)
        for start, end in zip(starts, ends, strict=True)
    )


def _is_value(word: str) -> bool:
    return word in (side.name.lower() for side in Side) or _number(word) is not None


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def _part(name: str, values: list[str], parameters: MotionParameters, seconds: float) -> Part:
    numbers = [number for number in map(_number, values) if number is not None]
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"{name} {' '.join(values)}: expected finite numbers")
    if name in KINDS:
        return _kick(name, values, numbers, parameters)
    counts = {WALK: (3, 4), STAND: (0, 1)}.get(name)
    if counts is None:
        raise ValueError(f"there is no motion {name!r}; expected {GRAMMAR}")
    if len(numbers) != len(values) or not counts[0] <= len(values) <= counts[1]:
        raise ValueError(f"{' '.join([name, *values])!r} is incomplete; expected {_usage(name)}")
    duration = numbers[counts[0]] if len(numbers) > counts[0] else seconds
    if not 0.0 < duration <= LONGEST:
        raise ValueError(f"{name} lasts {duration:g} s; expected above 0 and at most {LONGEST:g} s")
    if name == STAND:
        return Part(name, duration)
    velocity = (numbers[0], numbers[1], numbers[2])
    forward, back, left, turn = limits(parameters)
    for what, value, low, high, unit in (
        ("forward", velocity[0], -back, forward, "m/s"),
        ("to the left", velocity[1], -left, left, "m/s"),
        ("turning", velocity[2], -turn, turn, "rad/s"),
    ):
        if not low <= value <= high:
            raise ValueError(f"walk {what} is {value:g} {unit}; the walk can do {low:g} to {high:g} {unit}")
    return _walk(velocity, duration)


def _walk(velocity: Velocity, seconds: float) -> Part:
    return Part(f"{WALK} {velocity[0]:g} {velocity[1]:g} {velocity[2]:g}", seconds, velocity)


def _kick(name: str, values: list[str], numbers: list[float], parameters: MotionParameters) -> Part:
    sides = {side.name.lower(): side for side in Side}
    if not values or values[0] not in sides or len(numbers) != len(values) - 1 or len(numbers) > 1:
        raise ValueError(f"{' '.join([name, *values])!r} is no kick; expected {_usage(name)}")
    side, kind = sides[values[0]], KINDS[name]
    style = KickStyle.of(parameters, kind, side)
    speed = numbers[0] if numbers else style.max_speed
    goal = KickGoal(side, style.straight, speed, kind)
    refusal = refused_numbers(goal, style.max_speed, style.straight, style.max_direction)
    if refusal:
        raise ValueError(f"{name} {values[0]}: {refusal}")
    return Part(f"{name} {values[0]} {speed:g}", KICK_TIME, kick=goal)


def _usage(name: str) -> str:
    return next(usage for usage in GRAMMAR.split(", ") if usage.startswith(f"{name} "))
