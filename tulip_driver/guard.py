"""What protects the robot around any body: nothing above the driver can switch it off.

A command is refused, or taken. Taken commands are held to the joints' ranges, speeds and torques. A command older than
its time-to-live means damping only, then limp. A request to go limp wins over everything until it is released.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import HEAD_JOINTS, LEG_JOINTS, Robot
from tulip_description.robot_io import JointCommand

Array = NDArray[np.float64]
MILLISECOND = 1_000_000  # [ns]
FOREVER = 2**63 - 1


@dataclass(frozen=True)
class GuardParameters:
    """Times, and how joints are damped that nobody commands any more."""

    time_to_live: int = 40  # [ms] of a command to the legs: ten readings; they are damped 50 ms after the last one
    head_time_to_live: int = 100  # [ms] of one to the head, which comes every 20 ms and can do no harm
    damping_time: int = 500  # [ms] after that: damping only, so that the robot sinks instead of dropping
    # Of each leg joint from the hip down. The ankle roll carries only 0.0006 kg m^2: much more is unstable at 1 kHz.
    damping: tuple[float, ...] = (1.0, 4.0, 4.0, 4.0, 1.0, 0.2)  # [N m s/rad]
    head_damping: float = 0.05  # [N m s/rad]

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of its range.
        """
        check_leg_gains("damping", self.damping)
        if not self.head_damping >= 0.0:
            raise ValueError(f"head_damping is {self.head_damping}; expected >= 0")
        for name, least in (("time_to_live", 1), ("head_time_to_live", 1), ("damping_time", 0)):
            if getattr(self, name) < least:
                raise ValueError(f"{name} is {getattr(self, name)} ms; expected >= {least}")


def check_leg_gains(name: str, values: tuple[float, ...]) -> None:
    """Refuse gains that are not one for each joint of a leg.

    Raises:
        ValueError: if so.
    """
    if len(values) != 6 or not min(values) >= 0.0:
        raise ValueError(f"{name} is {values}; expected six numbers >= 0, from hip yaw to ankle roll")


class Guard:
    """Holds the last command of each group of joints.

    A group is what one sender commands: the joints named in its commands. Until its first command a joint has no
    stiffness. A group whose last command is older than its time-to-live is only damped, and later on limp.

    Args:
        robot: Gives joint names, ranges and limits.
        parameters: Times and gains.

    Attributes:
        position, velocity, effort, stiffness, damping: (n,) of the commands as taken.
    """

    def __init__(self, robot: Robot, parameters: GuardParameters) -> None:
        self._times = parameters
        self._names = robot.joint_names
        self._index = {name: index for index, name in enumerate(self._names)}
        self._lower, self._upper = robot.position_limits
        self.effort_limit, self.velocity_limit = robot.effort_limits, robot.velocity_limits
        self._safe_damping = self.of_joints(parameters.damping, parameters.head_damping)
        n = len(self._names)
        self.position, self.velocity, self.effort, self.stiffness, self.damping = np.zeros((5, n))
        self._groups: dict[tuple[str, ...], _Group] = {}
        self._next_change = FOREVER
        self._limp = ""

    def of_joints(self, leg: tuple[float, ...], head: float) -> Array:
        """Return (n,) values of all joints: those of a leg's six joints, for both, and one for each of the head's."""
        heads = len(self._names) - len(LEG_JOINTS)
        return np.array([*leg * 2, *[head] * heads])

    def life(self, names: Collection[str]) -> int:
        """Return how long a command to these joints lives [ns]."""
        times = self._times
        return MILLISECOND * (times.head_time_to_live if set(names) <= set(HEAD_JOINTS) else times.time_to_live)

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
        group.sequence, group.stamp = command.sequence, command.stamp
        group.expires = group.next_change = now + self.life(command.names)
        if self._limp:  # its sender lives, that is all that counts
            return f"the robot was made limp ({self._limp}); release it first"
        joints = group.joints
        self.position[joints] = np.clip(command.position, self._lower[joints], self._upper[joints])
        self.velocity[joints] = command.velocity
        self.effort[joints] = command.effort
        self.stiffness[joints] = command.stiffness
        self.damping[joints] = command.damping
        self._next_change = min(other.next_change for other in self._groups.values())
        return ""

    def limp(self, reason: str) -> None:
        """Take all torque from the joints at once, and refuse commands until `release`."""
        self._limp = reason or "no reason given"
        for values in (self.velocity, self.effort, self.stiffness, self.damping):
            values[:] = 0.0
        self._next_change = FOREVER

    def release(self) -> None:
        """Take commands again. Every joint stays limp until its next command."""
        self._limp = ""
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget all senders, as when time began anew; the joints have no stiffness until their next command."""
        self._groups.clear()
        self._next_change = FOREVER
        for values in (self.velocity, self.effort, self.stiffness, self.damping):
            values[:] = 0.0

    @property
    def commanded(self) -> tuple[str, ...]:
        """Joints that have a command, or are limp on request: what a body is told about."""
        if self._limp:
            return self._names
        return tuple(name for names in self._groups for name in names)

    def answered(self, now: int) -> int | None:
        """Return the stamp [ns] of the sensors that the living sender of most joints has answered last; None: nobody's.

        That is who commands the legs, and answers every reading; the head is told more rarely where to look.
        """
        living = [group for group in self._groups.values() if now < group.expires]
        return max(living, key=lambda group: len(group.joints)).stamp if living else None

    def silent_joints(self, now: int) -> tuple[str, ...]:
        """Return the joints whose last command is older than its time-to-live at a time [ns]."""
        return tuple(name for names, group in self._groups.items() if now >= group.expires for name in names)

    def settle(self, now: int) -> None:
        """Let the groups of joints whose command has expired only damp, and after that hang loose."""
        if now < self._next_change:
            return
        for group in self._groups.values():
            if now >= group.next_change:
                limp = group.expires + self._times.damping_time * MILLISECOND
                joints = group.joints
                self.stiffness[joints] = 0.0
                self.effort[joints] = 0.0
                self.velocity[joints] = 0.0
                self.damping[joints] = 0.0 if now >= limp else self._safe_damping[joints]
                group.next_change = FOREVER if now >= limp else limp
        self._next_change = min(group.next_change for group in self._groups.values())

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


class _Group:
    """The joints of one sender: their indices, the last sequence and stamp, when the last command runs out [ns]."""

    def __init__(self, joints: NDArray[np.int64]) -> None:
        self.joints = joints
        self.sequence, self.stamp = 0, 0
        self.expires = 0
        self.next_change = FOREVER
