"""The simulated sensors: what joints, IMU and foot cells report of the true state."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.materials import GRAVITY
from tulip_description.quaternion import quaternion_product
from tulip_description.robot import Foot, Robot
from tulip_description.robot_io import Sensors
from tulip_sim.parameters import SensorParameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodyState:
    """The true state of the body at one instant, in map.

    Attributes:
        stamp: [ns].
        joint_positions, joint_velocities: (n,) [rad], [rad/s].
        joint_efforts: (n,) mean torque of the motors since the last reading [N m].
        base_position: (3,) of base_link [m].
        base_orientation: (4,) quaternion x, y, z, w of base_link.
        base_rotation: (3, 3) the same as a matrix.
        base_linear_velocity: (3,) of base_link's origin [m/s].
        base_angular_velocity: (3,) [rad/s].
        foot_cells: (2, 4) true force on each cell [N].
    """

    stamp: int
    joint_positions: Array
    joint_velocities: Array
    joint_efforts: Array
    base_position: Array
    base_orientation: Array
    base_rotation: Array
    base_linear_velocity: Array
    base_angular_velocity: Array
    foot_cells: Array


def cell_forces(foot: Foot, contacts: Iterable[tuple[float, float, float]]) -> list[float]:
    """Share contact forces between a foot's four cells.

    The shares are bilinear in the contact's place, so the sum of forces is kept, and the CoP too as long as contacts
    lie inside the rectangle of the cells; one outside counts as if it were on the rectangle's edge.

    Args:
        foot: Gives the cells' places.
        contacts: x [m], y [m] in the sole frame and normal force [N] of each contact.

    Returns:
        Forces on heel inner, heel outer, toe inner, toe outer [N].
    """
    (heel, inner), (toe, outer) = foot.cells[0], foot.cells[3]
    forces = [0.0] * 4
    for x, y, force in contacts:
        forwards = min(max((x - heel) / (toe - heel), 0.0), 1.0)
        outwards = min(max((y - inner) / (outer - inner), 0.0), 1.0)
        forces[0] += force * (1.0 - forwards) * (1.0 - outwards)
        forces[1] += force * (1.0 - forwards) * outwards
        forces[2] += force * forwards * (1.0 - outwards)
        forces[3] += force * forwards * outwards
    return forces


class SensorModel:
    """Adds to true states what sensors add: noise, bias, resolution, drift.

    The IMU's orientation is relative to a level frame whose yaw is zero where the robot looked when it was switched on,
    and drifts: it does not tell where on the field the robot looks.

    Args:
        robot: Gives the IMU's mount.
        parameters: Sizes of the errors.
        rng: Source of all randomness.
        start: State when the sensors are switched on.
    """

    def __init__(self, robot: Robot, parameters: SensorParameters, rng: np.random.Generator, start: BodyState) -> None:
        self._p = parameters
        self._rng = rng
        self._mount = np.array(robot.imu.origin)
        self._joints = len(robot.joint_names)
        self._gyro_bias = parameters.gyro_bias * rng.standard_normal(3)
        self._accelerometer_bias = parameters.accelerometer_bias * rng.standard_normal(3)
        self._attitude_bias = np.append(parameters.attitude_bias * rng.standard_normal(2), 0.0)
        self._yaw_rate = parameters.yaw_drift * float(rng.standard_normal())
        self._start_yaw = math.atan2(start.base_rotation[1, 0], start.base_rotation[0, 0])
        self._last_stamp = start.stamp
        self._last_velocity = self._imu_velocity(start)

    def measure(self, state: BodyState) -> Sensors:
        """Return the reading of a state. Call in the order of time: the accelerometer averages since the last call."""
        p, n = self._p, self._joints
        noise = self._rng.standard_normal(2 * n + 17)
        rotation_t = state.base_rotation.T
        velocity = self._imu_velocity(state)
        acceleration = np.zeros(3)
        if state.stamp > self._last_stamp:
            acceleration = (velocity - self._last_velocity) / ((state.stamp - self._last_stamp) * 1e-9)
        self._last_stamp, self._last_velocity = state.stamp, velocity
        acceleration[2] += GRAVITY
        yaw = self._yaw_rate * state.stamp * 1e-9 - self._start_yaw
        tilt = (self._attitude_bias + p.attitude_noise * noise[2 * n : 2 * n + 3]) / 2
        level = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
        orientation = np.array(
            quaternion_product(quaternion_product(level, state.base_orientation.tolist()), (*tilt.tolist(), 1.0))
        )
        turning = rotation_t @ state.base_angular_velocity + self._gyro_bias
        turning += p.gyro_noise * noise[2 * n + 3 : 2 * n + 6]
        pushed = rotation_t @ acceleration + self._accelerometer_bias
        pushed += p.accelerometer_noise * noise[2 * n + 6 : 2 * n + 9]
        noisy_cells = state.foot_cells.ravel() + p.cell_noise * noise[2 * n + 9 :]
        return Sensors(
            stamp=state.stamp,
            joint_positions=_rounded(state.joint_positions + p.encoder_noise * noise[:n], p.encoder_step),
            joint_velocities=_rounded(state.joint_velocities + p.velocity_noise * noise[n : 2 * n], p.velocity_step),
            joint_efforts=_rounded(state.joint_efforts, p.effort_step),
            imu_orientation=_rounded(orientation / math.sqrt(float(orientation @ orientation)), p.attitude_step),
            imu_angular_velocity=_rounded(turning, p.gyro_step),
            imu_linear_acceleration=_rounded(pushed, p.accelerometer_step),
            foot_cells=np.maximum(_rounded(noisy_cells, p.cell_step), 0.0).reshape(2, 4),
        )

    def _imu_velocity(self, state: BodyState) -> Array:
        wx, wy, wz = state.base_angular_velocity.tolist()
        x, y, z = (state.base_rotation @ self._mount).tolist()
        lever: Array = np.array([wy * z - wz * y, wz * x - wx * z, wx * y - wy * x])
        return state.base_linear_velocity + lever


def _rounded(values: Array, step: float) -> Array:
    if step == 0.0:
        return values
    rounded: Array = np.round(values / step) * step
    return rounded
