"""The robot on rigid ground that takes whole soles, by `pin.impulseDynamics`, as an `Engine`.

With J the Jacobian of the soles that the ground stops, D(q) (v+ - v-) = J^T p and J v+ = 0. A foot that would have to
be pulled down (p_z < 0) leaves the ground instead, and is left out of J. Each small step lets weight and torques change
the velocity, and then the ground (Moreau's time stepping). It is made for landings of flat feet: a sole on the ground
neither tilts nor slips, however large the impulse that this takes.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.robot import Robot
from tulip_sim.simcheck.pinocchio_engine import PinocchioEngine

Array = NDArray[np.float64]

SOLES = (frames.LEFT_SOLE, frames.RIGHT_SOLE)
STEPS = 20  # a millisecond


class RigidEngine(PinocchioEngine):
    """Forward dynamics between impacts of flat soles.

    Args:
        robot: As for the simulator.
        start: (n,) posture that it holds until the first command [rad].
    """

    def __init__(self, robot: Robot, start: Array) -> None:
        super().__init__(robot, start, STEPS)

    def impact(self, v: Array) -> tuple[Array, Array]:
        """Return (6 + n,) the velocity after an impact of the flat soles in the present posture, and the impulses.

        Args:
            v: (6 + n,) before it.

        Returns:
            The velocity, and (2, 6) impulse [N s] and its moment about each sole's frame [N m s], in map; zeros for a
            sole that leaves the ground.
        """
        standing = list(SOLES)
        while standing:
            jacobian = np.concatenate([sole_jacobian(self._model, self._q, sole) for sole in standing])
            after = pin.impulseDynamics(self._model, self._data, self._q, v, jacobian).copy()
            impulses = dict(zip(standing, self._data.impulse_c.reshape(-1, 6).copy(), strict=True))
            pushing = [sole for sole in standing if impulses[sole][2] >= 0.0]
            if pushing == standing:
                return after, np.array([impulses.get(sole, np.zeros(6)) for sole in SOLES])
            standing = pushing
        return v.copy(), np.zeros((2, 6))

    def _step(self, tau: Array, push: Array, h: float) -> Array:
        self._v, impulses = self.impact(self._v + h * self._acceleration(self._q, self._v, tau, push))
        places = self._soles()
        self._q = pin.integrate(self._model, self._q, h * self._v)
        moments = impulses[:, 3:] + np.cross(places, impulses[:, :3])
        return np.concatenate([impulses[:, :3].sum(axis=0), moments.sum(axis=0)])

    def _depth(self) -> float:
        return -float(self._soles()[:, 2].min())

    def _soles(self) -> Array:
        """Return (2, 3) places of the soles' frames in map."""
        pin.framesForwardKinematics(self._model, self._data, self._q)
        return np.array([self._data.oMf[self._model.getFrameId(sole)].translation for sole in SOLES])


def sole_jacobian(model: pin.Model, q: Array, sole: str) -> Array:
    """Return (6, 6 + n) velocity and angular velocity of a sole's frame in map by v."""
    found: Array = pin.computeFrameJacobian(
        model, model.createData(), q, model.getFrameId(sole), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    return found
