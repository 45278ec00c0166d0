"""Flight: the robot falls freely, turns and moves its legs. Only the weight acts on it from outside."""

from __future__ import annotations

import numpy as np

from tulip_description.posture import standing_posture
from tulip_description.robot import LEG_JOINTS, load_robot
from tulip_sim.simcheck.engine import Engine, State
from tulip_sim.simcheck.experiment import Experiment, command

HEIGHT = 3.0  # [m] of base_link at the start
DURATION = 500  # [ms] it falls 1.2 m
TURN = (1.0, 2.0, 0.5)  # [rad/s] of the trunk at the start
RATE = 10.0  # [rad/s] of the joints' swinging
SWINGS = 0.3 * np.array([0.5, 0.3, -1.0, 1.2, 0.4, 0.1, -0.3, 0.4, 1.0, 0.8, -0.6, -0.1])  # [rad] of the legs' joints


def flight() -> Experiment:
    """Return the experiment."""
    robot = load_robot()
    joints = standing_posture(robot).joint_positions

    def before(engine: Engine, now: int) -> None:
        phase = RATE * now * 1e-3
        wanted = joints[:12] + SWINGS * np.sin(phase)
        engine.apply(command(robot, now, LEG_JOINTS, wanted, RATE * SWINGS * np.cos(phase)))

    q = np.concatenate([[0.0, 0.0, HEIGHT, 0.0, 0.0, 0.0, 1.0], joints])
    v = np.concatenate([np.zeros(3), TURN, RATE * SWINGS, np.zeros(len(joints) - 12)])
    return Experiment(robot, State(q, v), DURATION, before)
