"""Recordings for dynamic identification from the simulated robot, in lockstep: excitations, and ordinary walking."""

from __future__ import annotations

from typing import Protocol

from tulip_description.planar import Pose2D
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_motion.identification.exciting_motions import Excitation, ExcitingMotion
from tulip_motion.identification.motion_log import MotionLog
from tulip_motion.interface import WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.timing import TICK
from tulip_sim.world import World

START = Pose2D(-30.0, 10.0, 0.0)  # far from goals and ball
REST = 1.5  # [s] of standing before and after a walk
LEAST_HEIGHT = 0.9  # [m] of base_link; lower, the robot has fallen


class FellError(RuntimeError):
    """The robot fell while it was recorded."""


class _Legs(Protocol):
    def tick(self, sensors: Sensors) -> JointCommand: ...


class _Recorder:
    """Moves the simulated robot, with the tick of delay that the graph has, and keeps what its sensors say."""

    def __init__(self, legs: _Legs, robots: tuple[Robot, Robot], seed: int, parameters: WorldParameters | None) -> None:
        true, believed = robots
        scenario = Scenario(robot=START, ball=(0.0, -2.5), poles=False)
        self.world = World(scenario, parameters, seed, robot=believed, true_body=true)
        self.readings: list[Sensors] = []
        self._legs = legs
        self._pending: JointCommand | None = None

    def tick(self) -> None:
        """Advance by one control tick."""
        sensors = self.world.sensors()
        if sensors.stamp > 0:  # the reading at the start comes out of step with the others
            self.readings.append(sensors)
        answer = self._legs.tick(sensors)
        if self._pending is not None:
            self.world.apply(self._pending)
        self._pending = answer
        self.world.advance(TICK)
        if self.world.truth().base_position[2] < LEAST_HEIGHT:
            raise FellError(f"the robot fell {self.world.stamp * 1e-9:.1f} s after the start")

    def log(self) -> MotionLog:
        """Return what was recorded, and end the world."""
        self.world.close()
        return MotionLog.of(self.readings)


def excited_log(
    excitation: Excitation, true: Robot, believed: Robot, seed: int, parameters: WorldParameters | None = None
) -> MotionLog:
    """Return the log of an excitation.

    Args:
        excitation: What the robot does.
        true: As the simulated robot is.
        believed: As the one who moves it takes it to be.
        seed: Of sensors, friction and what else is random.
        parameters: Of the world.

    Raises:
        FellError: if the robot falls.
    """
    motion = ExcitingMotion(excitation, believed)
    recorder = _Recorder(motion, (true, believed), seed, parameters)
    while not motion.finished(recorder.world.stamp):
        recorder.tick()
    return recorder.log()


def walking_log(
    velocity: tuple[float, float, float],
    seconds: float,
    true: Robot,
    believed: Robot,
    seed: int,
    parameters: WorldParameters | None = None,
) -> MotionLog:
    """Return the log of ordinary walking with a velocity [m/s], [m/s], [rad/s], between two rests; see `excited_log`.

    Raises:
        FellError: if the robot falls.
    """
    motion = Motion(MotionParameters(), believed)
    recorder = _Recorder(motion, (true, believed), seed, parameters)
    standing = WalkCommand(0, WalkMode.STAND)
    walking = WalkCommand(0, WalkMode.WALK, velocity)
    for duration, command in ((REST, standing), (seconds, walking), (2 * REST, standing)):
        motion.command(command)
        for _ in range(round(duration * 1000 / TICK)):
            recorder.tick()
    return recorder.log()
