"""Part of bench identify: what the model of the body is worth to a walk, step by step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_description.robot import Robot
from tulip_motion.interface import WalkCommand, WalkMode
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench.body import Body
from tulip_sim.parameters import WorldParameters

Array = NDArray[np.float64]

WORLD = WorldParameters(mass_spread=0.0)
"""Links weigh what the true body says; friction, delays and sensor errors are random as ever."""
START = Pose2D(-4.0, 2.2, 0.0)
SPEED, FAST = 0.2, 0.5  # [m/s]
STEPS = 100
FAST_TIME = 20.0  # [s]
STEADY = 10
"""Steps from the start that do not count: the first shift the weight and gain speed."""
LEARNED = 30
"""Last steps, in which a walk that learns shows what it has learned."""
WALKS: Mapping[str, tuple[str, str]] = {
    "wrong": ("wrong", "none"),
    "identified": ("identified", "none"),
    "true": ("true", "none"),
    "wrong + ILC": ("wrong", "waveform"),
    "identified + ILC": ("identified", "waveform"),
}
"""Model that motion control has, and learning law, by the walk's name."""


@dataclass(frozen=True)
class Walk:
    """How a walk went, step by step.

    Attributes:
        joints: RMS of the error of the twelve joints, by encoders [mrad].
        zmp: RMS of measured CoP less commanded ZMP [mm].
        offsets: Mean of the same, forwards and to the left [mm]: what a wrong model does in every step alike.
        upright: Whether the robot did not fall.
    """

    joints: tuple[float, ...]
    zmp: tuple[float, ...]
    offsets: tuple[tuple[float, float], ...]
    upright: bool

    def errors(self, learns: bool) -> tuple[float, float, float]:
        """Return joint error [mrad], ZMP error and length of the mean ZMP offset [mm] over the steps that count."""
        counted = slice(-LEARNED, None) if learns else slice(STEADY, None)
        if len(self.joints) <= STEADY + LEARNED:
            return math.nan, math.nan, math.nan
        offset = np.mean(self.offsets[counted], axis=0)
        return float(np.mean(self.joints[counted])), float(np.mean(self.zmp[counted])), math.hypot(*offset.tolist())


def walk(seed: int, true_body: Robot, believed: Robot, learning: str) -> Walk:
    """Walk `STEPS` steps straight ahead.

    Args:
        seed: Of the world.
        true_body: What the robot really weighs.
        believed: What motion control takes it for.
        learning: Law, or "none".

    Raises:
        ValueError: if motion control cannot walk with what it believes.
    """
    body = _body(seed, true_body, believed, learning)
    command = WalkCommand(0, WalkMode.WALK, (SPEED, 0.0, 0.0))
    state = body.motion.state()
    first = state.step_count
    steps: list[tuple[float, float, tuple[float, float]]] = []
    joints: list[Array] = []
    zmp: list[Array] = []
    while not body.fallen:
        before = state
        body.tick(command)
        state = body.motion.state()
        if state.step_count != before.step_count and joints:
            off = np.array(zmp)
            mean_x, mean_y = (1e3 * np.nanmean(off, axis=0)).round(2).tolist()  # in the air there is no CoP
            joint_error = 1e3 * math.sqrt(float(np.mean(np.square(joints))))
            zmp_error = 1e3 * math.sqrt(float(np.nanmean(np.sum(off**2, axis=1))))
            steps.append((round(joint_error, 3), round(zmp_error, 2), (mean_x, mean_y)))
            joints.clear()
            zmp.clear()
            if state.step_count - first > STEPS:
                break
        joints.append(before.joint_positions_desired - state.joint_positions)
        zmp.append(state.zmp - state.zmp_desired)
    return Walk(
        tuple(step[0] for step in steps),
        tuple(step[1] for step in steps),
        tuple(step[2] for step in steps),
        not body.fallen,
    )


def walks_fast(seed: int, true_body: Robot, believed: Robot) -> bool:
    """Return whether the robot walks at `FAST` for `FAST_TIME` without a fall."""
    body = _body(seed, true_body, believed, "none")
    body.go(FAST_TIME, (FAST, 0.0, 0.0))
    return not body.fallen


def _body(seed: int, true_body: Robot, believed: Robot, learning: str) -> Body:
    parameters = MotionParameters(learning=learning)
    body = Body(seed, START, parameters=parameters, world=WORLD, true_body=true_body, believed=believed)
    body.go(0.5)
    return body
