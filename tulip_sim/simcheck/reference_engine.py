"""The same robot by Pinocchio's forward dynamics and a fine integration of fourth order, as an `Engine`."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from tulip_description.model import floating_model
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand
from tulip_sim.driver import MILLISECOND, JointDriver
from tulip_sim.parameters import DriverParameters
from tulip_sim.simcheck.compliant_ground import CompliantGround, GroundParameters
from tulip_sim.simcheck.engine import Millisecond, State

Array = NDArray[np.float64]


class ReferenceEngine:
    """D(q) v' + C(q, v) v + G(q) = (0, tau) + sum J^T f, by `pin.aba` and Runge-Kutta.

    The simulator's own joint driver drives it, with torques that stay constant through a millisecond.

    Args:
        robot: As for the simulator.
        start: (n,) posture that it holds until the first command [rad].
        ground: None for a robot in the air.
        steps: Of integration a millisecond. With ground the fastest motion, a foot rolling on its four dampers, has
            the rate 4 b y^2 / I = 17000 / s; 20 steps keep that well inside the method's region of stability.
    """

    def __init__(
        self, robot: Robot, start: Array, ground: GroundParameters | None = None, steps: int | None = None
    ) -> None:
        self.robot, self._now = robot, 0
        self._model = floating_model(robot)
        self._data = self._model.createData()
        self._driver = JointDriver(robot, DriverParameters(), start)
        self._ground = None if ground is None else CompliantGround(self._model, robot, ground)
        self._steps = steps if steps is not None else (5 if ground is None else 20)
        self._com = np.array(robot.links[0].com)
        self._push, self._push_end = np.zeros(3), 0
        self._forces = pin.StdVec_Force()
        for _ in range(self._model.njoints):
            self._forces.append(pin.Force.Zero())
        self.set_state(State(pin.neutral(self._model), np.zeros(self._model.nv)))

    @property
    def state(self) -> State:
        """The state now."""
        return State(self._q.copy(), self._v.copy())

    def set_state(self, state: State) -> None:
        """Put the robot into a state."""
        self._q, self._v = state.q.copy(), state.v.copy()
        if self._ground is not None:
            self._ground.release()

    def apply(self, command: JointCommand) -> str:
        """Give a command to the joint driver; return "" or why it is not taken."""
        return self._driver.accept(command, self._now)

    def push(self, force: ArrayLike, milliseconds: int) -> None:
        """Push the trunk at its CoM with a force (3,) in map [N] from now on."""
        self._push, self._push_end = np.array(force, dtype=float), self._now + milliseconds * MILLISECOND

    def advance(self) -> Millisecond:
        """Let a millisecond pass."""
        n = len(self.robot.joint_names)
        efforts = self._driver.torques(self._now, self._q[-n:], self._v[-n:])
        push = self._push if self._now < self._push_end else np.zeros(3)
        tau = np.concatenate([np.zeros(6), efforts])
        contact = np.zeros(6)
        for _ in range(self._steps):
            contact += self._integrate(tau, push, 1e-3 / self._steps)
        self._now += MILLISECOND
        return Millisecond(efforts, push, contact, -np.inf if self._ground is None else self._ground.depth(self._data))

    def _integrate(self, tau: Array, push: Array, h: float) -> Array:
        """Advance by one step of the classical Runge-Kutta method; return the ground's impulse."""
        q, v = self._q, self._v
        d1, a1, f1 = self._slope(q, v, tau, push)
        d2, a2, f2 = self._slope(q + h / 2 * d1, v + h / 2 * a1, tau, push)
        d3, a3, f3 = self._slope(q + h / 2 * d2, v + h / 2 * a2, tau, push)
        d4, a4, f4 = self._slope(q + h * d3, v + h * a3, tau, push)
        self._q = pin.normalize(self._model, q + h / 6 * (d1 + 2 * d2 + 2 * d3 + d4))
        self._v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        if self._ground is not None:
            pin.forwardKinematics(self._model, self._data, self._q, self._v)
            self._ground.slide(self._data)
        impulse: Array = h / 6 * (f1 + 2 * f2 + 2 * f3 + f4)
        return impulse

    def _slope(self, q: Array, v: Array, tau: Array, push: Array) -> tuple[Array, Array, Array]:
        """Return q', v' and (6,) the ground's force on the robot with its moment about the origin."""
        model, data = self._model, self._data
        rotation = pin.Quaternion(q[3:7] / np.linalg.norm(q[3:7])).toRotationMatrix()
        local = rotation.T @ push
        self._forces[1] = pin.Force(local, np.cross(self._com, local))
        wrench = np.zeros(6)
        if self._ground is not None:
            pin.forwardKinematics(model, data, q, v)
            places, forces = self._ground.forces(data)
            for side, joint in enumerate(self._ground.joints):
                own = slice(4 * side, 4 * side + 4)
                total = _resultant(places[own], forces[own])
                self._forces[joint] = data.oMi[joint].actInv(total)
                wrench += total.vector
        acceleration = pin.aba(model, data, q, v, tau, self._forces).copy()
        x, y, z, w = q[3:7]
        half = 0.5 * v[3:6]
        turning = np.array(  # q' = q * (w, 0) / 2 of the quaternion
            [
                w * half[0] + y * half[2] - z * half[1],
                w * half[1] + z * half[0] - x * half[2],
                w * half[2] + x * half[1] - y * half[0],
                -x * half[0] - y * half[1] - z * half[2],
            ]
        )
        return np.concatenate([rotation @ v[:3], turning, v[6:]]), acceleration, wrench


def _resultant(places: Array, forces: Array) -> pin.Force:
    """Return the sum of forces (k, 3) at places (k, 3), and of their moments about the origin."""
    product = places.T @ forces  # sum of p f^T, whose antisymmetric part is the moment
    moment = np.array([product[1, 2] - product[2, 1], product[2, 0] - product[0, 2], product[0, 1] - product[1, 0]])
    return pin.Force(forces.sum(axis=0), moment)
