"""Random commands: what a robot is told to do when any walk will do."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tulip_motion.parameters import MotionParameters

Command = tuple[float, tuple[float, float, float] | None]
"""How long [s], and the velocity to walk with (forward [m/s], left [m/s], turning [rad/s]), or None to stand."""

KINDS = ("forward", "backward", "sideways", "turn", "arc", "stand")


def random_commands(rng: np.random.Generator, seconds: float) -> Iterator[Command]:
    """Yield commands of all kinds, in random order, that fill a time [s].

    Args:
        rng: Source of all randomness.
        seconds: How long all of them take together, in tenths.
    """
    p = MotionParameters()
    left = seconds
    while left > 0.05:
        kind = KINDS[rng.integers(len(KINDS))]
        share, side, duration = float(rng.uniform(0.2, 1.0)), float(rng.choice((-1.0, 1.0))), float(rng.uniform(1.5, 5))
        duration = round(min(duration, left), 1)  # whole ticks
        velocity = {
            "forward": (share * p.max_speed_forward, 0.0, 0.0),
            "backward": (-share * p.max_speed_backward, 0.0, 0.0),
            "sideways": (0.0, side * share * p.max_speed_sideways, 0.0),
            "turn": (0.0, 0.0, side * share * p.max_turn_rate),
            "arc": (share * 0.7 * p.max_speed_forward, side * 0.3 * p.max_speed_sideways, side * share * 0.5),
            "stand": None,
        }[kind]
        yield duration, velocity
        left -= duration
