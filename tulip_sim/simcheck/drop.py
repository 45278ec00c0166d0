"""Single-leg drop: the robot falls some centimetres onto one sole, its joints held."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.optimize import root

from tulip_description import frames
from tulip_description.materials import GRAVITY
from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import JOINTS, Robot, load_robot
from tulip_sim.simcheck.engine import Engine, State
from tulip_sim.simcheck.experiment import Experiment, command, on_ground

Array = NDArray[np.float64]

AFTER = 300  # [ms] after touching
LIFT = 0.35  # [rad] by which the other leg is bent more
COM_AHEAD = 0.040  # [m] of the sole frame, near the middle of the sole


def drop(height: float) -> Experiment:
    """Return the experiment: from a height [m] of the left sole above the ground."""
    robot = load_robot()
    joints = one_leg_posture(robot)

    def before(engine: Engine, now: int) -> None:
        engine.apply(command(robot, now, robot.joint_names, joints))

    state = State(on_ground(robot, joints, frames.LEFT_SOLE, height), np.zeros(6 + len(joints)))
    falling = math.sqrt(2.0 * height / GRAVITY)
    return Experiment(robot, state, round(1e3 * falling) + AFTER, before)


def one_leg_posture(robot: Robot) -> Array:
    """Return (n,) a posture with an upright trunk, the CoM above the flat left sole and the right one lifted [rad]."""
    model = floating_model(robot)
    data = model.createData()
    joints = standing_posture(robot).joint_positions.copy()
    for name, share in (("right_hip_pitch", -1.0), ("right_knee", 2.0), ("right_ankle_pitch", -1.0)):
        joints[JOINTS.index(name)] += LIFT * share

    def posture(lean: Array) -> Array:
        found = joints.copy()
        for angle, axis in zip(lean, ("roll", "pitch"), strict=True):
            found[JOINTS.index(f"left_hip_{axis}")] += angle
            found[JOINTS.index(f"left_ankle_{axis}")] -= angle
        return found

    def error(lean: Array) -> Array:
        q = on_ground(robot, posture(lean), frames.LEFT_SOLE, 0.0)
        pin.framesForwardKinematics(model, data, q)
        sole = data.oMf[model.getFrameId(frames.LEFT_SOLE)].translation
        away: Array = (pin.centerOfMass(model, data, q) - sole)[:2] - np.array([COM_AHEAD, 0.0])
        return away

    solution = root(error, np.zeros(2), tol=1e-10)
    if not solution.success:
        raise ValueError(f"no lean brings the CoM above the left sole: {solution.message}")
    return posture(solution.x)
