"""What a body is told: the guard's commands, held to the joints' speeds and torques."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.guard import Guard

Array = NDArray[np.float64]
LONGEST_STEP = 20_000_000  # [ns] of movement at most that one command makes up for after a pause


class Limiter:
    """Makes the commands that leave for a body.

    Wanted positions move no faster than the joints may, and start where a joint is when it gets its stiffness back: a
    robot that was limp is not torn to its posture. Torques are limited by what the joint asks for at the newest
    reading; between readings the body saturates by itself.

    Args:
        robot: Gives joint names and limits.
        rate: Share of the joints' greatest speeds that wanted positions move with at most, above 0.

    Raises:
        ValueError: if rate is not above 0.
    """

    def __init__(self, robot: Robot, rate: float = 1.0) -> None:
        if not rate > 0.0:
            raise ValueError(f"rate is {rate}; expected more than 0")
        self._rate = rate
        self._index = {name: index for index, name in enumerate(robot.joint_names)}
        self._sequence = 0
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget what was sent before: the next positions start from the measured ones."""
        self._sent = np.full(len(self._index), np.nan)  # (n,) [rad]; NaN where the joint had no stiffness
        self._sent_at = 0

    def command(self, guard: Guard, now: int, sensors: Sensors) -> JointCommand | None:
        """Return what the body shall do now; None if nobody has commanded any joint yet.

        Args:
            guard: Holds the commands; it is settled.
            now: The driver's time [ns].
            sensors: The newest reading.
        """
        names = guard.commanded
        if not names:
            return None
        measured = sensors.joint_positions
        anew = np.isnan(self._sent)
        before = np.where(anew, measured, self._sent)
        step = np.where(
            anew, 0.0, self._rate * guard.velocity_limit * min(max(now - self._sent_at, 0), LONGEST_STEP) * 1e-9
        )
        stiff = guard.stiffness > 0.0
        position = np.where(stiff, np.clip(guard.position, before - step, before + step), measured)
        self._sent, self._sent_at = np.where(stiff, position, np.nan), now
        velocity = np.clip(guard.velocity, -guard.velocity_limit, guard.velocity_limit)
        effort = np.clip(guard.effort, -guard.effort_limit, guard.effort_limit)
        asked = guard.stiffness * (position - measured) + guard.damping * (velocity - sensors.joint_velocities) + effort
        effort -= asked - np.clip(asked, -guard.effort_limit, guard.effort_limit)
        self._sequence += 1
        joints = np.array([self._index[name] for name in names])
        return JointCommand(
            self._sequence,
            guard.answered(now) or 0,
            names,
            position[joints],
            velocity[joints],
            effort[joints],
            guard.stiffness[joints],
            guard.damping[joints],
        )
