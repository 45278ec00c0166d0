"""The same robot by Pinocchio's forward dynamics and a fine integration of fourth order, as an `Engine`."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot
from tulip_sim.simcheck.compliant_ground import CompliantGround, GroundParameters
from tulip_sim.simcheck.engine import State
from tulip_sim.simcheck.pinocchio_engine import PinocchioEngine

Array = NDArray[np.float64]

STEPS_IN_AIR = 5  # a millisecond; energy is kept to 1e-8 J
# A foot that rolls on its four dampers is the fastest motion: rate 4 b y^2 / I, 35000 / s for the stiffest ground. A
# product of rate and step below 1 keeps the method, which is stable up to 2.8, accurate.
STEPS_ON_GROUND = 40


class ReferenceEngine(PinocchioEngine):
    """`pin.aba` and the classical Runge-Kutta method; springs and dampers carry the soles.

    Args:
        robot: As for the simulator.
        start: (n,) posture that it holds until the first command [rad].
        ground: None for a robot in the air.
    """

    def __init__(self, robot: Robot, start: Array, ground: GroundParameters | None = None) -> None:
        super().__init__(robot, start, STEPS_IN_AIR if ground is None else STEPS_ON_GROUND)
        self._ground = None if ground is None else CompliantGround(self._model, robot, ground)

    def set_state(self, state: State) -> None:
        """Put the robot into a state."""
        super().set_state(state)
        if self._ground is not None:
            self._ground.release()

    def _step(self, tau: Array, push: Array, h: float) -> Array:
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

    def _depth(self) -> float:
        return -np.inf if self._ground is None else self._ground.depth(self._data)

    def _slope(self, q: Array, v: Array, tau: Array, push: Array) -> tuple[Array, Array, Array]:
        """Return q', v' and (6,) the ground's force on the robot with its moment about the origin."""
        wrench = np.zeros(6)
        if self._ground is not None:
            pin.forwardKinematics(self._model, self._data, q, v)
            places, forces = self._ground.forces(self._data)
            for side, joint in enumerate(self._ground.joints):
                own = slice(4 * side, 4 * side + 4)
                total = _resultant(places[own], forces[own])
                self._forces[joint] = self._data.oMi[joint].actInv(total)
                wrench += total.vector
        moving = quaternion_matrix((q[3:7] / np.linalg.norm(q[3:7])).tolist()) @ v[:3]
        return np.concatenate([moving, _turning(q, v), v[6:]]), self._acceleration(q, v, tau, push), wrench


def _turning(q: Array, v: Array) -> list[float]:
    """Return (4,) the derivative of the trunk's quaternion, half its product with the angular velocity."""
    x, y, z, w = q[3:7].tolist()
    a, b, c = (0.5 * v[3:6]).tolist()
    return [w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a, -x * a - y * b - z * c]


def _resultant(places: Array, forces: Array) -> pin.Force:
    """Return the sum of forces (k, 3) at places (k, 3), and of their moments about the origin."""
    product = places.T @ forces  # sum of p f^T, whose antisymmetric part is the moment
    moment = np.array([product[1, 2] - product[2, 1], product[2, 0] - product[0, 2], product[0, 1] - product[1, 0]])
    return pin.Force(forces.sum(axis=0), moment)
