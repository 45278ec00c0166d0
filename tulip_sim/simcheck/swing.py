"""Free swinging of a leg: the trunk is held, one leg swings, loose under its weight or driven."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tulip_description.materials import GRAVITY
from tulip_description.posture import standing_posture
from tulip_description.robot import LEG_JOINTS, Robot, load_robot
from tulip_sim.simcheck.engine import Engine, State
from tulip_sim.simcheck.experiment import Experiment, command, loosened

HELD_MASS = 1.0e6  # [kg] of a trunk that the legs cannot move: the swing shifts it by micrometres
HEIGHT = 3.0  # [m] of base_link: nothing touches the ground
DURATION = 2000  # [ms]
LEFT = LEG_JOINTS[:6]
LOOSE = np.array(
    [0.0, 1.0, 1.0, 0.0, 0.0, 0.0]
)  # hip roll and pitch; what hangs on them stays within the joints' ranges
RAISED = np.array([0.0, 0.25, -0.6, 0.0, 0.0, 0.0])  # [rad] from where the loose leg is let go, beside standing
STRIDES = np.array([0.0, 0.0, -0.35, 0.35, 0.1, 0.0])  # [rad] amplitudes of the driven leg
RATE = 8.0  # [rad/s] of its swinging


def swing(driven: bool) -> Experiment:
    """Return the experiment.

    Args:
        driven: Whether the driver swings the leg to and fro; else its hip is loose in roll and pitch.
    """
    robot = _held(load_robot())
    joints = standing_posture(load_robot()).joint_positions.copy()
    standing, weight = joints[:6].copy(), robot.mass * GRAVITY
    speeds = np.zeros(len(joints))
    if driven:
        speeds[:6] = RATE * STRIDES
    else:
        joints[:6] += RAISED

    def before(engine: Engine, now: int) -> None:
        engine.push([0.0, 0.0, weight], 1)  # bears the weight, which would else accelerate the trunk
        phase = RATE * now * 1e-3
        if driven:
            wanted = command(robot, now, LEFT, standing + STRIDES * np.sin(phase), RATE * STRIDES * np.cos(phase))
        else:
            wanted = loosened(command(robot, now, LEFT, standing), LOOSE)
        engine.apply(wanted)

    q = np.concatenate([[0.0, 0.0, HEIGHT, 0.0, 0.0, 0.0, 1.0], joints])
    return Experiment(robot, State(q, np.concatenate([np.zeros(6), speeds])), DURATION, before)


def _held(robot: Robot) -> Robot:
    trunk = replace(robot.links[0], mass=HELD_MASS, inertia=(HELD_MASS,) * 3)
    return replace(robot, links=(trunk, *robot.links[1:]))
