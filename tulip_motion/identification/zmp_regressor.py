"""The ZMP equation of the whole robot, linear in its inertial parameters.

The ground gives what Newton and Euler ask for: with the momentum l and the angular momentum k about a point o,

    F = dl/dt - m g,    M_o = dk/dt - (c - o) x m g                                        (D1)

These are the six base rows of the inverse dynamics of the free-flyer model, and all inverse dynamics are linear in the
ten standard parameters of each body, pi = (m, m c, I about the joint; ...):

    (F, M_base) = Y(q, v, a) pi                                                            (D2)

The ZMP is the point of the ground about which the horizontal moments vanish, and the cells measure it as the CoP. So
with u upwards and o the measured CoP, each instant gives two equations, and the cells' sum of forces the third:

    u x M_o = 0,    u . F = sum of the cells,    M_o = M_base - o x F                      (D3)

With any parameters, the ZMP that they predict lies (u x M_o) / (u . F) away from o.                               (D4)

A sole carries on its rim, beyond its cells, and the cells may sit a little elsewhere than drawn: then they show the
CoP's way from the middle of a foot too short or too long. Two spreads a are parameters like the others:

    o = o_cells + a_x (way along the sole) + a_y (way across)                              (D5)

and so is the error g that the gains of all cells have in common, which no motion tells from a mass:

    sum of the cells = (1 + g) u . F                                                       (D10)

All of it is written in axes of base_link. Inertial forces do not depend on where the base is or how fast it goes, only
on its rotation and on the specific force that an accelerometer at base_link would feel, f = a - g: no position,
no heading and no speed have to be estimated.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.robot import Robot

Array = NDArray[np.float64]
PER_BODY = 10
CELL_PARAMETERS = 3
"""Spreads of the cells along and across the soles, eq. (D5), and the error of their gains, eq. (D10)."""
PARAMETER_NAMES = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
"""Of each moving body, in Pinocchio's order: mass [kg], first moments [kg m] and inertia [kg m^2] about its joint."""


class BodyMotion(NamedTuple):
    """The motion of the whole body at one instant, as inertial forces depend on it.

    Attributes:
        q, dq, ddq: (n,) joint positions, velocities, accelerations [rad], [rad/s], [rad/s^2].
        angular_velocity, angular_acceleration: (3,) of base_link in base_link [rad/s], [rad/s^2].
        specific_force: (3,) at base_link's origin, in base_link: acceleration without gravity [m/s^2].
    """

    q: Array
    dq: Array
    ddq: Array
    angular_velocity: Array
    angular_acceleration: Array
    specific_force: Array


class Ground(NamedTuple):
    """What the cells say, in base_link.

    Attributes:
        up: (3,) unit vector.
        horizontal: (2, 3) unit vectors across it, forward below base_link's x, and left.
        soles: (3,) mean of the soles that carry, each by its load [m].
        cop: (3,) centre of pressure of both feet [m].
        ways: (3, 2) of the CoP from the middle of the feet along and across the soles, for the spreads of (D5) [m].
        force: Vertical, of all cells [N].
    """

    up: Array
    horizontal: Array
    soles: Array
    cop: Array
    ways: Array
    force: float


def parameters_of(model: Any) -> Array:
    """Return (10 b,) pi: the standard parameters of the b moving bodies of a Pinocchio model, base_link first."""
    bodies = [model.inertias[i].toDynamicParameters() for i in range(1, model.njoints)]
    return np.concatenate(bodies)


def with_parameters(model: Any, parameters: Array) -> Any:
    """Return a copy of a Pinocchio model with other standard parameters (10 b,)."""
    changed = model.copy()
    for i, body in enumerate(parameters.reshape(-1, PER_BODY), start=1):
        changed.inertias[i] = pin.Inertia.FromDynamicParameters(body)
    return changed


class ZmpRegressor:
    """Y of eq. (D2), and the rows of eq. (D3)."""

    def __init__(self, robot: Robot) -> None:
        """Make the regressor of a robot; of its parameters it uses the kinematic ones alone."""
        self.robot = robot
        self._model = floating_model(robot)
        self._model.gravity.linear = np.zeros(3)  # gravity comes in with the specific force
        self._data = self._model.createData()
        self._soles = [self._model.getFrameId(name) for name in (frames.LEFT_SOLE, frames.RIGHT_SOLE)]
        self._cells = np.array([foot.cells for foot in robot.feet])
        self._middles = self._cells.mean(axis=1)

    @property
    def body_names(self) -> tuple[str, ...]:
        """Of each moving body the link that hangs on its joint; links fixed to it belong to the body."""
        children = {joint.name: joint.child for joint in self.robot.joints}
        return (self.robot.links[0].name, *(children[name] for name in self.robot.joint_names))

    def inverse_dynamics(self, motion: BodyMotion) -> Array:
        """Return (6 + n, 10 b) Y: force [N] and moment [N m] on base_link about its origin, then joint torques."""
        q = np.concatenate([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], motion.q])
        v = np.concatenate([np.zeros(3), motion.angular_velocity, motion.dq])
        a = np.concatenate([motion.specific_force, motion.angular_acceleration, motion.ddq])
        rows: Array = pin.computeJointTorqueRegressor(self._model, self._data, q, v, a)
        return rows

    def soles(self, q: Array) -> tuple[Array, Array]:
        """Return (2, 3) positions [m] and (2, 3, 3) rotations of the left and right sole in base_link."""
        pin.forwardKinematics(self._model, self._data, np.concatenate([[0, 0, 0, 0, 0, 0, 1], q]))
        placements = [pin.updateFramePlacement(self._model, self._data, frame) for frame in self._soles]
        return np.array([p.translation for p in placements]), np.array([p.rotation for p in placements])

    def ground(self, q: Array, up: Array, cells: Array) -> Ground:
        """Return what the cells say; all feet count together, so single and double support are alike.

        Args:
            q: (n,) joint positions [rad].
            up: (3,) unit vector upwards in base_link.
            cells: (2, 4) forces [N], of which some are positive.
        """
        positions, rotations = self.soles(q)
        force = float(cells.sum())
        shares = cells.sum(axis=1) / force
        moments = np.einsum("sc,sci->si", cells / force, self._cells)  # each foot's CoP in its sole, by its share
        ways = np.einsum("sik,sk->ik", rotations[:, :, :2], moments - shares[:, None] * self._middles)
        soles = shares @ positions
        cop = soles + np.einsum("sik,sk->i", rotations[:, :, :2], moments)
        return Ground(up, horizontal_axes(up), soles, cop, ways, force)

    def rows(self, motion: BodyMotion, ground: Ground) -> Array:
        """Return (3, 10 b) rows of (D3), whose products shall be 0 forward and left [N m], and the force [N].

        The first two are u x M_o, which is the force times the way from the CoP to the ZMP.
        """
        base = self.inverse_dynamics(motion)[:6]
        force, moment = base[:3], base[3:] - np.cross(ground.cop, base[:3], axisb=0, axisc=0)
        forward, left = ground.horizontal
        # u x M forward is -(left . M), and to the left it is forward . M.
        rows: Array = np.stack([-left @ moment, forward @ moment, ground.up @ force])
        return rows


def horizontal_axes(up: Array) -> Array:
    """Return (2, 3) unit vectors across `up` (3,): one below the x axis, and the one to its left."""
    forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
    forward /= np.linalg.norm(forward)
    return np.array([forward, np.cross(up, forward)])
