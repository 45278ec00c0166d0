"""Free swinging of a leg: the trunk is held, one leg hangs loose and swings under its weight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tulip_description.posture import standing_posture
from tulip_description.robot import JOINTS, LEG_JOINTS, Robot, load_robot
from tulip_sim.bodies import GRAVITY
from tulip_sim.simcheck.engine import Engine, State
from tulip_sim.simcheck.experiment import Experiment, command

HELD_MASS = 1.0e6  # [kg] of a trunk that the legs cannot move: the swing shifts it by micrometres
HEIGHT = 3.0  # [m] of base_link: nothing touches the ground
DURATION = 1500  # [ms]
RAISED = {"left_hip_pitch": -0.9, "left_knee": 0.9, "left_ankle_pitch": 0.0}  # [rad] where the leg is let go
LEFT = LEG_JOINTS[:6]


def swing(driven: bool) -> Experiment:
    """Return the experiment.

    Args:
        driven: Whether the driver moves the leg to and fro as in walking; else all its joints are limp.
    """
    robot = _held(load_robot())
    joints = standing_posture(load_robot()).joint_positions.copy()
    if not driven:
        for name, angle in RAISED.items():
            joints[JOINTS.index(name)] = angle
    start, weight = joints[:6].copy(), robot.mass * GRAVITY

    def before(engine: Engine, now: int) -> None:
        engine.push([0.0, 0.0, weight], 1)  # bears the weight, which would else accelerate the trunk
        if driven:
            angle, speed = 0.35 * np.sin(8.0 * now * 1e-3), 2.8 * np.cos(8.0 * now * 1e-3)
            shape = np.array([0.0, 0.0, -1.0, 1.0, 0.3, 0.0])
            engine.apply(command(robot, now, LEFT, start + angle * shape, speed * shape))
        else:
            engine.apply(command(robot, now, LEFT, start, stiffness=0.0))

    state = State(np.concatenate([[0.0, 0.0, HEIGHT, 0.0, 0.0, 0.0, 1.0], joints]), np.zeros(6 + len(joints)))
    return Experiment(robot, state, DURATION, before)


def _held(robot: Robot) -> Robot:
    trunk = replace(robot.links[0], mass=HELD_MASS, inertia=(HELD_MASS,) * 3)
    return replace(robot, links=(trunk, *robot.links[1:]))
