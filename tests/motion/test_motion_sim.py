"""Motion control on the simulated body: stand, walk, stop, kick, fall. Physics only, no helper forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_description.robot import LEG_JOINTS
from tulip_motion.interface import MotionMode, WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.scenario import Scenario
from tulip_sim.world import World

pytestmark = pytest.mark.sim
STAND = WalkCommand(0, WalkMode.STAND)
TICK = 0.004


class Run:
    """A robot on the field with motion control alone, one tick of delay between sensors and torques."""

    def __init__(self, ball: tuple[float, float] = (3.0, -2.0), seed: int = 0) -> None:
        self.world = World(Scenario(robot=Pose2D(-2.0, 0.0, 0.0), ball=ball, poles=False), seed=seed)
        self.motion = Motion(MotionParameters(), self.world.robot)
        self._pending = None

    def go(self, seconds: float, command: Callable[[float], WalkCommand] = lambda _: STAND) -> None:
        for k in range(round(seconds / TICK)):
            self.motion.command(command(k * TICK))
            answer = self.motion.tick(self.world.sensors())
            if self._pending is not None:
                assert self.world.apply(self._pending) == ""
            self._pending = answer
            self.world.advance(4)


def walk(forward: float, left: float = 0.0, turn: float = 0.0) -> Callable[[float], WalkCommand]:
    return lambda _: WalkCommand(0, WalkMode.WALK, (forward, left, turn))


def test_stands_still_with_the_zmp_between_the_feet() -> None:
    run = Run()
    run.go(2.0)
    state = run.motion.state()
    assert state.mode is MotionMode.STAND
    np.testing.assert_allclose(state.zmp, state.dcm_desired, atol=0.02)
    np.testing.assert_allclose(run.world.truth().base_position[:2] - [-2.0, 0.0], [0.0, 0.0], atol=0.01)


@pytest.mark.parametrize(
    ("velocity", "moved"),
    [((0.4, 0.0, 0.0), (3.1, 0.0)), ((-0.2, 0.0, 0.0), (-1.4, 0.0)), ((0.0, 0.15, 0.0), (0.0, 1.0))],
)
def test_walks_as_commanded_then_stops(velocity: tuple[float, float, float], moved: tuple[float, float]) -> None:
    run = Run()
    run.go(0.3)
    start = run.world.truth().base_position[:2]
    run.go(8.0, walk(*velocity))
    run.go(4.0)
    assert run.motion.mode is MotionMode.STAND
    way = run.world.truth().base_position[:2] - start
    assert np.linalg.norm(way - moved) < 0.5  # start, stop and 5 % of slip over the way
    dead_reckoned = run.motion.odometry().position[:2]
    assert np.linalg.norm(dead_reckoned - way) < 0.15


def test_turns_as_commanded() -> None:
    run = Run()
    run.go(5.0, walk(0.0, 0.0, 0.5))
    yaw = run.motion.odometry().orientation
    assert run.motion.mode is MotionMode.WALK
    assert 2.0 * np.arctan2(yaw[2], yaw[3]) == pytest.approx(2.2, abs=0.4)


def test_a_fall_ends_limp_and_says_why() -> None:
    run = Run()
    run.go(0.5)
    run.world.push([0.0, 400.0, 0.0], 200)
    run.go(2.5)
    state = run.motion.state()
    assert state.mode is MotionMode.FALLEN
    assert "leans" in state.reason
    answer = run.motion.tick(run.world.sensors())
    assert answer.names == LEG_JOINTS
    assert not answer.stiffness.any() and not answer.effort.any() and answer.damping.all()


def test_limp_on_request_has_no_stiffness_and_stands_up_again_when_still_upright() -> None:
    run = Run()
    run.go(0.5)
    run.go(0.05, lambda _: WalkCommand(0, WalkMode.LIMP))
    assert run.motion.mode is MotionMode.LIMP
    run.go(1.5)
    assert run.motion.mode is MotionMode.STAND


def test_a_velocity_that_is_not_finite_is_refused() -> None:
    run = Run()
    with pytest.raises(ValueError, match="finite"):
        run.motion.command(replace(STAND, velocity=(float("nan"), 0.0, 0.0)))


def test_torques_stay_inside_the_robots_limits_while_walking_fast() -> None:
    run = Run()
    limits = run.world.robot.effort_limits
    peak = np.zeros(14)
    for _ in range(60):
        run.go(0.1, walk(0.6))
        peak = np.maximum(peak, np.abs(run.world.sensors().joint_efforts))
    assert run.motion.mode is MotionMode.WALK
    assert np.all(peak <= limits)


def test_heading_is_held_while_walking_fast() -> None:
    run = Run(seed=3)
    run.go(0.3)
    run.go(10.0, walk(0.6))
    _, _, z, w = run.world.truth().base_orientation
    assert abs(2.0 * np.arctan2(z, w)) < 0.05  # the IMU's own drift is up to 0.01 rad in this time
    assert abs(run.world.truth().base_position[1]) < 0.3


def test_feet_land_where_the_footsteps_were_announced() -> None:
    run = Run()
    run.go(0.3)
    assert run.motion.footsteps == ()
    landings = []
    for _ in range(round(5.0 / TICK)):
        before = run.motion.footsteps
        run.go(TICK, walk(0.3, 0.0, 0.2))
        after = run.motion.footsteps
        if before and after and before[0].side is not after[0].side:  # a foot has landed, the other one swings next
            sole = run.motion.state().soles[before[0].side][:2, 3]
            landings.append(np.hypot(*(sole - (before[0].pose.x, before[0].pose.y))))
            assert after[0].side is before[1].side
    assert len(landings) > 6
    assert max(landings) < 0.04  # [m] of tracking in the swing
    run.go(4.0)
    assert run.motion.footsteps == ()


def test_restarted_while_the_robot_falls_it_stays_limp_and_stands_when_people_have_set_it_up() -> None:
    run = Run()
    run.go(1.0)
    run.world.push((600.0, 0.0, 0.0), 100)
    run.world.advance(600)  # nobody commands the joints meanwhile
    run.motion, run._pending = Motion(MotionParameters(), run.world.robot), None
    run.go(1.0)
    assert run.motion.mode is MotionMode.FALLEN
    assert "was found leaning by" in run.motion.state().reason or "falls" in run.motion.state().reason
    assert np.abs(run.world.sensors().joint_efforts[:12]).max() < 5.0
    run.world.set_upright()
    run.go(0.5)
    assert run.motion.mode is MotionMode.STAND
    assert run.world.truth().base_position[2] > 0.9


def test_restarted_in_the_middle_of_a_walk_it_goes_on_in_the_same_odom_and_its_commands_are_taken() -> None:
    run = Run()
    run.go(4.0, walk(0.3, turn=0.2))
    before, known = run.motion.odometry(), run.motion.whereabouts()
    run.motion = Motion(MotionParameters(), run.world.robot)
    run.motion.continue_from(known, known.stamp + 4_000_000)
    run.go(TICK, walk(0.3))
    after = run.motion.odometry()
    np.testing.assert_allclose(after.position[:2], before.position[:2], atol=0.02)  # a tick's way, and a step's sway
    np.testing.assert_allclose(after.orientation, before.orientation, atol=0.02)
    assert after.distance == pytest.approx(before.distance)
    assert np.diag(after.covariance)[:2].min() >= 0.9 * np.diag(before.covariance)[:2].min()
    run.go(0.1)  # in which the driver takes each command
