"""Standing push: the robot stands, its joints held by their springs, and is pushed for a tenth of a second."""

from __future__ import annotations

import numpy as np

from tulip_description import frames
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_sim.simcheck.engine import Engine, State
from tulip_sim.simcheck.experiment import Experiment, on_ground

SETTLE = 400  # [ms] before the push: the joints sag under the weight
PULSE = 100  # [ms]
DURATION = 1400  # [ms]
PUSHES = {"forward": (25.0, 0.0, 0.0), "left": (0.0, 40.0, 0.0)}  # [N] what the springs alone resist


def standing_push(direction: str) -> Experiment:
    """Return the experiment, for a direction out of `PUSHES`."""
    robot = load_robot()
    joints = standing_posture(robot).joint_positions

    def before(engine: Engine, now: int) -> None:
        if now == SETTLE:
            engine.push(PUSHES[direction], PULSE)

    state = State(on_ground(robot, joints, frames.LEFT_SOLE, 0.0), np.zeros(6 + len(joints)))
    return Experiment(robot, state, DURATION, before)
