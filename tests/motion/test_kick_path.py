"""Kicks on paper: profiles, paths, where foot and ball meet, and what is refused."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import FootMotion
from tulip_motion.interface import KickGoal, KickKind, Side
from tulip_motion.kick_geometry import gap_between, striking_face
from tulip_motion.kick_path import FootPath, Move, Profile, Quintic, brake
from tulip_motion.kick_plan import BRAKING, SLOWEST, expected_ball, plan_kick
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import reach, step_time
from tulip_motion.walking_kick import KickSwing, WalkingKick

P = MotionParameters()
SOLES = load_robot().feet
REACH = reach(P, load_robot())
FEET = (Pose2D(0.067, 0.12, 0.0), Pose2D(0.067, -0.12, 0.0))
numbers = st.floats(-1.0, 1.0)
fours = st.tuples(numbers, numbers, numbers, numbers)


def foot(position: tuple[float, ...], velocity: tuple[float, ...], acceleration: tuple[float, ...]) -> FootMotion:
    p, v, a = np.array(position), np.array(velocity), np.array(acceleration)
    return FootMotion(p[:3], v[:3], a[:3], p[3], v[3], a[3])


def four(motion: FootMotion) -> np.ndarray:
    return np.array([*motion.position, motion.yaw])


def moves_of(goal: KickGoal) -> tuple[Move, ...]:
    moves = plan_kick(P, goal, FEET, SOLES)
    assert not isinstance(moves, str), moves
    return moves


def test_the_balls_radius_is_that_of_the_field() -> None:
    assert load_field().ball_radius == P.ball_radius


@pytest.mark.parametrize("profile", Profile)
def test_a_moves_velocity_and_acceleration_are_its_derivatives(profile: Profile) -> None:
    move = Move(np.zeros(4), np.array([0.4, 0.1, -0.05, 0.3]), 0.3, profile)
    h = 1e-5
    for time in (0.05, 0.15, 0.28):
        before, now, after = (move.evaluate(time + step) for step in (-h, 0.0, h))
        np.testing.assert_allclose(np.subtract(after.position, before.position) / (2 * h), now.velocity, atol=1e-6)
        np.testing.assert_allclose(np.subtract(after.velocity, before.velocity) / (2 * h), now.acceleration, atol=1e-5)
        assert (after.yaw - before.yaw) / (2 * h) == pytest.approx(now.yaw_rate, abs=1e-6)


def test_half_profiles_join_at_full_speed_without_acceleration() -> None:
    middle = np.array([0.2, 0.0, 0.0, 0.0])
    first = Move(np.zeros(4), middle, 0.1, Profile.FIRST_HALF)
    second = Move(middle, np.array([0.3, 0.0, 0.0, 0.0]), 0.05, Profile.SECOND_HALF)
    for end in (first.evaluate(0.1), second.evaluate(0.0)):
        np.testing.assert_allclose(end.velocity, [4.0, 0.0, 0.0], atol=1e-9)
        np.testing.assert_allclose(end.acceleration, 0.0, atol=1e-9)
        np.testing.assert_allclose(end.position, [0.2, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(second.evaluate(0.05).velocity, 0.0, atol=1e-9)


@given(fours, fours, fours, fours, fours, st.floats(0.1, 1.0))
def test_a_quintic_meets_the_state_at_both_ends(
    position: tuple[float, ...],
    velocity: tuple[float, ...],
    acceleration: tuple[float, ...],
    end: tuple[float, ...],
    end_velocity: tuple[float, ...],
    duration: float,
) -> None:
    way = Quintic(foot(position, velocity, acceleration), np.array(end), np.array(end_velocity), duration)
    first, last = way.evaluate(0.0), way.evaluate(duration)
    np.testing.assert_allclose(four(first), position, atol=1e-9)
    np.testing.assert_allclose(first.velocity, velocity[:3], atol=1e-9)
    np.testing.assert_allclose(first.acceleration, acceleration[:3], atol=1e-9)
    np.testing.assert_allclose(four(last), end, atol=1e-6)
    np.testing.assert_allclose(last.velocity, end_velocity[:3], atol=1e-5)
    np.testing.assert_allclose(last.acceleration, 0.0, atol=1e-3)


def test_a_braked_foot_rests_after_the_way_at_half_its_speed() -> None:
    stop = brake(foot((0.1, 0.0, 0.06, 0.0), (3.0, 0.0, 0.0, 0.0), (20.0, 0.0, 0.0, 0.0)), 0.2)
    end = stop.evaluate(0.2)
    np.testing.assert_allclose(end.position, [0.1 + 0.3, 0.0, 0.06], atol=1e-9)
    np.testing.assert_allclose(end.velocity, 0.0, atol=1e-9)


def test_past_its_end_a_path_goes_on_down() -> None:
    path = FootPath([Move(np.array([0.0, 0.0, 0.06, 0.2]), np.array([0.0, 0.0, 0.0, 0.2]), 0.3)], 0.15)
    late = path.evaluate(0.4)
    assert late.position[2] == pytest.approx(-0.015)
    assert late.velocity[2] == -0.15
    assert late.yaw == pytest.approx(0.2)


@given(st.sampled_from(KickKind), st.sampled_from(Side), st.floats(-3.0, 3.0), numbers, numbers)
def test_at_the_contact_the_face_touches_the_ball_and_looks_along_the_direction(
    kind: KickKind, side: Side, direction: float, x: float, y: float
) -> None:
    face = striking_face(kind, side, SOLES[side])
    sole = face.sole_at_contact((x, y), direction, P.ball_radius)
    touched = sole.transform(face.middle)
    assert touched[0] + P.ball_radius * math.cos(direction) == pytest.approx(x, abs=1e-9)
    assert touched[1] + P.ball_radius * math.sin(direction) == pytest.approx(y, abs=1e-9)
    assert face.ball_before(sole, 0.0, P.ball_radius) == pytest.approx((x, y), abs=1e-9)


def test_the_gap_between_the_standing_feet_is_what_their_width_leaves() -> None:
    assert gap_between(FEET[0], SOLES[0], FEET[1], SOLES[1]) == pytest.approx(0.24 - 0.15)
    assert gap_between(FEET[0], SOLES[0], Pose2D(0.067, -0.02, 0.0), SOLES[1]) == pytest.approx(-0.01)


@pytest.mark.parametrize("side", Side)
@pytest.mark.parametrize("direction", [-0.15, 0.0, 0.15])
def test_the_foot_goes_through_the_balls_place_along_the_direction_at_the_speed_for_the_ball(
    side: Side, direction: float
) -> None:
    ball = (0.36, 0.13 if side is Side.LEFT else -0.13)
    _, run_up, follow, _, down = moves_of(KickGoal(side, direction, 3.0, ball=ball))
    hit = run_up.evaluate(run_up.duration)
    face = striking_face(KickKind.FORWARD, side, SOLES[side])
    sole = Pose2D(hit.position[0], hit.position[1], hit.yaw)
    assert face.ball_before(sole, 0.0, P.ball_radius) == pytest.approx(ball, abs=1e-9)
    speed = 3.0 / P.kick_speed_ratio
    np.testing.assert_allclose(hit.velocity, [speed * math.cos(direction), speed * math.sin(direction), 0.0], atol=1e-9)
    np.testing.assert_allclose(follow.evaluate(0.0).velocity, hit.velocity, atol=1e-9)
    home = FEET[side]
    np.testing.assert_allclose(down.end, [home.x, home.y, 0.0, home.yaw], atol=1e-12)


def test_the_way_beyond_a_far_ball_is_shortened_to_what_the_leg_reaches() -> None:
    *_, follow, _, _ = moves_of(KickGoal(Side.RIGHT, -1.37, 1.7, KickKind.SIDE, (0.10, -0.38)))
    assert abs(follow.end[1] - FEET[0].y) < 0.45
    assert np.linalg.norm(follow.end - follow.start) < P.side_kick_follow_through - 0.015


@pytest.mark.parametrize("side", Side)
def test_a_side_kick_keeps_clear_of_the_other_foot_and_meets_the_ball_with_its_outer_side(side: Side) -> None:
    outward = 1.0 if side is Side.LEFT else -1.0
    moves = moves_of(KickGoal(side, outward * math.pi / 2, 1.5, KickKind.SIDE))
    for move in moves:
        for share in np.linspace(0.0, 1.0, 20):
            x, y, _, yaw = move.start + share * (move.end - move.start)
            assert gap_between(Pose2D(x, y, yaw), SOLES[side], FEET[side.other], SOLES[side.other]) > 0.0
    hit = moves[1].evaluate(moves[1].duration)
    assert outward * hit.velocity[1] == pytest.approx(1.5 / P.side_kick_speed_ratio)
    assert hit.yaw == pytest.approx(0.0)


def standing(width: float) -> tuple[Pose2D, Pose2D]:
    return Pose2D(0.067, 0.5 * width, 0.0), Pose2D(0.067, -0.5 * width, 0.0)


def test_a_forward_kick_expects_the_ball_ahead_of_its_foot_however_wide_the_feet_stand() -> None:
    for width in (0.2, 0.24, 0.3):
        _, y = expected_ball(P, KickKind.FORWARD, Side.LEFT, standing(width), SOLES)
        assert y == pytest.approx(0.5 * width)


@pytest.mark.parametrize("side", Side)
def test_a_side_kick_expects_the_ball_nearer_its_foot_when_the_feet_stand_wide(side: Side) -> None:
    outward = 1.0 if side is Side.LEFT else -1.0
    gaps = []
    for width in (0.22, 0.26, 0.28, 0.30):
        _, y = expected_ball(P, KickKind.SIDE, side, standing(width), SOLES)
        gaps.append(outward * y - 0.5 * width - 0.075 - P.ball_radius)
    assert gaps[:2] == pytest.approx([P.side_kick_gap] * 2)
    assert P.side_kick_gap > gaps[2] > gaps[3] > 0.02


@pytest.mark.parametrize("side", Side)
@pytest.mark.parametrize("width", [0.24, 0.26, 0.28, 0.30])
def test_a_side_kick_reaches_the_ball_where_it_lies_farthest_whatever_the_stance(side: Side, width: float) -> None:
    outward, feet = (1.0 if side is Side.LEFT else -1.0), standing(width)
    x, y = expected_ball(P, KickKind.SIDE, side, feet, SOLES)
    far = (x, y + outward * (P.side_kick_reach_far - 1e-6))
    for ahead in (-0.2, 0.0, 0.1):  # [rad]; farther ahead, the foot strikes from farther behind its hip
        goal = KickGoal(side, outward * (0.5 * math.pi - ahead), 1.7, KickKind.SIDE, far)
        moves = plan_kick(P, goal, feet, SOLES)
        assert not isinstance(moves, str), moves
        speed = float(np.linalg.norm(moves[1].evaluate(moves[1].duration).velocity))
        assert SLOWEST * 1.7 / P.side_kick_speed_ratio - 1e-9 <= speed <= 1.7 / P.side_kick_speed_ratio + 1e-9
        stop = max(
            float(np.linalg.norm(moves[2].evaluate(time).acceleration))
            for time in np.linspace(0.0, moves[2].duration, 50)
        )
        assert stop < 1.05 * BRAKING


LEFT = Side.LEFT


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (KickGoal(LEFT, speed=9.0), "speed is 9.00 m/s; expected above 0 and at most 3.5 m/s"),
        (KickGoal(LEFT, speed=float("nan")), "speed is nan"),
        (KickGoal(LEFT, direction=2.0), "direction is 2.00 rad; expected within 0.4 rad of 0.00 rad"),
        (KickGoal(LEFT, 0.0, 1.5, KickKind.SIDE), "direction is 0.00 rad; expected within 0.4 rad of 1.57 rad"),
        (KickGoal(LEFT, -1.57, 1.5, KickKind.SIDE), "expected within 0.4 rad of 1.57 rad"),
        (KickGoal(LEFT, 1.57, 3.0, KickKind.SIDE), "speed is 3.00 m/s; expected above 0 and at most 2.0 m/s"),
        (KickGoal(LEFT, ball=(0.6, 0.12)), r"ball is at \(0.60, 0.12\) m, out of reach of the left foot; expected at"),
        (KickGoal(LEFT, ball=(0.34, -0.12)), r"out of reach of the left foot.*from \(0.34, 0.12\) m"),
        (KickGoal(LEFT, ball=(0.34, float("inf"))), "expected two finite numbers"),
        (
            KickGoal(LEFT, direction=0.4, ball=(0.34, 0.08)),
            "left foot would touch the other one on its swing along 0.40",
        ),
        (KickGoal(LEFT, direction=-0.4, ball=(0.33, 0.17)), "left leg is too short for its swing along -0.40 rad"),
    ],
)
def test_what_cannot_be_kicked_is_refused_in_words(goal: KickGoal, words: str) -> None:
    refusal = plan_kick(P, goal, FEET, SOLES)
    assert isinstance(refusal, str)
    assert re.search(words, refusal)


def test_a_kicking_swing_meets_the_ball_at_full_speed_and_lands_at_rest() -> None:
    contact = Pose2D(0.15, 0.12, 0.1)
    swing = KickSwing(Pose2D(-0.1, 0.12, 0.0), contact, 1.2, 0.236, 0.392, 0.045, 0.15)
    feet = [swing.advance(Pose2D(0.24, 0.13, 0.05), 0.392 - 0.004 * k, 0.004) for k in range(98)]
    met = feet[58]
    np.testing.assert_allclose(met.position[:2], [contact.x, contact.y], atol=1e-4)
    np.testing.assert_allclose(met.velocity[:2], [1.2 * math.cos(0.1), 1.2 * math.sin(0.1)], atol=1e-2)
    assert met.yaw == pytest.approx(0.1, abs=1e-4)
    np.testing.assert_allclose(feet[-1].position, [0.24, 0.13, 0.0], atol=2e-3)
    steps = np.diff([foot.position[0] for foot in feet]) / 0.004
    assert np.abs(np.diff(steps)).max() < 0.3  # no jump of the speed anywhere


def test_a_kicking_swing_that_is_given_up_lands_where_it_was_to_land() -> None:
    swing = KickSwing(Pose2D(-0.1, 0.12, 0.0), Pose2D(0.15, 0.12, 0.1), 1.2, 0.236, 0.392, 0.045, 0.15)
    for k in range(98):
        if k == 30:
            swing.give_up()
        foot = swing.advance(Pose2D(0.24, 0.13, 0.05), 0.392 - 0.004 * k, 0.004)
    np.testing.assert_allclose(foot.position, [0.24, 0.13, 0.0], atol=2e-3)


@given(st.floats(0.1, 0.45), st.floats(0.6, 1.0), st.sampled_from(Side))
def test_a_ball_ahead_of_the_foot_is_reached_by_one_of_the_next_steps(speed: float, ahead: float, side: Side) -> None:
    outward = 1.0 if side is Side.LEFT else -1.0
    kick = WalkingKick(P, REACH, side, (ahead, outward * 0.12), 0.0, 1.2, SOLES)
    stance = Footstep(Side.LEFT, Pose2D(0.067, 0.12, 0.0))
    refusal = kick.refusal(stance, Pose2D(0.067 - speed * step_time(P, speed), -0.12, 0.0), (speed, 0.0, 0.0))
    # The last two steps may be the other foot's, and end before it.
    far = ahead - 0.5 > speed * step_time(P, speed) * (P.walking_kick_steps - 2)
    assert far or not refusal


def test_a_ball_beside_the_way_is_refused_with_the_place_of_the_foot() -> None:
    kick = WalkingKick(P, REACH, Side.LEFT, (0.7, 0.6), 0.0, 1.2, SOLES)
    stance = Footstep(Side.LEFT, Pose2D(0.067, 0.12, 0.0))
    refusal = kick.refusal(stance, Pose2D(0.0, -0.12, 0.0), (0.25, 0.0, 0.0))
    assert "no left step of the next 8 reaches the ball" in refusal
    assert re.search(r"\(0\.\d\d, 0\.7\d\) m from the standing one", refusal)  # 0.6 m and half the width of the walk
