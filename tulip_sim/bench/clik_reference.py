"""The walk that every inverse kinematics solver follows in the bench, recorded once from the simulated robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.robot import Robot, load_robot
from tulip_motion.gait import FootMotion
from tulip_motion.interface import Side
from tulip_motion.inverse_kinematics import InverseKinematics, TaskTarget, rotation_z
from tulip_motion.motion import with_fixed_head
from tulip_sim.bench.body import Body

Array = NDArray[np.float64]

SEED = 1
VELOCITIES = ((0.5, 0.0, 0.0), (0.2, 0.15, 0.3))  # [m/s], [m/s], [rad/s]
SECONDS = 4.0  # each


@dataclass(frozen=True)
class Instant:
    """What inverse kinematics was asked for at one tick.

    Attributes:
        stance: The foot that stands.
        anchor: Where it stands in odom.
        target: What the rest of the body shall do.
    """

    stance: Side
    anchor: Pose2D
    target: TaskTarget

    def foot_places(self) -> tuple[pin.SE3, pin.SE3]:
        """Return where the left and the right sole shall be."""
        fixed = FootMotion.resting(self.anchor)
        feet = [pin.SE3(rotation_z(foot.yaw), np.array(foot.position)) for foot in (fixed, self.target.foot)]
        return (feet[0], feet[1]) if self.stance is Side.LEFT else (feet[1], feet[0])


@dataclass(frozen=True)
class WalkReference:
    """A recorded walk.

    Attributes:
        start: (19,) base pose and joint angles at the first instant.
        instants: One a tick.
    """

    start: Array
    instants: tuple[Instant, ...]


@contextmanager
def replaced(owner: Any, name: str, make: Callable[[Callable[..., Any]], Callable[..., Any]]) -> Iterator[None]:
    """Replace a function of a class or module by what `make` makes of it, for a while."""
    original = getattr(owner, name)
    setattr(owner, name, make(original))
    try:
        yield
    finally:
        setattr(owner, name, original)


@cache
def legs() -> Robot:
    """Return the robot with its head held still, as motion control models it."""
    return with_fixed_head(load_robot())


@cache
def legs_model() -> Any:
    """Return the model that all solvers use; PlaCo reads the same numbers from the URDF."""
    return floating_model(legs())


@cache
def walk_reference() -> WalkReference:
    """Walk in simulation and record what motion control asks of inverse kinematics."""
    start: list[Array] = []
    stances: list[Side] = []
    targets: list[TaskTarget] = []
    anchors: list[Pose2D] = []

    def on_update(original: Callable[..., Any]) -> Callable[..., Any]:
        def update_jacobian(self: InverseKinematics, stance: Side) -> None:
            start.append(self.configuration.copy()) if not start else None
            stances.append(stance)
            original(self, stance)

        return update_jacobian

    def on_solve(original: Callable[..., Any]) -> Callable[..., Any]:
        def solve_velocity(self: InverseKinematics, target: TaskTarget) -> None:
            targets.append(target)
            original(self, target)

        return solve_velocity

    def on_integrate(original: Callable[..., Any]) -> Callable[..., Any]:
        def integrate(self: InverseKinematics, dt: float, stance: Pose2D) -> None:
            anchors.append(stance)
            original(self, dt, stance)

        return integrate

    with (
        replaced(InverseKinematics, "update_jacobian", on_update),
        replaced(InverseKinematics, "solve_velocity", on_solve),
        replaced(InverseKinematics, "integrate", on_integrate),
    ):
        body = Body(SEED, Pose2D(-4.0, 2.2))
        body.go(0.5)
        for velocity in VELOCITIES:
            body.go(SECONDS, velocity)
    instants = (Instant(*given) for given in zip(stances, anchors, targets, strict=True))
    return WalkReference(start[0], tuple(instants))


def tracking_errors(reference: WalkReference, postures: Array) -> dict[str, float]:
    """Return RMS errors of a replay, for all solvers by the same model.

    Args:
        reference: What was to be followed.
        postures: (n - 1, 19) base pose and joint angles after tick i, which is the time of instant i + 1.
    """
    model = legs_model()
    data = model.createData()
    soles = [model.getFrameId(name) for name in (frames.LEFT_SOLE, frames.RIGHT_SOLE)]
    squares = np.zeros((len(postures), 5))
    for row, posture, instant in zip(squares, postures, reference.instants[1:], strict=True):
        pin.centerOfMass(model, data, posture)
        pin.updateFramePlacements(model, data)
        wanted, stance = instant.foot_places(), instant.stance
        off = [pin.log6(wanted[side].actInv(data.oMf[soles[side]])) for side in Side]
        errors = (
            data.com[0] - instant.target.com,
            pin.log3(data.oMi[1].rotation @ instant.target.torso_rotation.T),
            off[stance.other].linear,
            off[stance.other].angular,
            off[stance].linear,
        )
        row[:] = [error @ error for error in errors]
    com, torso, foot, turn, fixed = (1000.0 * np.sqrt(squares.mean(axis=0))).tolist()
    return {
        "CoM RMS [mm]": round(com, 3),
        "torso RMS [mrad]": round(torso, 3),
        "foot RMS [mm]": round(foot, 3),
        "foot RMS [mrad]": round(turn, 3),
        "stance foot RMS [mm]": round(fixed, 4),
    }
