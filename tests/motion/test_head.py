from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.posture import standing_posture
from tulip_description.robot import HEAD_JOINTS, load_robot
from tulip_description.robot_io import JointCommand
from tulip_motion.head import HeadMovement, HeadParameters
from tulip_motion.head_geometry import HeadGeometry
from tulip_motion.head_trajectory import HeadTrajectory, travel_time
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_motion.moving_target import MovingTarget

ROBOT = load_robot()
PERIOD = 20_000_000
BASE_HEIGHT = standing_posture(ROBOT).base_height
LOWER, UPPER = (ROBOT.position_limits[row, -2:] for row in (0, 1))


def off_axis(angles: np.ndarray, target: tuple[float, float, float]) -> float:
    """Return the angle between the optical axis and a target [rad]."""
    transform = camera_in_footprint(ROBOT, BASE_HEIGHT, (0.0, 0.0, 0.0, 1.0), angles[0], angles[1])
    x, y, z = transform[:3, :3].T @ (np.array(target) - transform[:3, 3])
    return math.atan2(math.hypot(x, y), z)


def drive(
    head: HeadMovement, command: HeadCommand, seconds: float, start: np.ndarray | None = None
) -> list[JointCommand]:
    """Run a head whose joints follow their commands one period later."""
    angles = np.zeros(2) if start is None else start
    commands = []
    for tick in range(round(seconds * 1e9 / PERIOD)):
        commands.append(head.update(10**9 + tick * PERIOD, command, angles))
        angles = commands[-1].position
    return commands


def test_target_is_centred_within_a_tenth_of_a_degree_when_settled() -> None:
    for target in [(1.0, 0.0, 0.0), (0.5, 0.2, 0.09), (5.0, -3.0, 0.0), (-0.5, 1.5, 0.0), (3.0, 0.0, 1.8)]:
        head = HeadMovement(HeadParameters(), ROBOT)
        last = drive(head, HeadCommand(0, HeadMode.LOOK_AT, target), 2.0)[-1]
        assert off_axis(last.position, target) < math.radians(0.1), target
        assert np.allclose(last.velocity, 0.0, atol=1e-6)


def test_commands_name_the_head_joints_and_carry_their_gains() -> None:
    parameters = HeadParameters(stiffness=12.0, damping=0.3)
    commands = drive(HeadMovement(parameters, ROBOT), HeadCommand(0, HeadMode.HOLD), 0.1)
    assert [command.sequence for command in commands] == [1, 2, 3, 4, 5]
    assert commands[0].names == HEAD_JOINTS
    assert commands[0].stiffness.tolist() == [12.0, 12.0]
    assert commands[0].damping.tolist() == [0.3, 0.3]


modes = st.sampled_from(list(HeadMode))
points = st.tuples(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0), st.floats(-0.5, 2.5))


@settings(max_examples=40)
@given(
    commands=st.lists(
        st.tuples(modes, points, st.one_of(st.none(), points), st.integers(1, 60)), min_size=1, max_size=6
    ),
    start=st.tuples(st.floats(-2.4, 2.4), st.floats(-0.7, 1.3)),
)
def test_position_speed_and_acceleration_stay_inside_limits_whatever_is_commanded(commands, start) -> None:
    parameters = HeadParameters()
    head = HeadMovement(parameters, ROBOT)
    angles, stamp, last = np.array(start), 0, None
    for mode, target, glance, count in commands:
        for _ in range(count):
            stamp += PERIOD
            command = head.update(stamp, HeadCommand(stamp, mode, target, glance), angles)
            assert np.all(command.position >= LOWER) and np.all(command.position <= UPPER)
            assert np.all(np.abs(command.velocity) <= parameters.speed + 1e-9)
            if last is not None:
                step = command.velocity - last.velocity
                assert np.all(np.abs(step) <= parameters.acceleration * PERIOD * 1e-9 + 1e-9)
                moved = command.position - last.position
                assert np.allclose(moved, command.velocity * PERIOD * 1e-9, atol=1e-9)  # nothing was cut off at a limit
            angles, last = command.position, command


def test_target_out_of_reach_is_looked_at_from_the_joint_limit() -> None:
    behind = (-3.0, 0.1, 0.0)
    last = drive(HeadMovement(HeadParameters(), ROBOT), HeadCommand(0, HeadMode.LOOK_AT, behind), 3.0)[-1]
    assert last.position[0] == pytest.approx(UPPER[0] - HeadParameters().limit_margin)


