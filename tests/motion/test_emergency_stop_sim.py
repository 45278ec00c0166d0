"""Motion control at an emergency stop, and after its release."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_description.robot_io import JointCommand, Sensors
from tulip_motion.interface import KickGoal, MotionMode, Side, WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.scenario import Scenario
from tulip_sim.timing import TICK
from tulip_sim.world import World

pytestmark = pytest.mark.sim
WALK = WalkCommand(0, WalkMode.WALK, (0.3, 0.0, 0.0))
STAND = WalkCommand(0, WalkMode.STAND)
LIMP = WalkCommand(0, WalkMode.LIMP)

Tick = Callable[[WalkCommand], tuple[Sensors, JointCommand]]


@pytest.fixture
def robot() -> tuple[Motion, Tick]:
    """Motion control of a robot on the field, and what lets it answer one reading."""
    world = World(Scenario(robot=Pose2D(-2.0, 0.0, 0.0), ball=(3.0, -2.0), poles=False), seed=1)
    motion = Motion(MotionParameters(), world.robot)

    def tick(command: WalkCommand) -> tuple[Sensors, JointCommand]:
        motion.command(command)
        sensors = world.sensors()
        answer = motion.tick(sensors)
        world.apply(answer)
        world.advance(TICK)
        return sensors, answer

    return motion, tick


def test_a_walking_robot_is_limp_with_the_next_tick_and_obeys_no_command_until_the_release(
    robot: tuple[Motion, Tick],
) -> None:
    motion, tick = robot
    for _ in range(500):
        tick(WALK)
    assert motion.mode is MotionMode.WALK
    motion.stop("emergency stop by tester")
    for _ in range(5):
        _, answer = tick(WALK)
        assert not answer.stiffness.any() and not answer.effort.any()
    assert (motion.mode, motion.state().reason) == (MotionMode.LIMP, "emergency stop by tester")
    assert motion.start_kick(KickGoal(Side.LEFT)) == "emergency stop by tester"


def test_after_the_release_it_stays_limp_until_told_to_stand_and_begins_where_its_joints_are(
    robot: tuple[Motion, Tick],
) -> None:
    motion, tick = robot
    for _ in range(100):
        tick(STAND)
    motion.stop("emergency stop by tester")
    tick(STAND)
    motion.release()
    motion.command(LIMP)  # as strategy tells it, since that is the user's wish by then
    for _ in range(5):
        _, answer = tick(LIMP)
        assert not answer.stiffness.any()
    sensors, answer = tick(STAND)
    assert motion.mode is MotionMode.STAND and answer.stiffness.all()
    assert np.abs(answer.position - sensors.joint_positions[:12]).max() < 0.02  # [rad]
