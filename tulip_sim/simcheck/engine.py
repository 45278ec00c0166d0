"""What both engines of the validation offer, and the recording of a run of one of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand

Array = NDArray[np.float64]

LEAST_LOAD = 1e-3  # [N s] with less there is no centre of pressure


class State(NamedTuple):
    """A state of the floating robot, as `tulip_description.model.floating_model` writes it.

    Attributes:
        q: (7 + n,) position of base_link [m], quaternion x, y, z, w, joint positions [rad].
        v: (6 + n,) velocity [m/s] and angular velocity [rad/s] of base_link in its own axes, joint velocities [rad/s].
    """

    q: Array
    v: Array


class Millisecond(NamedTuple):
    """What acted on the robot during one millisecond.

    Attributes:
        efforts: (n,) torques of the joints, constant through the millisecond [N m].
        push: (3,) force on the trunk's CoM, constant through the millisecond, in map [N].
        contact: (6,) impulse of the ground on the robot, in map: linear [N s], and its moment about the origin [N m s].
        depth: How deep the lowest corner of a sole is in the ground at the end [m]; negative above it.
    """

    efforts: Array
    push: Array
    contact: Array
    depth: float


class Engine(Protocol):
    """A robot on the carpet that a joint driver drives, millisecond by millisecond."""

    robot: Robot

    @property
    def state(self) -> State:
        """The state now."""
        ...

    def set_state(self, state: State) -> None:
        """Put the robot into a state."""
        ...

    def apply(self, command: JointCommand) -> str:
        """Give a command to the joint driver; return "" or why it is not taken."""
        ...

    def push(self, force: ArrayLike, milliseconds: int) -> None:
        """Push the trunk at its CoM with a force (3,) in map [N] from now on."""
        ...

    def advance(self) -> Millisecond:
        """Let a millisecond pass."""
        ...


@dataclass(frozen=True)
class Recording:
    """A run: T milliseconds between T + 1 states.

    Attributes:
        q: (T + 1, 7 + n).
        v: (T + 1, 6 + n).
        efforts, push, contact, depth: (T, ...) as in `Millisecond`.
    """

    q: Array
    v: Array
    efforts: Array
    push: Array
    contact: Array
    depth: Array

    @property
    def joints(self) -> Array:
        """(T + 1, n) joint positions [rad]."""
        return self.q[:, 7:]


def centre_of_pressure(impulses: Array) -> Array:
    """Return (T, 2) where on the ground impulses with their moments about the origin, (T, 6), act; nan without load."""
    vertical = impulses[:, 2:3]
    with np.errstate(divide="ignore", invalid="ignore"):
        found: Array = np.where(vertical > LEAST_LOAD, impulses[:, [4, 3]] * [-1.0, 1.0] / vertical, np.nan)
    return found


def record(engine: Engine, milliseconds: int, before: Callable[[int], None]) -> Recording:
    """Run an engine and keep everything.

    Args:
        engine: Where it stands.
        milliseconds: How long.
        before: Called with the number of each millisecond before it passes, to command or push.
    """
    states, steps = [engine.state], []
    for now in range(milliseconds):
        before(now)
        steps.append(engine.advance())
        states.append(engine.state)
    return Recording(
        np.array([state.q for state in states]),
        np.array([state.v for state in states]),
        *(np.array(column) for column in zip(*steps, strict=True)),
    )
