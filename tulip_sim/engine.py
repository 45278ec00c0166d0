"""What the world asks of a physics engine, and which engines there are.

Everything else (joint driver, joint friction, sensors, touches, keeper, truth) is the same code on every engine.
"""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_description.robot import Robot
from tulip_sim.parameters import WorldParameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """What an engine has to build; all of it stays the same until the world is closed.

    Attributes:
        field: Geometry.
        parameters: Of the world.
        friction: Of the carpet, as drawn.
        poles: Whether the landmark poles stand.
        figures: Where figures like the keeper's stand at first.
        robots: As they really are, masses as drawn.
    """

    field: Field
    parameters: WorldParameters
    friction: float
    poles: bool
    figures: tuple[Pose2D, ...]
    robots: tuple[Robot, ...]


class BallState(NamedTuple):
    """The ball in map: place of its centre (3,) [m], quaternion (4,) x, y, z, w, velocities (3,) [m/s], [rad/s]."""

    position: Array
    orientation: Array
    linear_velocity: Array
    angular_velocity: Array


class RobotBody(Protocol):
    """One robot in an engine: torques in, its state and its contacts out."""

    def drive(self, torques: Array) -> None:
        """Put torques (n,) [N m] on the joints for the next step."""
        ...

    def push(self, force: Array) -> None:
        """Push the trunk at its CoM with a force (3,) in map [N] during the next step."""
        ...

    def joint_state(self) -> tuple[Array, Array]:
        """Return (n,) joint positions [rad] and (n,) velocities [rad/s]."""
        ...

    def base_pose(self) -> tuple[Array, Array, Array]:
        """Return (3,) place [m], (4,) quaternion x, y, z, w and (3, 3) rotation of base_link in map."""
        ...

    def base_velocity(self, rotation: Array) -> tuple[Array, Array]:
        """Return (3,) velocity [m/s] and (3,) angular velocity [rad/s] of base_link in map, given its rotation."""
        ...

    def place(self, position: Array, orientation: Array, joints: Array) -> None:
        """Put base_link at a place (3,) [m] with a quaternion (4,) x, y, z, w and joints (n,) [rad], at rest."""
        ...

    def sole_contacts(self, side: int) -> list[tuple[float, float, float]]:
        """Return x, y [m] in the sole frame and normal force [N] of each contact of a foot with the carpet."""
        ...

    def links_at_ball(self) -> AbstractSet[str]:
        """Return the names of the links that press on the ball."""
        ...


class Physics(Protocol):
    """A world in an engine, at 1 kHz. Contacts are those of the last step."""

    @property
    def robots(self) -> tuple[RobotBody, ...]:
        """The robots, in the layout's order."""
        ...

    def step(self) -> None:
        """Let a millisecond pass."""
        ...

    def ball(self) -> BallState:
        """Return the ball's state."""
        ...

    def place_ball(self, position: Array, linear_velocity: Array, angular_velocity: Array) -> None:
        """Put the ball at a place (3,) [m] with velocities (3,) [m/s] and (3,) [rad/s]."""
        ...

    def move_figure(self, number: int, pose: Pose2D) -> None:
        """Put a figure at a pose in map."""
        ...

    def figure_at_ball(self, number: int) -> bool:
        """Return whether a figure presses on the ball."""
        ...

    def close(self) -> None:
        """Free the engine; this one cannot be used afterwards."""
        ...


def make_physics(layout: Layout) -> Physics:
    """Build a world in the engine that its parameters name.

    Raises:
        ModuleNotFoundError: if the engine's library is not installed.
    """
    if layout.parameters.engine == "mujoco":
        try:
            from tulip_sim.mujoco_physics import MujocoPhysics
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                "engine is mujoco, whose library is not installed; install the project's extra mujoco:"
                " pip install -e '.[mujoco]'"
            ) from error
        return MujocoPhysics(layout)
    from tulip_sim.bullet_physics import BulletPhysics

    return BulletPhysics(layout)
