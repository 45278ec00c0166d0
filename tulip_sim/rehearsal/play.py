"""Plays motions with the robot's own motion control in the simulator, from how the robot stands."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tulip_description.body_file import read_body
from tulip_description.planar import Pose2D
from tulip_description.robot import Robot, load_robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.guard import Guard, GuardParameters
from tulip_driver.limiter import Limiter
from tulip_motion.interface import MotionMode, WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.parameters import WorldParameters
from tulip_sim.rehearsal.motions import STAND, Part
from tulip_sim.rehearsal.present import Present
from tulip_sim.rehearsal.watch import Course, Watch
from tulip_sim.scenario import Scenario
from tulip_sim.timing import TICK
from tulip_sim.world import World

START = Pose2D(-30.0, 10.0, 0.0)  # far from goals and poles
BALL_AWAY = (0.0, -2.5)  # [m]
SETTLING = 0.5  # [s] that the robot stands first
STOPPING = 6.0  # [s] in which a walk ends before a kick


def play(
    parts: Sequence[Part],
    parameters: MotionParameters,
    present: Present,
    seed: int,
    engine: str = WorldParameters.engine,
    rate: float = 1.0,
) -> Course:
    """Play motions once, to their end or until the robot falls.

    Args:
        parts: What is played.
        parameters: Of motion control, as on the robot.
        present: How it stands.
        seed: Of the simulated robot's masses, friction and sensor errors.
        engine: Of the physics.
        rate: Share of the joints' greatest speeds that the driver lets wanted positions move with.

    Raises:
        ValueError: if the robot does not stand on both feet, or the parameters do not fit it.
    """
    robot = load_robot()
    world = World(
        Scenario(robot=START, ball=BALL_AWAY, poles=False),
        WorldParameters(engine=engine),
        seed,
        robot=robot,
        joint_positions=present.joint_positions,
        true_body=body_of(parameters, robot),
        tilt=present.tilt,
    )
    try:
        stage = _Stage(world, Motion(parameters, robot), Watch(world, seed), rate)
        stage.go(Part(STAND, SETTLING))
        for part in parts:
            stage.go(part)
        return stage.watch.course(stage.fall)
    finally:
        world.close()


def body_of(parameters: MotionParameters, robot: Robot) -> Robot | None:
    """Return the body that was identified, which is nearest to the truth; None for that of the robot file.

    Raises:
        ValueError: if the body file cannot be used.
    """
    return read_body(Path(parameters.body_file)).on(robot) if parameters.body_file else None


class _Stage:
    """World and motion control, with the tick of delay that the graph has, and what a driver has before any body."""

    def __init__(self, world: World, motion: Motion, watch: Watch, rate: float) -> None:
        self._world, self._motion, self.watch = world, motion, watch
        self._guard, self._limiter = Guard(world.robot, GuardParameters()), Limiter(world.robot, rate)
        self._pending: JointCommand | None = None

    @property
    def fall(self) -> str:
        """Why the robot fell, or ""."""
        fallen = self._motion.mode is MotionMode.FALLEN
        return self._motion.state().reason or "it fell" if fallen else ""

    def go(self, part: Part) -> None:
        """Play one part; nothing comes after a fall."""
        if self.fall:
            return
        if part.kick is not None:
            self._stop_walking()
            expected = self._motion.expected_ball(part.kick.kind, part.kick.side)
            self._world.place_ball(*self._world.truth().footprint.transform(expected))
            refusal = self._motion.start_kick(part.kick)
            if refusal:
                self.watch.refusals.append(f"{part.words}: {refusal}")
        self.watch.begin(part.words)
        mode = WalkMode.STAND if part.velocity is None else WalkMode.WALK
        command = WalkCommand(0, mode, part.velocity or (0.0, 0.0, 0.0))
        for _ in range(round(part.seconds * 1000 / TICK)):
            self._tick(command)
            self.watch.note(*self._motion.notes)
        progress = self._motion.kick_progress
        if part.kick is not None and progress is not None and progress.reason:
            self.watch.refusals.append(f"{part.words}: {progress.reason}")

    def _stop_walking(self) -> None:
        for _ in range(round(STOPPING * 1000 / TICK)):
            if self._motion.mode is MotionMode.STAND:
                break
            self._tick(WalkCommand(0, WalkMode.STAND))

    def _tick(self, command: WalkCommand) -> None:
        if self.fall:
            return
        self._motion.command(command)
        sensors = self._world.sensors()
        answer = self._motion.tick(sensors)
        if self._pending is not None:
            self._tell_body(self._pending, sensors)
        self._pending = answer
        self._world.advance(TICK)
        self.watch.look(sensors)

    def _tell_body(self, command: JointCommand, sensors: Sensors) -> None:
        now = self._world.stamp
        refusal = self._guard.accept(command, now)
        told = self._limiter.command(self._guard, now, sensors)
        if told is not None:
            refusal = refusal or self._world.apply(told)
        if refusal and refusal not in self.watch.refusals:
            self.watch.refusals.append(refusal)
