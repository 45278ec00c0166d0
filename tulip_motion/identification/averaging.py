"""Means of the sensors while a posture is held: from readings to a `StaticMeasurement`.

The CoP lies below the CoM only if nothing accelerates. So readings count once the robot is still, by gyro and joint
speeds, and the robot has to stay still as long as they are taken. How sure the mean is follows from the spread of the
readings; as these hang together in time (the body sways a little), n of them count for n / tau, with tau from their
autocorrelation (Sokal, Monte Carlo Methods in Statistical Mechanics, 1996; Wolff, Monte Carlo errors with less errors,
2004).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.model import Side
from tulip_description.robot import Robot
from tulip_description.robot_io import Sensors
from tulip_motion.identification.static_measurement import StaticMeasurement

Array = NDArray[np.float64]

WINDOW = 2.5  # correlation times tau after which the sum of autocorrelations is cut: what follows is noise
PARTS = 5  # of the time that is looked at
LEAST_LOAD = 1.0  # [N] with less on a foot it has no CoP


@dataclass(frozen=True)
class AveragingParameters:
    """When a robot is still, and how long it has to be."""

    duration: float = 1.2  # [s] of averaging
    looked_at: float = 0.5  # [s] before the present that count: half a period of the sway
    joint_speed: float = 0.01  # [rad/s] of each joint in the mean, at most
    cop_range: float = 0.0012  # [m] between the means of a fifth of that time each; what accelerates moves the CoP most
    turning_range: float = 0.010  # [rad/s] between such means of the trunk's rate, whose bias is not known
    least_readings: int = 50


class StillnessGate:
    """Says whether the robot is still, by speeds and CoP of the last moments."""

    def __init__(self, parameters: AveragingParameters, period: float) -> None:
        """Begin without readings.

        Args:
            parameters: What still means.
            period: Between two readings [s].
        """
        self._parameters = parameters
        self._part = max(1, round(parameters.looked_at / PARTS / period))
        self._readings: deque[Array] = deque(maxlen=PARTS * self._part)

    @property
    def cop(self) -> Array:
        """(2,) mean CoP of the last moments [m]."""
        mean: Array = np.mean(self._readings, axis=0)[:2]
        return mean

    def is_still(self, sensors: Sensors, cop: Array) -> bool:
        """Take a reading and return whether the robot has been still for the time that is looked at.

        Args:
            sensors: The reading.
            cop: (2,) centre of pressure [m].
        """
        self._readings.append(np.concatenate([cop, sensors.imu_angular_velocity, sensors.joint_velocities]))
        if len(self._readings) < PARTS * self._part:
            return False
        p, parts = self._parameters, np.array(self._readings).reshape(PARTS, self._part, -1).mean(axis=1)
        ranges = np.ptp(parts[:, :5], axis=0)
        still = np.abs(parts[:, 5:].mean(axis=0)).max() < p.joint_speed
        return bool(still and ranges[:2].max() < p.cop_range and ranges[2:].max() < p.turning_range)


class HoldAverage:
    """Collects the readings of one hold."""

    def __init__(self, robot: Robot, side: Side) -> None:
        """Begin without readings.

        Args:
            robot: Gives the places of the cells.
            side: The stance foot.
        """
        self._side = side
        self._foot = 0 if side == "left" else 1
        self._cells = np.array(robot.feet[self._foot].cells)
        self._joints: list[Array] = []
        self._ups: list[Array] = []
        self._forces: list[Array] = []

    def __len__(self) -> int:
        return len(self._joints)

    def add(self, sensors: Sensors) -> None:
        """Take a reading."""
        self._joints.append(sensors.joint_positions)
        self._ups.append(up_in_base(sensors))
        self._forces.append(sensors.foot_cells[self._foot])

    def measurement(self) -> StaticMeasurement:
        """Return the means.

        Raises:
            ValueError: if there are too few readings, or the foot carried nothing.
        """
        least = AveragingParameters.least_readings
        if len(self) < least:
            raise ValueError(f"a posture was averaged over {len(self)} readings; expected at least {least}")
        forces = np.array(self._forces)
        loads = forces.sum(axis=1)
        if loads.min() < LEAST_LOAD:
            raise ValueError(f"the {self._side} foot carried {loads.min():.1f} N; expected the robot's weight on it")
        # The ratio of means: the mean of ratios is biased where the force varies.
        cop = forces.mean(axis=0) @ self._cells / loads.mean()
        deviations = (forces @ self._cells - loads[:, None] * cop) / loads.mean()
        down = -np.mean(self._ups, axis=0)
        return StaticMeasurement(
            self._side,
            np.mean(self._joints, axis=0),
            down / np.linalg.norm(down),
            cop,
            covariance_of_mean(deviations),
            forces.mean(axis=0),
        )


def up_in_base(sensors: Sensors) -> Array:
    """Return (3,) the unit vector that points up, in base_link, whose axes are the IMU's."""
    x, y, z, w = sensors.imu_orientation
    return np.array([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)])


def covariance_of_mean(values: Array) -> Array:
    """Return the (k, k) covariance of the mean of readings that hang together in time.

    Args:
        values: (n, k) readings at equal intervals.
    """
    number = len(values)
    deviations = values - values.mean(axis=0)
    times = np.array([correlation_time(column) for column in deviations.T])
    covariance: Array = deviations.T @ deviations / number**2 * np.sqrt(np.outer(times, times))
    return covariance


def correlation_time(deviations: Array) -> float:
    """Return tau = 1 + 2 sum of the autocorrelations: how many readings count for one; at least 1.

    Args:
        deviations: (n,) readings less their mean.
    """
    number = len(deviations)
    spectrum = np.abs(np.fft.rfft(deviations, 2 * number)) ** 2  # padded: no reading follows the last
    correlations = np.fft.irfft(spectrum)[:number]
    if correlations[0] == 0.0:
        return 1.0
    sums = 2.0 * np.cumsum(correlations / correlations[0]) - 1.0
    lags = np.arange(number)
    wide = np.flatnonzero(lags >= WINDOW * np.maximum(sums, 1.0))
    lag = int(wide[0]) if wide.size else number // 3
    # The mean, which was taken off, takes the variance of the mean off each of the 2 lag + 1 terms (Wolff 2004).
    return max(1.0, float(sums[lag])) / max(1.0 - (2 * lag + 1) / number, 0.2)
