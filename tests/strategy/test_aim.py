from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_strategy.behaviour.aim import Gap, choose_gap, free_gaps

POSTS = ((4.5, 1.355), (4.5, -1.355))
POST_RADIUS, BALL_RADIUS, KEEPER_RADIUS = 0.055, 0.0935, 0.25


def gaps_of(ball: tuple[float, float], *opponents: tuple[float, float]) -> tuple[Gap, ...]:
    return free_gaps(ball, POSTS, POST_RADIUS, opponents, KEEPER_RADIUS, BALL_RADIUS)


def test_an_empty_goal_is_one_gap_between_the_posts_less_the_balls_radius() -> None:
    (gap,) = gaps_of((1.5, 0.0))
    post = math.atan2(1.355, 3.0) - math.asin((POST_RADIUS + BALL_RADIUS) / math.hypot(1.355, 3.0))
    assert (gap.right, gap.left) == pytest.approx((-post, post))


def test_a_keeper_splits_the_goal_and_the_wider_side_is_chosen() -> None:
    gaps = gaps_of((1.5, 0.0), (4.3, 0.4))
    assert len(gaps) == 2
    chosen = choose_gap(gaps, None, 1.25)
    assert chosen == gaps[0]
    assert chosen is not None
    assert chosen.middle < 0.0  # the keeper stands to the left


def test_the_side_aimed_at_before_is_kept_unless_the_other_is_clearly_wider() -> None:
    right, left = Gap(-0.5, -0.2), Gap(0.1, 0.43)
    assert choose_gap((right, left), None, 1.25) == left
    assert choose_gap((right, left), right.middle, 1.25) == right
    assert choose_gap((right, Gap(0.1, 0.5)), right.middle, 1.25) == Gap(0.1, 0.5)


def test_a_keeper_right_in_front_of_the_ball_leaves_no_gap() -> None:
    assert gaps_of((3.9, 0.0), (4.2, 0.0)) == ()
    assert choose_gap((), 0.3, 1.25) is None


def test_an_opponent_behind_the_goal_line_or_behind_the_ball_blocks_nothing() -> None:
    assert gaps_of((1.5, 0.0), (6.0, 0.0)) == gaps_of((1.5, 0.0))
    assert gaps_of((1.5, 0.0), (-2.0, 0.0)) == gaps_of((1.5, 0.0))


@given(
    st.floats(-4.0, 4.0),
    st.floats(-2.8, 2.8),
    st.lists(st.tuples(st.floats(-4.4, 4.4), st.floats(-3.0, 3.0)), max_size=4),
)
def test_the_middle_of_every_gap_passes_all_obstacles_and_posts(
    x: float, y: float, opponents: list[tuple[float, float]]
) -> None:
    for gap in gaps_of((x, y), *opponents):
        for place, radius in [(point, KEEPER_RADIUS) for point in opponents] + [(post, POST_RADIUS) for post in POSTS]:
            dx, dy = place[0] - x, place[1] - y
            along = math.cos(gap.middle) * dx + math.sin(gap.middle) * dy
            if (
                0.0 < along
                and math.hypot(dx, dy) > radius + BALL_RADIUS
                and math.hypot(dx, dy) < math.dist((x, y), (4.5, 0.0))
            ):
                across = abs(-math.sin(gap.middle) * dx + math.cos(gap.middle) * dy)
                assert across >= radius + BALL_RADIUS - 1e-9


def test_an_opponent_that_moves_while_the_ball_rolls_leaves_less_room() -> None:
    still, moving = (free_gaps((2.0, 0.0), POSTS, 0.055, [(4.2, 0.0)], 0.3, 0.094, reach) for reach in (0.0, 0.09))
    assert len(still) == len(moving) == 2
    for one, other in zip(still, moving, strict=True):
        assert other.width < one.width
        assert abs(other.middle) > abs(one.middle)  # farther off the opponent