def test_tracking_looks_at_the_glance_while_there_is_one_and_returns_to_the_target() -> None:
    ball, post = (1.0, 0.3, 0.09), (3.0, -2.0, 0.0)
    head = HeadMovement(HeadParameters(), ROBOT)
    angles = np.zeros(2)
    for glance, looked_at in ((None, ball), (post, post), (None, ball)):
        for tick in range(40):
            stamp = 10**9 + tick * PERIOD
            angles = head.update(stamp, HeadCommand(0, HeadMode.TRACK, ball, glance), angles).position
        assert off_axis(angles, looked_at) < math.radians(0.1)


class RollingBall:
    """A ball that passes in a straight line, as a world model tells of it: a correction at every third command."""

    def __init__(self, speed: float, ahead: float, spread: float, seed: int) -> None:
        self._speed, self._ahead, self._spread = speed, ahead, spread
        self._rng = np.random.default_rng(seed)
        self._error = np.zeros(2)

    def at(self, seconds: float) -> tuple[float, float, float]:
        """Return where it is truly [m]."""
        return self._ahead, 2.0 - self._speed * seconds, 0.094

    def told(self, tick: int) -> tuple[float, float, float]:
        """Return where the world model says that it is at a tick."""
        if tick % 3 == 0:
            self._error = self._spread * self._rng.normal(size=2)
        x, y, z = self.at(tick * PERIOD * 1e-9)
        return x + float(self._error[0]), y + float(self._error[1]), z


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("ahead", [0.8, 1.5, 3.0])
def test_a_ball_rolling_by_stays_in_the_middle_of_the_picture(speed: float, ahead: float) -> None:
    ball, head, p = RollingBall(speed, ahead, 0.01, 1), HeadMovement(HeadParameters(), ROBOT), HeadParameters()
    angles, last, errors = np.array([1.0, 0.5]), None, []
    for tick in range(round(4.0 / speed * 50)):
        stamp = 10**9 + tick * PERIOD
        seconds = tick * PERIOD * 1e-9
        command = head.update(stamp, HeadCommand(stamp, HeadMode.LOOK_AT, ball.told(tick)), angles)
        if last is not None:
            assert np.all(np.abs(command.velocity - last.velocity) <= p.acceleration * PERIOD * 1e-9 + 1e-9)
            assert np.all(np.abs(command.velocity) <= p.speed + 1e-9)
            # The joints follow with the delay that `lead` makes up for.
            if seconds > 0.5:
                errors.append(off_axis(last.position, ball.at(seconds - PERIOD * 1e-9 + p.lead)))
        angles, last = command.position, command
    assert max(errors) < math.radians(5.0)
    assert float(np.median(errors)) < math.radians(1.5)


