from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_strategy.behaviour.path import distance_to_way, next_waypoint, side_round

CLEARANCE, STANDOFF, ARC = 0.50, 0.58, 0.6


@given(st.floats(0.52, 3.0), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_the_way_reaches_the_place_behind_the_ball_and_keeps_clear_of_the_ball(
    distance: float, ball_angle: float, aim: float
) -> None:
    """Walk the way in steps of 2 cm, from the origin."""
    ball = (distance * math.cos(ball_angle), distance * math.sin(ball_angle))
    target = (ball[0] - STANDOFF * math.cos(aim), ball[1] - STANDOFF * math.sin(aim))
    x, y, side, walked = 0.0, 0.0, 0, 0.0
    while math.dist((x, y), target) > 0.02:
        seen_ball, seen_target = (ball[0] - x, ball[1] - y), (target[0] - x, target[1] - y)
        side = side_round(seen_target, seen_ball, side)
        waypoint = next_waypoint(seen_target, seen_ball, CLEARANCE, side, ARC)
        length = math.hypot(*waypoint)
        step = min(0.02, length)
        x, y, walked = x + step * waypoint[0] / length, y + step * waypoint[1] / length, walked + step
        assert math.dist((x, y), ball) > 0.95 * CLEARANCE
        # No way round is longer than straight to the circle, half round it and out to the target, and a bit.
        assert walked < distance + math.pi * STANDOFF + 0.4


@given(st.floats(0.15, 0.48), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_a_robot_too_near_to_the_ball_walks_away_from_it(distance: float, ball_angle: float, aim: float) -> None:
    ball = (distance * math.cos(ball_angle), distance * math.sin(ball_angle))
    target = (ball[0] - STANDOFF * math.cos(aim), ball[1] - STANDOFF * math.sin(aim))
    waypoint = next_waypoint(target, ball, CLEARANCE, side_round(target, ball, 0), ARC)
    assert math.dist(waypoint, ball) > distance


def test_a_free_way_is_straight() -> None:
    assert next_waypoint((1.0, 1.0), (2.0, -1.0), CLEARANCE, 1, ARC) == (1.0, 1.0)


def test_the_side_is_the_shorter_one_and_is_kept_when_both_are_about_as_long() -> None:
    ball = (1.0, 0.0)
    assert side_round((1.0, -0.5), ball, 0) == 1  # robot behind, target to the right: anticlockwise round the ball
    assert side_round((1.0, 0.5), ball, 0) == -1
    assert side_round((1.5, 0.01), ball, 1) == 1
    assert side_round((1.5, 0.01), ball, -1) == -1


def test_distance_to_a_way_counts_its_ends() -> None:
    assert distance_to_way((0.5, 0.3), (0.0, 0.0), (1.0, 0.0)) == pytest.approx(0.3)
    assert distance_to_way((-0.3, 0.4), (0.0, 0.0), (1.0, 0.0)) == pytest.approx(0.5)
    assert distance_to_way((3.0, 4.0), (0.0, 0.0), (0.0, 0.0)) == pytest.approx(5.0)
