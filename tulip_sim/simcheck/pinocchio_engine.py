"""What the engines without pybullet share: Pinocchio's model, the simulator's joint driver, pushes."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from tulip_description.model import floating_model
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand
from tulip_sim.driver import MILLISECOND, JointDriver
from tulip_sim.parameters import DriverParameters
from tulip_sim.simcheck.engine import Millisecond, State

Array = NDArray[np.float64]


class PinocchioEngine(ABC):
    """D(q) v' + C(q, v) v + G(q) = (0, tau) + sum J^T f. How it meets the ground is up to its kinds.

    The simulator's own joint driver drives it, with torques that stay constant through a millisecond.

    Args:
        robot: As for the simulator.
        start: (n,) posture that it holds until the first command [rad].
        steps: Of integration a millisecond.
    """

    def __init__(self, robot: Robot, start: Array, steps: int) -> None:
        self.robot, self._steps, self._now = robot, steps, 0
        self._model = floating_model(robot)
        self._data = self._model.createData()
        self._driver = JointDriver(robot, DriverParameters(), start)
        self._com = np.array(robot.links[0].com)
        self._push, self._push_end = np.zeros(3), 0
        self._forces = pin.StdVec_Force()
        """On each joint's body, in its own frame."""
        for _ in range(self._model.njoints):
            self._forces.append(pin.Force.Zero())
        self._q, self._v = pin.neutral(self._model), np.zeros(self._model.nv)

    @property
    def state(self) -> State:
        """The state now."""
        return State(self._q.copy(), self._v.copy())

    def set_state(self, state: State) -> None:
        """Put the robot into a state."""
        self._q, self._v = state.q.copy(), state.v.copy()

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
            contact += self._step(tau, push, 1e-3 / self._steps)
        self._now += MILLISECOND
        return Millisecond(efforts, push, contact, self._depth())

    def _acceleration(self, q: Array, v: Array, tau: Array, push: Array) -> Array:
        """Return (6 + n,) v' under torques, push and what else stands in `_forces`."""
        local = quaternion_matrix((q[3:7] / np.linalg.norm(q[3:7])).tolist()).T @ push
        self._forces[1] = pin.Force(local, np.cross(self._com, local))
        acceleration: Array = pin.aba(self._model, self._data, q, v, tau, self._forces).copy()
        return acceleration

    @abstractmethod
    def _step(self, tau: Array, push: Array, h: float) -> Array:
        """Advance by a time [s]; return (6,) the ground's impulse and its moment about the origin."""

    @abstractmethod
    def _depth(self) -> float:
        """Return how deep the lowest corner of a sole is in the ground [m]."""
