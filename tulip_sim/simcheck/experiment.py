"""What an experiment is, and how either engine carries it out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot, load_robot
from tulip_description.robot_io import JointCommand
from tulip_sim.parameters import DriverParameters
from tulip_sim.simcheck.bullet_engine import BulletEngine
from tulip_sim.simcheck.compliant_ground import GroundParameters
from tulip_sim.simcheck.engine import Engine, Recording, State, record
from tulip_sim.simcheck.reference_engine import ReferenceEngine
from tulip_sim.simcheck.rigid_engine import RigidEngine

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Experiment:
    """A robot, how it begins, and what is done to it.

    Attributes:
        robot: What is simulated.
        state: At the start.
        milliseconds: How long.
        before: Called with the engine and the number of each millisecond before it passes: commands and pushes. Joints
            that get no command hold the standing posture of the playing robot.
    """

    robot: Robot
    state: State
    milliseconds: int
    before: Callable[[Engine, int], None]

    def simulate(self, substeps: int = 1) -> Recording:
        """Carry it out in the simulator, with so many steps of physics a millisecond."""
        engine = BulletEngine(self.robot, _standing(), substeps)
        try:
            return self._run(engine)
        finally:
            engine.close()

    def compute(self, ground: GroundParameters | None = None) -> Recording:
        """Carry it out by Pinocchio's forward dynamics, on the given ground."""
        return self._run(ReferenceEngine(self.robot, _standing(), ground))

    def collide(self) -> Recording:
        """Carry it out by Pinocchio's impulse dynamics, with soles that stay flat."""
        return self._run(RigidEngine(self.robot, _standing()))

    def _run(self, engine: Engine) -> Recording:
        engine.set_state(self.state)
        return record(engine, self.milliseconds, lambda now: self.before(engine, now))


def _standing() -> Array:
    return standing_posture(load_robot()).joint_positions


def command(
    robot: Robot,
    now: int,
    names: tuple[str, ...],
    position: Array,
    velocity: Array | None = None,
) -> JointCommand:
    """Return a command with the gains that hold the standing robot.

    Args:
        robot: Whose joints.
        now: Millisecond of the experiment.
        names: Of the n joints.
        position: (n,) [rad].
        velocity: (n,) [rad/s], by default 0.
    """
    p = DriverParameters()
    gains = zip(
        robot.joint_names,
        (*p.hold_stiffness * 2, p.head_hold[0], p.head_hold[0]),
        (*p.hold_damping * 2, p.head_hold[1], p.head_hold[1]),
        strict=True,
    )
    of = {name: (kp, kd) for name, kp, kd in gains}
    kp, kd = np.array([of[name] for name in names]).T
    zero = np.zeros(len(names))
    return JointCommand(now + 1, 0, names, position, zero if velocity is None else velocity, zero, kp, kd)


def loosened(command: JointCommand, loose: ArrayLike) -> JointCommand:
    """Return a command without stiffness and damping at the joints where loose, (n,) or for all, is 1."""
    held = 1.0 - np.asarray(loose)
    return replace(command, stiffness=held * command.stiffness, damping=held * command.damping)


def on_ground(robot: Robot, joints: Array, sole: str, height: float) -> Array:
    """Return (7 + n,) q with an upright trunk above map's origin and a sole so high above the ground [m]."""
    model = floating_model(robot)
    data = model.createData()
    q = np.concatenate([[0, 0, 0, 0, 0, 0, 1], joints])
    pin.framesForwardKinematics(model, data, q)
    q[2] = height - data.oMf[model.getFrameId(sole)].translation[2]
    return q
