"""The simulated joints' driver: eqs. (12)-(13) with the PD part local to the joint, behind the guard of every body.

tau = kp (q_d - q) + kd (dq_d - dq) + tau_ff, every millisecond with fresh joint readings, saturated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_driver.guard import MILLISECOND, Guard
from tulip_sim.parameters import DriverParameters

__all__ = ["MILLISECOND", "JointDriver"]

Array = NDArray[np.float64]


class JointDriver(Guard):
    """Turns the commands that the guard holds into torques. Until its first command, a joint holds the start posture.

    Args:
        robot: Gives joint names, ranges and limits.
        parameters: Times and gains.
        start: (n,) joint positions held at the start [rad].
    """

    def __init__(self, robot: Robot, parameters: DriverParameters, start: Array) -> None:
        super().__init__(robot, parameters)
        self._full_torque_speed = parameters.full_torque_speed * self.velocity_limit
        self._fade = self.velocity_limit - self._full_torque_speed
        self.position[:] = start
        self.stiffness[:] = self.of_joints(parameters.hold_stiffness, parameters.head_hold[0])
        self.damping[:] = self.of_joints(parameters.hold_damping, parameters.head_hold[1])

    def torques(self, now: int, positions: Array, velocities: Array) -> Array:
        """Return (n,) torques [N m] for this millisecond.

        Args:
            now: The driver's time [ns].
            positions: (n,) fresh joint positions [rad].
            velocities: (n,) fresh joint velocities [rad/s].
        """
        self.settle(now)
        torque = self.stiffness * (self.position - positions)
        torque += self.damping * (self.velocity - velocities)
        torque += self.effort
        speed = np.abs(velocities)
        limit = self.effort_limit
        if (speed > self._full_torque_speed).any():
            # A motor at its top speed has no torque left to go faster; it can still brake.
            share = np.clip((self.velocity_limit - speed) / self._fade, 0.0, 1.0)
            limit = np.where(torque * velocities > 0.0, share * limit, limit)
        return np.minimum(np.maximum(torque, -limit), limit)
