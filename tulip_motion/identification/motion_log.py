"""A recording of the body in motion as arrays, and its smoothing: what dynamic identification works on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt
from scipy.spatial.transform import Rotation

from tulip_description.robot_io import Sensors

Array = NDArray[np.float64]

# [N] on a foot; below it the foot is in the air, and what its cells say is noise, which is never negative
LEAST_LOAD = 10.0


@dataclass(frozen=True)
class MotionLog:
    """Readings of the whole body at a constant rate.

    Attributes:
        period: Between two readings [s].
        joint_positions: (t, n) [rad], order of `robot.joint_names`.
        joint_efforts: (t, n) torque of the motors [N m].
        base_rotations: (t, 3, 3) from base_link to a level frame, from the IMU's orientation.
        angular_velocity: (t, 3) of base_link in base_link [rad/s].
        specific_force: (t, 3) of the IMU in base_link [m/s^2]; +g upwards at rest.
        foot_cells: (t, 2, 4) [N], as in `Sensors`; a foot in the air has none.
    """

    period: float
    joint_positions: Array
    joint_efforts: Array
    base_rotations: Array
    angular_velocity: Array
    specific_force: Array
    foot_cells: Array

    @staticmethod
    def of(readings: Sequence[Sensors]) -> MotionLog:
        """Return the log of readings in the order of time.

        Raises:
            ValueError: if there are less than two or one is missing in between.
        """
        if len(readings) < 2:
            raise ValueError(f"the log has {len(readings)} readings; expected at least some seconds of them")
        steps, period = _steps(readings)
        if period <= 0 or _gaps(steps, period).any():
            worst = int(np.abs(steps - period).argmax())
            raise ValueError(
                f"readings {worst} and {worst + 1} are {steps[worst] * 1e-6:.1f} ms apart; expected"
                f" {period * 1e-6:.1f} ms as between the others: cut the log at the gap and use its parts"
            )

        def column(name: str) -> Array:
            return np.array([getattr(reading, name) for reading in readings])

        cells = column("foot_cells")
        carries = cells.sum(axis=2, keepdims=True) > LEAST_LOAD
        # The axes of imu_link are those of base_link.
        rotations = Rotation.from_quat(column("imu_orientation")).as_matrix()
        return MotionLog(
            period * 1e-9,
            column("joint_positions"),
            column("joint_efforts"),
            rotations,
            column("imu_angular_velocity"),
            column("imu_linear_acceleration"),
            np.where(carries, cells, 0.0),
        )

    @property
    def times(self) -> Array:
        """(t,) since the first reading [s]."""
        times: Array = self.period * np.arange(len(self.joint_positions), dtype=float)
        return times


def longest_part(readings: Sequence[Sensors]) -> Sequence[Sensors]:
    """Return the longest part of a recording without a gap; a simulator's first reading may come out of step.

    Args:
        readings: In the order of time.
    """
    if len(readings) < 2:
        return readings
    borders = np.concatenate([[0], 1 + np.flatnonzero(_gaps(*_steps(readings))), [len(readings)]])
    longest = int(np.diff(borders).argmax())
    return readings[borders[longest] : borders[longest + 1]]


def _steps(readings: Sequence[Sensors]) -> tuple[NDArray[np.int64], int]:
    """Return the times between readings and the one that is usual [ns]."""
    stamps = np.array([reading.stamp for reading in readings], dtype=np.int64)
    steps = stamps[1:] - stamps[:-1]
    return steps, int(np.median(steps))


def _gaps(steps: NDArray[np.int64], period: int) -> NDArray[np.bool_]:
    gaps: NDArray[np.bool_] = np.abs(steps - period) >= 0.5 * period
    return gaps


class SmoothMotion(NamedTuple):
    """A log after the low-pass filter, with derivatives; t readings as in the log.

    Attributes:
        q, dq, ddq: (t, n) joint positions, velocities and accelerations [rad], [rad/s], [rad/s^2].
        efforts: (t, n) [N m].
        up: (t, 3) in base_link.
        angular_velocity, angular_acceleration: (t, 3) of base_link in base_link [rad/s], [rad/s^2].
        specific_force: (t, 3) of the IMU in base_link [m/s^2].
        foot_cells: (t, 2, 4) [N].
    """

    q: Array
    dq: Array
    ddq: Array
    efforts: Array
    up: Array
    angular_velocity: Array
    angular_acceleration: Array
    specific_force: Array
    foot_cells: Array


def smooth(log: MotionLog, cutoff: float) -> SmoothMotion:
    """Return a log without what is faster than `cutoff` [Hz], and its derivatives.

    All signals pass one and the same filter. The ZMP equation is linear in accelerations and forces, so what the filter
    takes from one side it takes from the other, and no error is made but by products of fast signals. The filter, a
    Butterworth of fourth order run forwards and backwards, has no phase: a delay of 4 ms between force and acceleration
    would look like a mass. Derivatives are central differences of the smooth signals. Joint velocities come from
    the encoders too: below 10 Hz the derivative of 0.1 mrad of noise is a tenth of a velocity sensor's 0.02 rad/s.

    Raises:
        ValueError: if the log is too short or the cutoff no frequency below half the rate.
    """
    rate = 1.0 / log.period
    if not 0.0 < cutoff < 0.5 * rate:
        raise ValueError(f"cutoff is {cutoff} Hz; expected between 0 and {0.5 * rate:.0f} Hz, half the log's rate")
    if len(log.joint_positions) * log.period < 2.0 / cutoff:
        raise ValueError(
            f"the log lasts {len(log.joint_positions) * log.period:.2f} s; expected more than {2.0 / cutoff:.2f} s,"
            f" two periods of the {cutoff} Hz of its filter"
        )
    numerator, denominator = butter(4, cutoff, fs=rate)

    def passed(signal: Array) -> Array:
        low: Array = filtfilt(numerator, denominator, signal, axis=0, padlen=int(rate / cutoff))
        return low

    def rate_of_change(signal: Array) -> Array:
        slope: Array = np.asarray(np.gradient(signal, log.period, axis=0, edge_order=2), dtype=float)
        return slope

    q, turning = passed(log.joint_positions), passed(log.angular_velocity)
    dq = rate_of_change(q)
    up = passed(log.base_rotations[:, 2, :])  # the third row: upwards in base_link
    return SmoothMotion(
        q,
        dq,
        rate_of_change(dq),
        passed(log.joint_efforts),
        up / np.linalg.norm(up, axis=1, keepdims=True),
        turning,
        rate_of_change(turning),
        passed(log.specific_force),
        passed(log.foot_cells),
    )
