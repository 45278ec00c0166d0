"""A body without physics: joints are where they are told to be, at once. To try nodes, pages and the contract."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tulip_description.posture import standing_posture
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.contract import Body
from tulip_motion.lipm import GRAVITY

Array = NDArray[np.float64]


class EchoBody(Body):
    """Stands upright at rest, whatever its joints do; both feet carry it evenly.

    A joint with stiffness takes its wanted position, one without stays. Torques are the feedforward's.

    Args:
        robot: What it is like.
        clock: The body's clock [ns].
    """

    hardware = False

    def __init__(self, robot: Robot, clock: Callable[[], int] = time.monotonic_ns) -> None:
        self._clock = clock
        self._index = {name: index for index, name in enumerate(robot.joint_names)}
        self._cells = np.full((2, 4), robot.mass * GRAVITY / 8)
        self._position = standing_posture(robot).joint_positions
        self._effort = np.zeros(len(self._index))
        self._last = 0

    def start(self) -> None:
        """Stay as it is."""

    def exchange(self, command: JointCommand | None) -> Sensors:
        """Obey at once."""
        now = max(self._clock(), self._last + 1)
        before = self._position.copy()
        if command is not None:
            joints = np.array([self._index[name] for name in command.names])
            self._position[joints] = np.where(command.stiffness > 0.0, command.position, self._position[joints])
            self._effort[joints] = command.effort
        dt = (now - self._last) * 1e-9
        self._last = now
        return Sensors(
            stamp=now,
            joint_positions=self._position.copy(),
            joint_velocities=(self._position - before) / dt,
            joint_efforts=self._effort.copy(),
            imu_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
            imu_angular_velocity=np.zeros(3),
            imu_linear_acceleration=np.array([0.0, 0.0, GRAVITY]),
            foot_cells=self._cells.copy(),
        )

    def stop(self) -> None:
        """Hold nothing."""
        self._effort[:] = 0.0
