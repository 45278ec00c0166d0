"""The joint driver: eqs. (12)-(13) with the PD part local to the joint, and everything that protects the robot.

tau = kp (q_d - q) + kd (dq_d - dq) + tau_ff, every millisecond with fresh joint readings, saturated. Nothing above the
driver can switch off saturation, joint ranges and time-out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand
from tulip_sim.parameters import DriverParameters

Array = NDArray[np.float64]
MILLISECOND = 1_000_000  # [ns]
FOREVER = 2**63 - 1


class JointDriver:
    """Holds the last command of each group of joints and turns it into torques.

    A group is what one sender commands: the joints named in its commands. Until its first command, a joint holds the
    start posture. A group whose last command is older than its time-to-live is only damped, and later on limp.

    Args:
        robot: Gives joint names, ranges and limits.
        parameters: Times and gains.
        start: (n,) joint positions held at the start [rad].
    """

    def __init__(self, robot: Robot, parameters: DriverParameters, start: Array) -> None:
        self._parameters = parameters
        self._names = robot.joint_names
        self._index = {name: index for index, name in enumerate(self._names)}
        self._lower, self._upper = robot.position_limits
        self._effort = robot.effort_limits
        self._velocity_limit = robot.velocity_limits
        self._full_torque_speed = parameters.full_torque_speed * self._velocity_limit
        self._fade = self._velocity_limit - self._full_torque_speed
        heads = len(self._names) - 12
        self._safe_damping = np.array([*parameters.damping * 2, *[parameters.head_damping] * heads])
        self._position = np.array(start, dtype=float)
        self._velocity = np.zeros(len(self._names))
        self._feedforward = np.zeros(len(self._names))
        self._stiffness = np.array([*parameters.hold_stiffness * 2, *[parameters.head_hold[0]] * heads])
        self._damping = np.array([*parameters.hold_damping * 2, *[parameters.head_hold[1]] * heads])
        self._groups: dict[tuple[str, ...], _Group] = {}
        self._next_change = FOREVER

    def accept(self, command: JointCommand, now: int) -> str:
        """Take a command.

        Args:
            command: For any group of joints.
            now: The driver's time [ns].

        Returns:
            "" if it is taken, else why not; a command that is not taken changes nothing.
        """
        reason = self._fault(command)
        if reason:
            return reason
        group = self._groups.get(command.names)
        if group is None:
            group = self._groups[command.names] = _Group(np.array([self._index[name] for name in command.names]))
        elif command.sequence <= group.sequence and now < group.expires:
            # After a time-out any sequence will do: the sender may have been restarted and count from zero.
            return f"sequence is {command.sequence}; expected more than {group.sequence}, the last one taken"
        joints = group.joints
        self._position[joints] = np.clip(command.position, self._lower[joints], self._upper[joints])
        self._velocity[joints] = command.velocity
        self._feedforward[joints] = command.effort
        self._stiffness[joints] = command.stiffness
        self._damping[joints] = command.damping
        group.sequence = command.sequence
        group.expires = now + self._parameters.time_to_live * MILLISECOND
        group.next_change = group.expires
        self._next_change = min(other.next_change for other in self._groups.values())
        return ""

    def silent_joints(self, now: int) -> tuple[str, ...]:
        """Return the joints whose last command is older than its time-to-live at a time [ns]."""
        return tuple(name for names, group in self._groups.items() if now >= group.expires for name in names)

    def torques(self, now: int, positions: Array, velocities: Array) -> Array:
        """Return (n,) torques [N m] for this millisecond.

        Args:
            now: The driver's time [ns].
            positions: (n,) fresh joint positions [rad].
            velocities: (n,) fresh joint velocities [rad/s].
        """
        if now >= self._next_change:
            self._time_out(now)
        torque = self._stiffness * (self._position - positions)
        torque += self._damping * (self._velocity - velocities)
        torque += self._feedforward
        speed = np.abs(velocities)
        limit = self._effort
        if (speed > self._full_torque_speed).any():
            # A motor at its top speed has no torque left to go faster; it can still brake.
            share = np.clip((self._velocity_limit - speed) / self._fade, 0.0, 1.0)
            limit = np.where(torque * velocities > 0.0, share * limit, limit)
        return np.minimum(np.maximum(torque, -limit), limit)

    def _fault(self, command: JointCommand) -> str:
        """Return what is wrong with a command, or ""."""
        unknown = [name for name in command.names if name not in self._index]
        if unknown or not command.names or len(set(command.names)) != len(command.names):
            what = f"unknown {', '.join(unknown)}" if unknown else f"{command.names}"
            return f"joint names: {what}; expected different names out of {', '.join(self._names)}"
        for group_names in self._groups:
            if group_names != command.names and not set(group_names).isdisjoint(command.names):
                return (
                    f"joint names: {command.names} overlap with those of another sender, {group_names};"
                    " expected one sender a joint"
                )
        for name in ("position", "velocity", "effort", "stiffness", "damping"):
            values = np.asarray(getattr(command, name))
            if values.shape != (len(command.names),):
                return f"{name} has shape {values.shape}; expected ({len(command.names)},), one value a joint"
            if not np.isfinite(values).all():
                return f"{name} of {command.names[int(np.argmin(np.isfinite(values)))]} is not finite"
            if name in ("stiffness", "damping") and values.min() < 0.0:
                return f"{name} of {command.names[int(np.argmin(values))]} is {values.min()}; expected >= 0"
        return ""

    def _time_out(self, now: int) -> None:
        """Let the groups of joints whose command has expired only damp, and after that hang loose."""
        for group in self._groups.values():
            if now >= group.next_change:
                limp = group.expires + self._parameters.damping_time * MILLISECOND
                joints = group.joints
                self._stiffness[joints] = 0.0
                self._feedforward[joints] = 0.0
                self._velocity[joints] = 0.0
                self._damping[joints] = 0.0 if now >= limp else self._safe_damping[joints]
                group.next_change = FOREVER if now >= limp else limp
        self._next_change = min(group.next_change for group in self._groups.values())


class _Group:
    """The joints of one sender: their indices, the last sequence, and when the last command runs out [ns]."""

    def __init__(self, joints: NDArray[np.int64]) -> None:
        self.joints = joints
        self.sequence = 0
        self.expires = 0
        self.next_change = FOREVER
