"""The course of a walk: smoothed velocities, clipped commands, goals that are reached and kept."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.course import STILL, Course, Wish, is_at, middle
from tulip_motion.footsteps import Footstep, foot_beside
from tulip_motion.interface import MotionMode, Side, WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import reach, step_time
from tulip_sim.bench.body import Body

P = MotionParameters()
REACH = reach(P, load_robot())
START = Pose2D(0.0, 40.0, 0.0)  # off the field, where nothing is in the way


def feet_at(pose: Pose2D) -> tuple[Footstep, Footstep]:
    return foot_beside(pose, Side.LEFT, P.stance_width), foot_beside(pose, Side.RIGHT, P.stance_width)


class Walker:
    """Feet that land where the course wants them, but for an error."""

    def __init__(self, pose: Pose2D, error: float = 0.0, seed: int = 0) -> None:
        self.course = Course(P, REACH)
        self.feet = feet_at(pose)
        self.stance = Side.LEFT
        self.error = error  # [m] standard deviation of each landing
        self.rng = np.random.default_rng(seed)

    def step(self, wish: Wish) -> Footstep:
        """Take a step and return where the foot should have landed."""
        planned = self.course.next_steps(self.feet[self.stance], wish)[0]
        dx, dy = self.rng.normal(0.0, self.error, 2) if self.error else (0.0, 0.0)
        landed = Footstep(planned.side, planned.pose @ Pose2D(dx, dy))
        self.feet = (landed, self.feet[1]) if landed.side is Side.LEFT else (self.feet[0], landed)
        self.stance = landed.side
        return planned

    def go(self, wish: Wish, most: int) -> int:
        """Walk until the course says that the walk may end; return the number of steps."""
        for count in range(1, most + 1):
            self.step(wish)
            if self.course.reached(wish, self.feet):
                return count
        return most + 1

    def away(self, goal: Pose2D) -> tuple[float, float]:
        """Distance [m] and angle [rad] of the middle between the feet from a goal."""
        rest = goal.inverse() @ middle(self.feet, P.stance_width)
        return math.hypot(rest.x, rest.y), abs(rest.yaw)


def test_velocity_follows_the_command_by_no_more_than_the_permitted_change_a_step() -> None:
    walker = Walker(Pose2D())
    before = walker.course.velocity
    for wish in [(0.5, 0.1, 0.5)] * 8 + [(-0.2, -0.1, -0.5)] * 10 + [None] * 8:
        walker.step(wish)
        now = walker.course.velocity
        for new, old, most in zip(
            now, before, (P.max_speed_change, P.max_speed_change, P.max_turn_change), strict=True
        ):
            assert abs(new - old) <= most + 1e-12
        before = now
    assert before == STILL


def test_a_steady_command_is_walked_exactly() -> None:
    walker = Walker(Pose2D())
    for _ in range(8):
        walker.step((0.4, 0.0, 0.0))
    assert walker.course.velocity == (0.4, 0.0, 0.0)
    before = walker.feet[0].pose.x
    walker.step((0.4, 0.0, 0.0))
    walker.step((0.4, 0.0, 0.0))
    duration = 2.0 * walker.course.step_time
    assert abs(walker.feet[0].pose.x - before) == pytest.approx(0.4 * duration, abs=1e-9)


@pytest.mark.parametrize("speed", [0.0, 0.2, -0.2, 0.5])
def test_steps_take_longer_the_faster_the_walk(speed: float) -> None:
    walker = Walker(Pose2D())
    for _ in range(10):
        walker.step((speed, 0.0, 0.0))
    assert walker.course.step_time == pytest.approx(P.step_time + P.step_time_growth * abs(speed))
    assert step_time(P, speed) == walker.course.step_time


def test_what_was_taken_off_a_command_is_told_and_a_modest_command_has_no_note() -> None:
    walker = Walker(Pose2D())
    walker.step((2.0, 0.0, 0.0))
    assert walker.course.note.startswith("walk command clipped: (2.00, 0.00) m/s, 0.00 rad/s to (")
    walker.step((0.2, 0.0, 0.0))
    assert walker.course.note == ""
    walker.step(Pose2D(30.0, 0.0, 0.0))
    assert walker.course.note == ""  # a goal far away is not a command too fast


def test_a_walk_that_is_stopped_ends_with_the_feet_side_by_side() -> None:
    walker = Walker(Pose2D(1.0, 2.0, 0.5))
    for _ in range(7):
        walker.step((0.4, 0.1, 0.3))
    assert not walker.course.reached((0.4, 0.1, 0.3), walker.feet)
    assert walker.go(None, 12) <= 8
    gap = walker.feet[0].pose.inverse() @ walker.feet[1].pose
    assert (gap.x, gap.y, gap.yaw) == pytest.approx((0.0, -P.stance_width, 0.0), abs=1e-9)


poses = st.builds(Pose2D, st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-math.pi, math.pi))


@settings(max_examples=60)
@given(poses, poses, st.integers(0, 2**31))
def test_every_goal_is_reached_within_its_tolerance(start: Pose2D, goal: Pose2D, seed: int) -> None:
    walker = Walker(start, error=0.002, seed=seed)  # of the order of what the simulated feet miss by
    distance = math.hypot(goal.x - start.x, goal.y - start.y)
    # Two turns of up to pi at a third of a radian a step, the way at half the greatest stride, and some to line up.
    assert walker.go(goal, round(40 + distance / 0.1)) <= 40 + distance / 0.1
    off, turned = walker.away(goal)
    assert off <= P.goal_tolerance
    assert turned <= P.goal_tolerance_yaw


@settings(max_examples=40)
@given(poses, poses)
def test_steps_to_a_goal_stay_within_reach_and_the_feet_apart(start: Pose2D, goal: Pose2D) -> None:
    walker = Walker(start)
    for _ in range(80):
        stance = walker.feet[walker.stance]
        planned = walker.step(goal)
        beside = stance.pose.inverse() @ planned.pose
        outward = beside.y if planned.side is Side.LEFT else -beside.y
        assert abs(beside.x) <= REACH.stride + 1e-9
        assert REACH.nearest - 1e-9 <= outward <= REACH.farthest + 1e-9
        assert abs(beside.yaw) <= REACH.turn
        if walker.course.reached(goal, walker.feet):
            break


def test_two_goals_one_after_the_other_are_both_reached() -> None:
    walker = Walker(Pose2D())
    for goal in (Pose2D(1.0, 0.5, 1.0), Pose2D(0.9, 0.5, 1.0), Pose2D(0.9, 0.5, -2.0)):
        assert walker.go(goal, 40) <= 40
        assert walker.away(goal)[0] <= P.goal_tolerance


def test_is_at_measures_distance_and_angle_the_short_way_round() -> None:
    goal = Pose2D(1.0, 1.0, math.pi - 0.01)
    assert is_at(goal, Pose2D(1.0, 1.01, -math.pi + 0.01), 0.011, 0.021)
    assert not is_at(goal, Pose2D(1.0, 1.01, -math.pi + 0.01), 0.009, 0.021)
    assert not is_at(goal, Pose2D(1.0, 1.01, -math.pi + 0.02), 0.011, 0.021)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("field", range(3))
def test_a_goal_that_is_not_finite_is_refused(field: int, bad: float) -> None:
    motion = Motion(P, load_robot())
    values = [0.0, 0.0, 0.0]
    values[field] = bad
    with pytest.raises(ValueError, match=r"walk goal .* expected finite"):
        motion.command(WalkCommand(0, WalkMode.GO, goal=Pose2D(*values)))


def go_to(body: Body, goal: Pose2D, seconds: float) -> None:
    command = WalkCommand(0, WalkMode.GO, goal=goal)
    for _ in range(round(seconds / P.control_period)):
        assert not body.fallen, body.motion.state().reason
        body.tick(command)


def feet_of(body: Body) -> Pose2D:
    """The middle between the soles in odom, as motion control measures it."""
    left, right = (Pose2D(s[0, 3], s[1, 3], math.atan2(s[1, 0], s[0, 0])) for s in body.motion.state().soles)
    return middle((Footstep(Side.LEFT, left), Footstep(Side.RIGHT, right)), P.stance_width)


@pytest.mark.sim
@pytest.mark.parametrize(("seed", "goal"), [(0, Pose2D(0.6, 0.2, 0.6)), (1, Pose2D(-0.25, 0.1, -0.3))])
def test_the_robot_goes_to_a_goal_stands_there_and_goes_on_to_the_next(seed: int, goal: Pose2D) -> None:
    body = Body(seed, START, ball=(0.0, 0.0))
    body.go(0.3)
    go_to(body, goal, 9.0)
    assert body.motion.mode is MotionMode.STAND
    # The tolerance of a goal, and what the feet, which carry weight now, still yield when the robot comes to rest.
    assert is_at(goal, feet_of(body), P.goal_tolerance + 0.005, P.goal_tolerance_yaw + 0.01)
    steps = body.motion.state().step_count
    go_to(body, goal, 2.0)
    assert body.motion.mode is MotionMode.STAND
    assert body.motion.state().step_count == steps  # who is there does not step again
    further = goal @ Pose2D(0.15, 0.0, 0.0)
    go_to(body, further, 6.0)
    assert body.motion.state().step_count > steps
    assert is_at(further, feet_of(body), P.goal_tolerance + 0.005, P.goal_tolerance_yaw + 0.01)
