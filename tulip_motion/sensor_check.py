"""Tells from the readings alone that a sensor is broken, while the robot can still be brought down softly.

An encoder that sticks. A joint has two: the one at the joint tells its angle, the one at the motor its speed. A sound
encoder's noise alone makes that it soon reads something else; one that reads the very same angle while the motor's
speed adds up to a way of `encoder_check_limit` does not follow. (A comparison of way and angle alone would not do: a
light joint with dry friction chatters faster than it is read.)

An IMU that is frozen. Its noise alone makes that no two readings of a gyro are the same; one that reads the same rates
again and again, and not exactly zero as an ideal one at rest, gives no readings any more.

A force cell that is dead. A cell under a foot that carries the robot reads something now and then; one that reads zero
all the time under a load does not feel.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import CELL_NAMES, LEG_JOINTS, SIDES
from tulip_description.robot_io import Sensors
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]
LONGEST_GAP = 3  # control periods between two readings that can still be compared: joints move evenly for so long


class SensorCheck:
    """Looks at every reading of the sensors."""

    def __init__(self, parameters: MotionParameters) -> None:
        p = self._parameters = parameters
        self._longest = LONGEST_GAP * p.control_period
        self._same_limit = max(1, round(p.imu_check_time / p.control_period))
        self._dead_limit = max(1, round(p.cell_check_time / p.control_period))
        self._last: Sensors | None = None
        self._way = np.zeros(len(LEG_JOINTS))  # [rad] of each motor since its joint's angle was last read anew
        self._same = 0
        self._silent = np.zeros((2, len(CELL_NAMES)), dtype=int)  # readings of zero in a row while the foot carries
        self._stuck = ""

    def update(self, sensors: Sensors) -> str:
        """Take a reading; return why the robot cannot be controlled by it, in words, or ""."""
        last, self._last = self._last, sensors
        self._check_cells(sensors.foot_cells)
        if last is None or sensors.stamp <= last.stamp:
            return self._stuck
        self._check_encoders(last, sensors)
        rates = sensors.imu_angular_velocity
        same = bool((rates == last.imu_angular_velocity).all()) and bool(rates.any())
        self._same = self._same + 1 if same else 0
        if self._stuck:
            return self._stuck
        return "the IMU is frozen: it reads the same rates again and again" if self._same >= self._same_limit else ""

    @property
    def dead_cells(self) -> tuple[str, ...]:
        """Names of the force cells that do not feel."""
        return tuple(
            f"{side} {cell.replace('_', ' ')}"
            for side, row in zip(SIDES, self._silent, strict=True)
            for cell, count in zip(CELL_NAMES, row, strict=True)
            if count >= self._dead_limit
        )

    def _check_encoders(self, last: Sensors, sensors: Sensors) -> None:
        way, n = self._way, len(LEG_JOINTS)
        dt = (sensors.stamp - last.stamp) * 1e-9
        if dt > self._longest:
            return
        way += 0.5 * dt * (sensors.joint_velocities[:n] + last.joint_velocities[:n])
        way[sensors.joint_positions[:n] != last.joint_positions[:n]] = 0.0
        if not self._stuck and np.abs(way).max() > self._parameters.encoder_check_limit:
            name = LEG_JOINTS[int(np.abs(way).argmax())]
            self._stuck = f"the encoder of {name} sticks: its angle does not follow the motor's speed"

    def _check_cells(self, cells: Sequence[Sequence[float]] | Array) -> None:
        values = np.asarray(cells)
        carries = values.sum(axis=1) > 2.0 * self._parameters.contact_force
        self._silent[carries] += 1
        self._silent[values > 0.0] = 0
