"""Step impact: one foot stands, the other comes down flat at some speed and stops on the ground."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot, load_robot
from tulip_sim.simcheck.engine import Engine, State
from tulip_sim.simcheck.experiment import Experiment, command, loosened, on_ground
from tulip_sim.simcheck.rigid_engine import sole_jacobian

Array = NDArray[np.float64]

DURATION = 20  # [ms]
LEFT = slice(6, 12)  # of v
STRIDE = 0.10  # [m] by which the landing foot is ahead


def landing(speed: float, driven: bool) -> Experiment:
    """Return the experiment: both soles at the ground, the left one coming down by its leg alone.

    Args:
        speed: Of the left sole [m/s].
        driven: Whether the driver holds the posture, and so brakes the leg; else all joints are loose.
    """
    robot = load_robot()
    model = floating_model(robot)
    q = _stride(robot, model)
    v = np.zeros(model.nv)
    v[LEFT] = np.linalg.solve(sole_jacobian(model, q, frames.LEFT_SOLE)[:, LEFT], [0.0, 0.0, -speed, 0.0, 0.0, 0.0])

    def before(engine: Engine, now: int) -> None:
        if now == 0:
            engine.apply(loosened(command(robot, now, robot.joint_names, q[7:]), not driven))

    return Experiment(robot, State(q, v), DURATION, before)


def _stride(robot: Robot, model: pin.Model) -> Array:
    """Return q with the left sole ahead of the right one, both flat on the ground."""
    q = on_ground(robot, standing_posture(robot).joint_positions, frames.LEFT_SOLE, 0.0)
    data = model.createData()
    sole = data.oMf[model.getFrameId(frames.LEFT_SOLE)]
    pin.framesForwardKinematics(model, data, q)
    goal = sole.translation + np.array([STRIDE, 0.0, 0.0])
    for _ in range(20):  # Newton's method
        error = np.concatenate([goal - sole.translation, -pin.log3(sole.rotation)])
        if np.linalg.norm(error) < 1e-12:
            return q
        step = np.zeros(model.nv)
        step[LEFT] = np.linalg.solve(sole_jacobian(model, q, frames.LEFT_SOLE)[:, LEFT], error)
        q = pin.integrate(model, q, step)
        pin.framesForwardKinematics(model, data, q)
    raise ValueError(f"the left leg does not reach {STRIDE} m ahead: the sole is {error} off [m, rad]")
