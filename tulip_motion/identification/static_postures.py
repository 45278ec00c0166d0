"""Postures in which the robot stands still on one foot, as far as its own model knows.

A posture is chosen by twelve numbers, its *coordinates*: the trunk's lean (2), stance hip yaw and knee (2), the six
joints of the other leg, and the head's two. The four joints that are left, hip pitch, hip roll and the two of the
ankle of the stance leg, follow: they give the trunk its lean and bring the CoM over the aim point on the sole. So every
posture is statically stable by construction, and so is everything between two of them (`posture_roads`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.model import Side, joint_indices, sole_model
from tulip_description.robot import HEAD_JOINTS, LEG_PARTS, Robot
from tulip_motion.identification.self_collision import SelfCollision

Array = NDArray[np.float64]
SOLVED = ("hip_roll", "hip_pitch", "ankle_pitch", "ankle_roll")
"""Joints of the stance leg that follow from the coordinates."""
ITERATIONS = 30
TOLERANCE = 1e-9  # [m] of the CoM, and of the trunk's lean
LARGEST_STEP = 0.2  # [rad] of a Newton step: from farther away the linearization leads astray


@dataclass(frozen=True)
class PostureParameters:
    """What a posture has to keep to, and between which coordinates it is drawn; both legs alike.

    Ranges are those of a left stance leg and a right swing leg; on the other foot, roll and yaw change their sign.
    """

    joint_margin: float = 0.08  # [rad] from the ends of joint ranges; the ankle corrects by up to 0.06
    clearance: float = 0.02  # [m] between parts of the body
    ground_clearance: float = 0.03  # [m] of the other sole's corners; a wrong CoM tilts the body by up to 0.06 rad
    torque_share: float = 0.7  # of the joints' limits, that holding still takes by the model
    lean_forward: tuple[float, float] = (-0.25, 0.60)  # x of what is up, in base_link, negated: sine of the lean
    lean_left: tuple[float, float] = (-0.30, 0.30)
    stance_yaw: tuple[float, float] = (-0.4, 0.4)  # [rad]
    stance_knee: tuple[float, float] = (0.15, 1.1)  # [rad]
    swing_yaw: tuple[float, float] = (-0.7, 0.7)  # [rad] positive turns the toes inwards
    swing_roll: tuple[float, float] = (-0.8, 0.25)  # [rad] negative takes the leg away from the other
    swing_pitch: tuple[float, float] = (-1.5, 0.7)  # [rad]
    swing_knee: tuple[float, float] = (0.1, 2.1)  # [rad]
    swing_ankle_pitch: tuple[float, float] = (-0.9, 0.8)  # [rad]
    swing_ankle_roll: tuple[float, float] = (-0.6, 0.6)  # [rad]
    head_pan: tuple[float, float] = (-1.5, 1.5)  # [rad]
    head_tilt: tuple[float, float] = (-0.5, 1.1)  # [rad]

    @property
    def ranges(self) -> Array:
        """(2, 12) lowest and highest coordinates with the left foot on the ground."""
        stance = (self.lean_forward, self.lean_left, self.stance_yaw, self.stance_knee)
        swing = (self.swing_yaw, self.swing_roll, self.swing_pitch, self.swing_knee)
        ankle = (self.swing_ankle_pitch, self.swing_ankle_roll)
        return np.array([*stance, *swing, *ankle, self.head_pan, self.head_tilt]).T


MIRROR = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1.0])
"""Signs of the coordinates of the mirrored posture on the other foot."""


@dataclass(frozen=True)
class StaticPosture:
    """A posture on one foot.

    Attributes:
        side: The stance foot.
        coordinates: (12,) that it was chosen by.
        joint_positions: (n,) [rad], order of `robot.joint_names`.
    """

    side: Side
    coordinates: Array
    joint_positions: Array

    @property
    def up(self) -> Array:
        """(3,) unit vector upwards in base_link, the sole lying level."""
        x, y = -self.coordinates[:2]
        return np.array([x, y, math.sqrt(1.0 - x * x - y * y)])


def aim_point(robot: Robot, side: Side) -> Array:
    """Return (2,) the middle of a foot's cells in its sole frame [m].

    Where all cells carry the same, errors of their gains and of their places matter least.
    """
    middle: Array = np.mean(robot.feet[0 if side == "left" else 1].cells, axis=0)
    return middle


class PostureSolver:
    """Finds and checks postures on one foot."""

    def __init__(self, robot: Robot, side: Side, parameters: PostureParameters | None = None) -> None:
        """Make a solver.

        Args:
            robot: As it is believed to be.
            side: The stance foot.
            parameters: What a posture has to keep to.
        """
        p = self.parameters = parameters or PostureParameters()
        self.robot, self.side = robot, side
        self._model = sole_model(robot, side)
        self._data = self._model.createData()
        # Pinocchio leaves out of the CoM what is fixed to the ground: here the stance foot.
        foot = self._model.inertias[0]
        self._moving_share = 1.0 - foot.mass / robot.mass
        self._com_of_foot = foot.lever * foot.mass / robot.mass
        self._order = joint_indices(self._model, robot)
        self._base = self._model.getFrameId(frames.BASE_LINK)
        self._swing_sole = self._model.getFrameId(frames.RIGHT_SOLE if side == "left" else frames.LEFT_SOLE)
        other = "right" if side == "left" else "left"
        names = (f"{side}_hip_yaw", f"{side}_knee", *(f"{other}_{part}" for part in LEG_PARTS), *HEAD_JOINTS)
        index = robot.joint_names.index
        self._chosen = np.array([index(name) for name in names])
        self._solved = np.array([index(f"{side}_{part}") for part in SOLVED])
        self._limits = robot.position_limits + p.joint_margin * np.array([[1.0], [-1.0]])
        self._torques = p.torque_share * robot.effort_limits
        self._collision = SelfCollision(robot)
        sole = robot.feet[1 if side == "left" else 0]
        self._corners = sole.corners.T
        self.aim = aim_point(robot, side)

    def coordinates_of(self, joint_positions: Array) -> Array:
        """Return the (12,) coordinates of a posture given by its joints (n,) [rad]."""
        self._place(joint_positions)
        up = self._data.oMf[self._base].rotation[2]
        return np.array([-up[0], -up[1], *joint_positions[self._chosen]])

    def solve(self, coordinates: Array, start: Array) -> StaticPosture | None:
        """Return the posture of some coordinates, or None if none was found.

        Args:
            coordinates: (12,).
            start: (n,) joint positions to begin the search from [rad].
        """
        joints = start.copy()
        joints[self._chosen] = coordinates[2:]
        for _ in range(ITERATIONS):
            error, jacobian = self._residual(joints, coordinates[:2])
            if np.abs(error).max() < TOLERANCE:
                return StaticPosture(self.side, coordinates, joints)
            step = np.linalg.lstsq(jacobian, -error, rcond=None)[0]
            joints[self._solved] += step * min(1.0, LARGEST_STEP / max(float(np.abs(step).max()), 1e-12))
        return None

    def fault(self, joint_positions: Array) -> str:
        """Return why a posture cannot be held, in words, or ""."""
        low, high = self._limits
        outside = np.flatnonzero((joint_positions < low) | (joint_positions > high))
        if outside.size:
            return f"{self.robot.joint_names[outside[0]]} is at {joint_positions[outside[0]]:.2f} rad, near its limit"
        height = self.ground_clearance(joint_positions)
        if height < self.parameters.ground_clearance:
            return f"the other sole is {1e3 * height:.0f} mm above the ground"
        torques = np.abs(self.torques(joint_positions))
        if (torques > self._torques).any():
            weak = int(np.argmax(torques / self._torques))
            return f"{self.robot.joint_names[weak]} takes {torques[weak]:.0f} N m"
        distance, parts = self._collision.clearance(joint_positions)
        return f"{parts} come as near as {1e3 * distance:.0f} mm" if distance < self.parameters.clearance else ""

    def com(self, joint_positions: Array) -> Array:
        """Return (3,) the CoM in the stance sole frame [m]."""
        pin.centerOfMass(self._model, self._data, self._configuration(joint_positions))
        return self._com()

    def ground_clearance(self, joint_positions: Array) -> float:
        """Return the height of the other sole's lowest corner above the ground [m]."""
        self._place(joint_positions)
        sole = self._data.oMf[self._swing_sole]
        return float((sole.rotation[2] @ self._corners).min() + sole.translation[2])

    def torques(self, joint_positions: Array) -> Array:
        """Return (n,) torques that hold the posture still [N m], by the model: the G(q) of eq. (1)."""
        q = self._configuration(joint_positions)
        torques: Array = pin.computeGeneralizedGravity(self._model, self._data, q)[self._order]
        return torques

    def samples(self, rng: np.random.Generator, start: Array) -> Iterator[StaticPosture]:
        """Yield random postures that can be held, without end.

        Args:
            rng: Source of all randomness.
            start: (n,) joint positions of any posture on this foot [rad].
        """
        low, high = self.parameters.ranges
        while True:
            coordinates = rng.uniform(low, high)
            if self.side == "right":
                coordinates = coordinates * MIRROR
            posture = self.solve(coordinates, start)
            if posture is not None and not self.fault(posture.joint_positions):
                yield posture

    def _residual(self, joints: Array, lean: Array) -> tuple[Array, Array]:
        """Return (4,) the errors of CoM and lean, and their (4, 4) Jacobian by the solved joints."""
        q = self._configuration(joints)
        columns = self._order[self._solved]
        com_jacobian = pin.jacobianCenterOfMass(self._model, self._data, q)[:2, columns] * self._moving_share
        turning = pin.computeFrameJacobian(self._model, self._data, q, self._base, pin.LOCAL)[3:, columns]
        pin.updateFramePlacement(self._model, self._data, self._base)
        up = self._data.oMf[self._base].rotation[2]
        # What stands still in the world turns the other way as seen from the body.
        rate = np.cross(up, turning.T).T
        error = np.array([*(self._com()[:2] - self.aim), -up[0] - lean[0], -up[1] - lean[1]])
        return error, np.vstack([com_jacobian, -rate[:2]])

    def _com(self) -> Array:
        com: Array = self._moving_share * self._data.com[0] + self._com_of_foot
        return com

    def _configuration(self, joints: Array) -> Array:
        q = np.empty(len(joints))
        q[self._order] = joints
        return q

    def _place(self, joints: Array) -> None:
        pin.framesForwardKinematics(self._model, self._data, self._configuration(joints))
