"""The torso's tilt for odometry: truer than a reading of the IMU, which balance cannot wait for.

What looks along the ground for metres (the camera) needs the tilt to a fraction of a milliradian: seen from 1.1 m above
the ground, 1 mrad is 24 mm at 5 m. A single reading of the IMU is off by its noise and by how it is mounted. The gyro
carries readings over, so that some tens of them are averaged; and soles that lie flat on the ground tell by the legs'
joints alone where up is, which shows how the IMU is mounted as soon as the robot stands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot_io import Sensors
from tulip_motion.state_estimator import Sole

Array = NDArray[np.float64]

AVERAGED = 0.1  # [s] time constant; gyro errors of 3 mrad/s grow to 0.3 mrad, 25 readings make their noise a seventh
LEAST_SHARE = 0.25  # of the weight on each sole, if both are to lie flat on the ground
FIRST_READINGS = 25  # until that many are averaged, the mounting is not trusted to be known


class TiltFilter:
    """Follows the direction of up in base_link, from gyro, attitude and soles on level ground."""

    def __init__(self, period: float, learning_time: float, largest: float) -> None:
        """Make a filter.

        Args:
            period: From one update to the next [s].
            learning_time: After which 63 % of a change of the IMU's mounting is known [s].
            largest: Angle by which the IMU may be mounted wrongly, about each axis [rad].
        """
        self._period, self._learning_time, self._largest = period, learning_time, largest
        self._up: tuple[float, float] | None = None
        self._rate = [0.0, 0.0, 0.0]  # last angular velocity [rad/s]
        self._mounting = (0.0, 0.0)  # x and y of up, as the IMU has it, minus those of the soles
        self._readings = 0

    def update(
        self, sensors: Sensors, rotation: Array, soles: tuple[Sole, Sole], loads: Sequence[float], left_weight: float
    ) -> None:
        """Take a reading into account.

        Args:
            sensors: The reading; its IMU has the axes of base_link.
            rotation: (3, 3) from base_link to the axes of `soles`; only the joints' share of the soles' turn counts.
            soles: The left and the right one.
            loads: Vertical force on the left and right sole [N].
            left_weight: 1 when the left foot alone fixes the body, 0 when the right does.
        """
        x, y, z, w = sensors.imu_orientation.tolist()
        felt_x, felt_y = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x)
        flat = self._flat(soles, loads, left_weight)
        if flat is not None:
            (xx, xy, _), (yx, yy, _), (zx, zy, _) = rotation.tolist()
            x, y, z = flat  # turned into base_link:
            self._learn(felt_x - (xx * x + yx * y + zx * z), felt_y - (xy * x + yy * y + zy * z))
        felt_x, felt_y = felt_x - self._mounting[0], felt_y - self._mounting[1]
        rate_x, rate_y, rate_z = rate = sensors.imu_angular_velocity.tolist()
        if self._up is None:
            self._up, self._rate = (felt_x, felt_y), rate
            return
        (up_x, up_y), (last_x, last_y, last_z), self._rate = self._up, self._rate, rate
        up_z = math.sqrt(max(1.0 - up_x * up_x - up_y * up_y, 0.0))
        half, share = 0.5 * self._period, self._period / AVERAGED
        turn_x, turn_y, turn_z = half * (last_x + rate_x), half * (last_y + rate_y), half * (last_z + rate_z)
        # What stands still in the world turns the other way as seen from the body.
        now_x, now_y = up_x + turn_z * up_y - turn_y * up_z, up_y + turn_x * up_z - turn_z * up_x
        self._up = (now_x + share * (felt_x - now_x), now_y + share * (felt_y - now_y))

    def corrected(self, rotation: Array) -> Array:
        """Return an attitude (3, 3) of base_link, turned about a level axis such that up is where the filter has it."""
        if self._up is None or rotation[2, 2] <= 0.5:
            return rotation  # lying on the ground, where nobody looks along it
        x, y = self._up
        up = np.array([x, y, math.sqrt(max(1.0 - x * x - y * y, 0.0))])
        forward = rotation[:2].T @ (rotation[:2, 0] / np.hypot(*rotation[:2, 0]))  # the heading, as base_link sees it
        forward = forward - (forward @ up) * up
        forward /= np.linalg.norm(forward)
        heading = rotation[:2, 0] / np.hypot(*rotation[:2, 0])
        level = np.array([[heading[0], -heading[1], 0.0], [heading[1], heading[0], 0.0], [0.0, 0.0, 1.0]])
        corrected: Array = level @ np.stack([forward, np.cross(up, forward), up])
        return corrected

    def _flat(
        self, soles: tuple[Sole, Sole], loads: Sequence[float], left_weight: float
    ) -> tuple[float, float, float] | None:
        """Return the upward normal of the soles that lie flat on the ground, in their axes; None if none does."""
        if left_weight in (0.0, 1.0):
            return _normal(soles[0 if left_weight == 1.0 else 1])
        total = loads[0] + loads[1]
        if total <= 0.0 or min(loads) < LEAST_SHARE * total:
            return None
        (ax, ay, az), (bx, by, bz) = _normal(soles[0]), _normal(soles[1])
        return 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz)

    def _learn(self, x: float, y: float) -> None:
        self._readings += 1
        share = max(self._period / self._learning_time, 1.0 / (FIRST_READINGS + self._readings))
        x, y = self._mounting[0] + share * (x - self._mounting[0]), self._mounting[1] + share * (y - self._mounting[1])
        most = self._largest
        self._mounting = (min(max(x, -most), most), min(max(y, -most), most))


def _normal(sole: Sole) -> tuple[float, float, float]:
    (_, _, x), (_, _, y), (_, _, z) = sole.axes
    return x, y, z
