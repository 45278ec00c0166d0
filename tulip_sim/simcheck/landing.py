"""Step impact: one foot stands, the other comes down flat at some speed and stops on the ground.

Rigid bodies that meet rigid ground change their velocity at once. With J the Jacobian of the points that the impact
stops, D(q) (v+ - v-) = J^T p and J v+ = 0: `pin.impulseDynamics`. It says nothing of which points stop; if a foot would
have to be pulled down (p_z < 0) it leaves the ground instead, and is left out of J.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot, load_robot
from tulip_sim.simcheck.engine import Engine, Recording, State
from tulip_sim.simcheck.experiment import Experiment, on_ground

Array = NDArray[np.float64]

DURATION = 20  # [ms]
SOLES = (frames.LEFT_SOLE, frames.RIGHT_SOLE)
LEFT = slice(6, 12)  # of v
SCISSORS = 0.10  # [m] by which the landing foot is ahead


@dataclass(frozen=True)
class Impact:
    """What rigid-body impact says.

    Attributes:
        v: (6 + n,) velocity after it.
        impulses: (2, 6) on the left and the right sole, at their frames in map: linear [N s] and angular [N m s].
    """

    v: Array
    impulses: Array


def landing(speed: float) -> Experiment:
    """Return the experiment: both soles on the ground, the left one coming down at a speed [m/s] by its leg alone."""
    robot = load_robot()
    model = floating_model(robot)
    q = _step(robot, model)
    v = np.zeros(model.nv)
    v[LEFT] = np.linalg.solve(_jacobian(model, q, frames.LEFT_SOLE)[:, LEFT], [0.0, 0.0, -speed, 0.0, 0.0, 0.0])

    def before(engine: Engine, now: int) -> None:
        """The driver holds the standing posture."""

    return Experiment(robot, State(q, v), DURATION, before, grounded=True)


def rigid_impact(robot: Robot, before: State) -> Impact:
    """Return what plastic impact of both soles, or of those that push, makes of a state."""
    model = floating_model(robot)
    data = model.createData()
    standing = list(SOLES)
    while True:
        jacobian = np.concatenate([_jacobian(model, before.q, sole) for sole in standing])
        after = pin.impulseDynamics(model, data, before.q, before.v, jacobian).copy()
        impulses = dict(zip(standing, data.impulse_c.reshape(-1, 6).copy(), strict=True))
        pulled = [sole for sole in standing if impulses[sole][2] < 0.0]
        if not pulled:
            return Impact(after, np.array([impulses.get(sole, np.zeros(6)) for sole in SOLES]))
        standing = [sole for sole in standing if sole not in pulled]


def at_end_of_step(experiment: Experiment, run: Recording) -> State:
    """Return the start of an experiment with the velocity that its first step has without the ground.

    A step of the simulator first lets weight and torques act, and then stops what would go into the ground.
    """
    model = floating_model(experiment.robot)
    q, v = experiment.state
    tau = np.concatenate([np.zeros(6), run.efforts[0]])
    return State(q, v + 1e-3 * pin.aba(model, model.createData(), q, v, tau))


def _step(robot: Robot, model: pin.Model) -> Array:
    """Return q with the left sole ahead of the right one, both flat on the ground."""
    q = on_ground(robot, standing_posture(robot).joint_positions, frames.LEFT_SOLE, 0.0)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    goal = data.oMf[model.getFrameId(frames.LEFT_SOLE)].translation + np.array([SCISSORS, 0.0, 0.0])
    for _ in range(20):  # Newton's method
        pin.framesForwardKinematics(model, data, q)
        sole = data.oMf[model.getFrameId(frames.LEFT_SOLE)]
        error = np.concatenate([goal - sole.translation, -pin.log3(sole.rotation)])
        step = np.zeros(model.nv)
        step[LEFT] = np.linalg.solve(_jacobian(model, q, frames.LEFT_SOLE)[:, LEFT], error)
        q = pin.integrate(model, q, step)
    if np.linalg.norm(error) > 1e-10:
        raise ValueError(f"the left leg does not reach {SCISSORS} m ahead: it is {np.linalg.norm(error)} m off")
    return q


def _jacobian(model: pin.Model, q: Array, sole: str) -> Array:
    """Return (6, 6 + n) velocity and angular velocity of a sole's frame in map by v."""
    found: Array = pin.computeFrameJacobian(
        model, model.createData(), q, model.getFrameId(sole), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    return found
