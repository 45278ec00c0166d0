"""Where the body is: base pose from the IMU and the stance leg, CoM from the model, smoothed by the pendulum.

The stance sole is taken to be fixed on the ground where it landed. The IMU gives the attitude and the
heading, so only the stance foot's slip and the landing pose's error add up in the position.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.planar import Pose2D
from tulip_description.robot_io import Sensors
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import Side
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """The body at one instant, in odom.

    Attributes:
        base_position: (3,) of base_link [m].
        base_rotation: (3, 3) from base_link to odom.
        base_velocity: (3,) of base_link, odom axes [m/s].
        angular_velocity: (3,) of base_link, odom axes [rad/s].
        joint_positions, joint_velocities: (12,) [rad], [rad/s].
        com, com_velocity: (3,) smoothed by the observer [m], [m/s].
        soles: (2, 4, 4) transforms of the soles.
        zmp: (2,) measured centre of pressure [m]; NaN without contact.
        loads: Vertical force on the left and right sole [N].
        tilt: Angle between the torso and the vertical [rad].
    """

    base_position: Array
    base_rotation: Array
    base_velocity: Array
    angular_velocity: Array
    joint_positions: Array
    joint_velocities: Array
    com: Array
    com_velocity: Array
    soles: Array
    zmp: Array
    loads: tuple[float, float]
    tilt: float


class StateEstimator:
    """Keeps the anchors of the feet and the observer of the CoM."""

    def __init__(self, parameters: MotionParameters, model: Any, cell_positions: Array, imu_rotation: Array) -> None:
        """Make an estimator.

        Args:
            parameters: Of motion control.
            model: Pinocchio model of the legs with a free flyer at base_link.
            cell_positions: (2, 4, 2) force cells in the left and right sole frame [m].
            imu_rotation: (3, 3) from imu_link to base_link.
        """
        self._parameters = parameters
        self._model = model
        self._data = model.createData()
        self._soles = (model.getFrameId(frames.LEFT_SOLE), model.getFrameId(frames.RIGHT_SOLE))
        self._cells = cell_positions
        self._imu_rotation = imu_rotation
        self._configuration = pin.neutral(model)
        self._velocity = np.zeros(model.nv)
        self._heading_offset: float | None = None
        self._com: Array | None = None
        self._com_velocity = np.zeros(3)
        self.anchors: list[Pose2D] = [Pose2D(), Pose2D()]

    def anchor(self, foot: Footstep) -> None:
        """Take a foot to be fixed on the ground at its pose from now on."""
        self.anchors[foot.side] = foot.pose

    def restart(self) -> None:
        """Forget the CoM's motion; the next update begins with the feet where they are measured."""
        self._com = None

    def update(self, sensors: Sensors, left_weight: float, acceleration: Array) -> Estimate:
        """Return the state of the body.

        Args:
            sensors: The newest reading.
            left_weight: 1 when the left foot fixes the body, 0 when the right does, between in double support.
            acceleration: (3,) acceleration of the CoM that the last command asked for, odom axes [m/s^2].
        """
        rotation = self._attitude(sensors)
        q, v = self._configuration, self._velocity
        q[:3] = 0.0
        q[3:7] = pin.Quaternion(rotation).coeffs()
        q[7:] = sensors.joint_positions[:12]
        v[:3] = 0.0
        v[3:6] = self._imu_rotation @ sensors.imu_angular_velocity
        v[6:] = sensors.joint_velocities[:12]
        model, data = self._model, self._data
        pin.centerOfMass(model, data, q, v, False)
        pin.updateFramePlacements(model, data)
        soles = [data.oMf[i].homogeneous for i in self._soles]
        if self._com is None:
            self._begin(soles)
        position, velocity = np.zeros(3), np.zeros(3)
        for side, weight in ((Side.LEFT, left_weight), (Side.RIGHT, 1.0 - left_weight)):
            if weight > 0.0:
                anchor = self.anchors[side]
                position += weight * (np.array([anchor.x, anchor.y, 0.0]) - soles[side][:3, 3])
                motion = pin.getFrameVelocity(model, data, self._soles[side], pin.LOCAL_WORLD_ALIGNED)
                velocity -= weight * motion.linear
        for sole in soles:
            sole[:3, 3] += position
        self._observe(data.com[0] + position, data.vcom[0] + velocity, acceleration)
        assert self._com is not None
        cells = sensors.foot_cells
        loads = (float(cells[0].sum()), float(cells[1].sum()))
        return Estimate(
            position,
            rotation,
            velocity,
            rotation @ v[3:6],
            sensors.joint_positions[:12].copy(),
            sensors.joint_velocities[:12].copy(),
            self._com.copy(),
            self._com_velocity.copy(),
            np.stack(soles),
            self._centre_of_pressure(cells, soles),
            loads,
            float(np.arccos(np.clip(rotation[2, 2], -1.0, 1.0))),
        )

    def _attitude(self, sensors: Sensors) -> Array:
        rotation: Array = pin.Quaternion(*_wxyz(sensors.imu_orientation)).toRotationMatrix() @ self._imu_rotation.T
        if self._heading_offset is None:
            self._heading_offset = -float(np.arctan2(rotation[1, 0], rotation[0, 0]))
        c, s = np.cos(self._heading_offset), np.sin(self._heading_offset)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation

    def _begin(self, soles: list[Array]) -> None:
        """Set the anchors such that the left foot stays where it was believed to be, the right beside it."""
        left = planar_pose(soles[Side.LEFT])
        keep = self.anchors[Side.LEFT]
        right = planar_pose(soles[Side.RIGHT])
        if keep == Pose2D():
            keep = left
        self.anchors = [Pose2D(keep.x, keep.y, left.yaw), keep_distance(keep, left, right)]

    def _observe(self, com: Array, velocity: Array, acceleration: Array) -> None:
        """Predict the CoM with the commanded acceleration and pull it to the measured one."""
        if self._com is None:
            self._com, self._com_velocity = com.copy(), np.zeros(3)
            return
        p, dt = self._parameters, self._parameters.control_period
        self._com += dt * (self._com_velocity + p.observer_position_gain * (com - self._com))
        self._com_velocity += dt * (acceleration + p.observer_velocity_gain * (velocity - self._com_velocity))

    def _centre_of_pressure(self, cells: Array, soles: list[Array]) -> Array:
        total = float(cells.sum())
        if total < self._parameters.contact_force:
            return np.full(2, np.nan)
        moment = np.zeros(2)
        for side in Side:
            points = self._cells[side] @ soles[side][:2, :2].T + soles[side][:2, 3]
            moment += cells[side] @ points
        return moment / total


def _wxyz(xyzw: Array) -> tuple[float, float, float, float]:
    return float(xyzw[3]), float(xyzw[0]), float(xyzw[1]), float(xyzw[2])


def planar_pose(transform: Array) -> Pose2D:
    """Return where a (4, 4) transform lies on the ground, with its yaw."""
    return Pose2D(float(transform[0, 3]), float(transform[1, 3]), float(np.arctan2(transform[1, 0], transform[0, 0])))


def keep_distance(anchor: Pose2D, measured: Pose2D, other: Pose2D) -> Pose2D:
    """Return `other` moved by what moves `measured` onto `anchor`'s position; headings are absolute."""
    return Pose2D(anchor.x + other.x - measured.x, anchor.y + other.y - measured.y, other.yaw)