def test_a_target_that_jumps_between_two_places_is_not_taken_for_a_moving_one() -> None:
    target = MovingTarget(0.2, 8.0)
    for tick in range(30):
        target.see(tick * PERIOD, (1.0, 0.05 if (tick // 3) % 2 else -0.05, 0.1))
        assert target.velocity == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_moving_target_is_carried_on_for_a_while_only() -> None:
    target = MovingTarget(0.2, 8.0)
    for tick in range(10):
        target.see(tick * PERIOD, (1.0, 0.02 * tick, 0.1))  # 1 m/s
    last = 9 * PERIOD
    assert target.at(last + 100_000_000) == pytest.approx((1.0, 0.28, 0.1))
    assert target.at(last + 10**10) == pytest.approx((1.0, 0.38, 0.1))


def test_way_time_is_what_the_trajectory_needs() -> None:
    for distance in (0.1, 0.4, 1.5):
        trajectory = HeadTrajectory(np.array([-2.0, -2.0]), np.array([2.0, 2.0]), 30.0)
        ticks = 0
        while abs(trajectory.position[0] - distance) > 0.002:
            trajectory.advance(np.array([distance, 0.0]), np.zeros(2), np.full(2, 4.0), 0.002)
            ticks += 1
        time = float(travel_time(np.array([distance]), 4.0, 30.0)[0])
        assert ticks * 0.002 == pytest.approx(time, abs=0.04)


@settings(max_examples=30)
@given(pan=st.floats(-2.3, 2.3), tilt=st.floats(-0.6, 1.2), distance=st.floats(0.5, 8.0))
def test_point_ahead_of_angles_leads_back_to_them(pan: float, tilt: float, distance: float) -> None:
    geometry = HeadGeometry(ROBOT, 0.02)
    angles = geometry.angles_towards(geometry.point_ahead(np.array([pan, tilt]), distance))
    assert angles == pytest.approx(np.array([pan, tilt]), abs=1e-6)


def test_tracking_without_glance_stays_on_the_target() -> None:
    ball = (1.0, 0.3, 0.09)
    commands = drive(HeadMovement(HeadParameters(), ROBOT), HeadCommand(0, HeadMode.TRACK, ball), 8.0)
    assert all(off_axis(command.position, ball) < math.radians(1.0) for command in commands[50:])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_search_begins_on_the_side_where_the_target_was_lost(side: float) -> None:
    head = HeadMovement(HeadParameters(), ROBOT)
    target = (2.0, side * 1.0, 0.0)
    angles = drive(head, HeadCommand(0, HeadMode.LOOK_AT, target), 1.0)[-1].position
    pans = []
    for tick in range(40):
        command = head.update(2 * 10**9 + tick * PERIOD, HeadCommand(0, HeadMode.SEARCH), angles)
        angles = command.position
        pans.append(angles[0])
    assert side * pans[-1] > side * pans[0] + 0.5


def test_search_for_a_target_lost_at_the_feet_looks_near_first() -> None:
    near = drive(HeadMovement(HeadParameters(), ROBOT), HeadCommand(0, HeadMode.SEARCH, (0.5, 0.1, 0.0)), 1.0)[-1]
    far = drive(HeadMovement(HeadParameters(), ROBOT), HeadCommand(0, HeadMode.SEARCH, (3.0, 0.1, 0.0)), 1.0)[-1]
    assert near.position[1] == pytest.approx(HeadParameters().search_tilt_near)
    assert far.position[1] == pytest.approx(HeadParameters().search_tilt_far)


def test_hold_stops_a_moving_head_within_its_braking_distance() -> None:
    head = HeadMovement(HeadParameters(), ROBOT)
    moving = drive(head, HeadCommand(0, HeadMode.LOOK_AT, (-1.0, 2.0, 0.0)), 0.24)[-1]
    angles = moving.position
    for tick in range(12, 40):
        command = head.update(10**9 + tick * PERIOD, HeadCommand(0, HeadMode.HOLD), angles)
        angles = command.position
    speed = abs(moving.velocity[0])
    braking = speed**2 / (2.0 * HeadParameters().acceleration) + 2.0 * speed * PERIOD * 1e-9
    assert abs(command.velocity[0]) < 0.01
    assert abs(angles[0] - moving.position[0]) < braking


def test_after_a_pause_the_trajectory_begins_where_the_joints_are() -> None:
    head = HeadMovement(HeadParameters(), ROBOT)
    drive(head, HeadCommand(0, HeadMode.LOOK_AT, (1.0, 1.0, 0.0)), 1.0)
    command = head.update(60 * 10**9, HeadCommand(0, HeadMode.LOOK_AT, (1.0, 1.0, 0.0)), np.array([-0.5, 0.2]))
    assert command.position.tolist() == [-0.5, 0.2]


def test_robot_without_head_is_refused() -> None:
    with pytest.raises(ValueError, match="has no head"):
        HeadMovement(HeadParameters(), load_robot("table"))


@pytest.mark.parametrize(
    "wrong", [{"speed": 0.0}, {"damping": -1.0}, {"search_tilt_near": 0.1}, {"stiffness": math.nan}]
)
def test_parameters_out_of_range_are_refused_by_name(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        HeadParameters(**wrong)


def test_a_limp_head_has_no_stiffness_and_afterwards_begins_where_it_hangs() -> None:
    head = HeadMovement(HeadParameters(), ROBOT)
    command = HeadCommand(10**9, HeadMode.LOOK_AT, (1.0, 1.0, 0.0))
    before = drive(head, command, 1.0)[-1]
    hanging = np.array([0.0, 0.6])
    limp = head.limp(before.stamp + PERIOD, hanging)
    assert limp.sequence == before.sequence + 1 and limp.names == HEAD_JOINTS
    assert not np.any([limp.stiffness, limp.damping, limp.effort])
    after = head.update(limp.stamp + PERIOD, command, hanging)
    assert after.position == pytest.approx(hanging) and after.stiffness.all()
