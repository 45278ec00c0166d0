"""Eq. (2) before its columns are reduced: the CoM is linear in the masses and first moments of the bodies.

The CoM of all bodies in the sole frame of the stance foot s is their mean weighted by mass. With the rotation R_i(q)
and the origin p_i(q) of body i's frame in the sole frame, known from the kinematics alone,

    c_s(q) = sum_i ( mu_i p_i(q) + R_i(q) h_i ) = R_s(q) theta,    mu_i = m_i / M,  h_i = m_i c_i / M        (2a)

theta = (mu_1, h_1, mu_2, h_2, ...) holds the standard parameters, four of each body, and M is the whole robot's mass.
A robot at rest presses on the ground where the line of gravity through its CoM meets it. On a sole that lies level that
is (c_x, c_y); with gravity along d in the sole frame it is

    cop = (c_x, c_y) - sigma c_z,    sigma = (d_x, d_y) / d_z                                                 (2b)

which is linear in theta as well.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.frames import BASE_LINK
from tulip_description.model import Side, joint_indices, sole_model
from tulip_description.robot import Robot

Array = NDArray[np.float64]
PER_BODY = 4
"""Standard parameters of each body: mu, h_x, h_y, h_z."""


def standard_parameters(robot: Robot, total_mass: float | None = None) -> Array:
    """Return (4 links,) theta of eq. (2a), body by body in the order of `robot.links`: m_i / M, m_i c_i / M [m].

    Args:
        robot: Gives masses and CoMs.
        total_mass: M [kg]; None for the robot's own.
    """
    rows = [(link.mass, *(link.mass * np.array(link.com))) for link in robot.links]
    return np.array(rows).ravel() / (robot.mass if total_mass is None else total_mass)


class CopRows(NamedTuple):
    """What the CoP of one posture depends on.

    Attributes:
        com: (3, p) rows of the CoM in the sole frame, eq. (2a).
        cop: (2, p) rows of the CoP, eq. (2b).
        slope_change: (2, 2) derivative of sigma by beta, the IMU's mounting angles about x and y of base_link: the true
            direction of gravity is down + beta x down. The CoP changes by -c_z times that.
    """

    com: Array
    cop: Array
    slope_change: Array


class ComRegressor:
    """R_s(q) of eq. (2a) for one robot and one stance foot. Some 40 us a posture."""

    def __init__(self, robot: Robot, side: Side) -> None:
        """Make it.

        Args:
            robot: Its kinematics only; masses and CoMs play no part.
            side: The stance foot.

        Raises:
            ValueError: if side is neither "left" nor "right".
        """
        self._model = sole_model(robot, side)
        self._data = self._model.createData()
        self._order = joint_indices(self._model, robot)
        self._frames = [self._model.getFrameId(link.name) for link in robot.links]
        self._base = self._model.getFrameId(BASE_LINK)

    def com(self, joint_positions: Array) -> Array:
        """Return (3, 4 links) R_s(q), whose product with `standard_parameters` is the CoM in the sole frame [m].

        Args:
            joint_positions: (n,) order of `robot.joint_names` [rad].

        Raises:
            ValueError: if joint_positions has a wrong shape.
        """
        self._move(joint_positions)
        rows = np.empty((3, len(self._frames), PER_BODY))
        for body, frame in enumerate(self._frames):
            placement = self._data.oMf[frame]
            rows[:, body, 0] = placement.translation
            rows[:, body, 1:] = placement.rotation
        return rows.reshape(3, -1)

    def cop(self, joint_positions: Array, down: Array) -> CopRows:
        """Return the rows of the CoP, eq. (2b).

        Args:
            joint_positions: (n,) order of `robot.joint_names` [rad].
            down: (3,) unit vector of gravity in base_link, as the IMU tells it.

        Raises:
            ValueError: if joint_positions has a wrong shape.
        """
        com = self.com(joint_positions)
        turn = self._data.oMf[self._base].rotation
        d = turn @ down
        slope = d[:2] / d[2]
        x, y, z = down
        change = turn @ np.array([[0.0, z], [-z, 0.0], [y, -x]])  # of d: columns e_x x down, e_y x down
        return CopRows(com, com[:2] - np.outer(slope, com[2]), (change[:2] - np.outer(slope, change[2])) / d[2])

    def _move(self, joint_positions: Array) -> None:
        q = np.empty(self._model.nq)
        if joint_positions.shape != self._order.shape:
            raise ValueError(f"joint_positions has shape {joint_positions.shape}; expected {self._order.shape}")
        q[self._order] = joint_positions
        pin.framesForwardKinematics(self._model, self._data, q)


@cache
def regressor_of(robot: Robot, side: Side) -> ComRegressor:
    """Return the regressor of a robot on a foot, made once."""
    return ComRegressor(robot, side)
