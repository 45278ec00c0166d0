"""What a driver owns around any body: time, limits, time-out, and the way to limp. No ROS here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from time import monotonic_ns

import numpy as np

from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.body_clock import BodyClock
from tulip_driver.contract import Body
from tulip_driver.guard import MILLISECOND, Guard, GuardParameters
from tulip_driver.limiter import Limiter

GRACE = 1000 * MILLISECOND
"""[ns] of wall-clock time that the next reading of a body whose clock rules may take: an emulated one may be slow.
After that commands grow old by the wall clock: a body whose readings are lost must not hold the last one for ever."""
JUMP = 100 * MILLISECOND
"""[ns] A body whose stamps go back further than this was begun anew."""


class BodyLoop:
    """Runs a body: commands in at any time, an exchange each `tick`.

    Args:
        body: Any body.
        robot: What it is like.
        parameters: Of the guard.
        clock: The computer's time [ns], in which readings are stamped and commands grow old; None: the body's own
            clock rules both, as in a simulation that may be slower than the wall clock.
        rate: Share of the joints' greatest speeds that wanted positions move with at most.

    Attributes:
        sensors: The newest reading, in the driver's time; None before the first.
        told_at: When the newest command for the body was made [ns], in the driver's time.
        faults: Readings that were refused.
        fault: What was wrong with the last of them, or "".
    """

    def __init__(
        self,
        body: Body,
        robot: Robot,
        parameters: GuardParameters,
        clock: Callable[[], int] | None = None,
        rate: float = 1.0,
    ) -> None:
        self._body, self._clock = body, clock
        self._guard, self._limiter = Guard(robot, parameters), Limiter(robot, rate)
        n = len(robot.joint_names)
        self._shapes = {
            "joint_positions": (n,),
            "joint_velocities": (n,),
            "joint_efforts": (n,),
            "imu_orientation": (4,),
            "imu_angular_velocity": (3,),
            "imu_linear_acceleration": (3,),
            "foot_cells": (2, 4),
        }
        self.told_at = 0
        self.faults, self.fault = 0, ""
        self.sensors: Sensors | None = None
        self._newest: int | None = None  # stamp of the newest reading on the body's clock [ns]
        self._arrived = 0  # when the newest reading came [ns], of wall-clock time
        self._body_clock = BodyClock()

    def start(self) -> None:
        """Connect the body.

        Raises:
            BodyError: if that is not possible.
        """
        self._forget_time()
        self._body.start()

    def stop(self) -> None:
        """Leave the body without torque."""
        self._body.stop()

    @property
    def now(self) -> int:
        """The driver's time [ns]."""
        if self._clock is not None:
            return self._clock()
        if self.sensors is None:
            return 0
        return self.sensors.stamp + max(monotonic_ns() - self._arrived - GRACE, 0)

    @property
    def answered(self) -> bool:
        """Whether the newest reading has been answered by all who command."""
        answered = self._guard.answered(self.now)
        return self.sensors is not None and answered is not None and answered >= self.sensors.stamp

    @property
    def silent_joints(self) -> tuple[str, ...]:
        """Joints whose last command is older than its time-to-live."""
        return self._guard.silent_joints(self.now)

    def accept(self, command: JointCommand) -> str:
        """Take a command for a group of joints; return "" or why it is not taken."""
        if self.sensors is None:
            return "no reading of the body has come yet; expected a command that answers one"
        age, life = self.sensors.stamp - command.stamp, self._guard.life(command.names)
        if age > life or age < 0:
            return (
                f"it answers sensors of {command.stamp} ns, the newest are of {self.sensors.stamp} ns; expected them or"
                f" older ones by {life / MILLISECOND:.0f} ms at most"
            )
        return self._guard.accept(command, self.now)

    def limp(self, reason: str) -> None:
        """Take all torque from the joints with the next exchange, and refuse commands until `release`."""
        self._guard.limp(reason)

    def release(self) -> None:
        """Take commands again; every joint stays limp until its next one."""
        self._guard.release()
        self._limiter.begin_anew()

    def tick(self) -> Sensors | None:
        """Exchange once. A body that asks for an emergency stop is limp from the next exchange on, until `release`.

        Returns:
            A new reading, in the driver's time; None if the body had no new one, or one that cannot be used.

        Raises:
            BodyError: if the body is lost.
        """
        command: JointCommand | None = None
        if self.sensors is not None:
            self.told_at = self.now
            self._guard.settle(self.told_at)
            command = self._limiter.command(self._guard, self.told_at, self.sensors)
            if command is not None:
                command = replace(command, stamp=self._on_body(command.stamp))
        reading = self._body.exchange(command)
        wrong = self._wrong(reading)
        if wrong:
            self.faults, self.fault = self.faults + 1, wrong
            return None
        if self._newest is not None and reading.stamp <= self._newest:
            if reading.stamp > self._newest - JUMP:
                return None
            self._guard.begin_anew()
            self._limiter.begin_anew()
            self._forget_time()
        self._newest = reading.stamp
        if self._clock is not None:
            reading = replace(reading, stamp=self._body_clock.to_host(reading.stamp, self._clock()))
        self.sensors, self._arrived = reading, monotonic_ns()
        if reading.emergency:
            self.limp(reading.emergency)
        return reading

    def _forget_time(self) -> None:
        self._body_clock, self._newest, self.sensors = BodyClock(), None, None

    def _on_body(self, stamp: int) -> int:
        """Return a stamp of the driver's time on the body's clock [ns], by the newest reading."""
        assert self.sensors is not None and self._newest is not None
        return max(stamp - self.sensors.stamp + self._newest, 0)

    def _wrong(self, reading: Sensors) -> str:
        """Return what is wrong with a reading, or ""."""
        for name, shape in self._shapes.items():
            values = np.asarray(getattr(reading, name))
            if values.shape != shape:
                return f"{name} of the body has shape {values.shape}; expected {shape}"
            if not np.isfinite(values).all():
                return f"{name} of the body holds {values[~np.isfinite(values)][0]}; expected finite numbers"
        return ""
