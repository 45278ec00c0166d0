"""The landing that answers a disturbance: nominal without one, within reach, in time, alike on both feet."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.robot import load_robot
from tulip_motion.lipm import time_constant
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import reach
from tulip_motion.step_adjustment import Landing, Point, StepAdjustment

P = MotionParameters()
REACH = reach(P, load_robot())
TC = time_constant(P.com_height)
REMAINING = P.placement_freeze_time + 18 * 2 * P.control_period  # [s] in the middle of a step; one of the candidates
NOMINAL = (0.1, P.stance_width)  # [m] of a step forward of the left foot
LANDING_DCM = (0.07, 0.5 * P.stance_width)  # [m] from the aim point, as a step of this size has it
RIGHT_STANDS, LEFT_STANDS = (StepAdjustment(P, REACH, TC, inward) for inward in (1.0, -1.0))


def solve(
    error: Point,
    remaining: float = REMAINING,
    foot: Point = (0.05, 0.27),
    adjustment: StepAdjustment = RIGHT_STANDS,
    extension: float = P.max_step_extension,
) -> Landing:
    """Answer a DCM that is off its plan by an error [m] now; the right foot stands, the left one swings at `foot`."""
    decay = math.exp(-remaining / TC)
    dcm = (LANDING_DCM[0] * decay + error[0], LANDING_DCM[1] * decay + error[1])
    return adjustment.solve(dcm, LANDING_DCM, NOMINAL, foot, remaining, remaining + extension)


def mirrored(point: Point) -> Point:
    return point[0], -point[1]


errors = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
times = st.floats(P.placement_freeze_time, 0.45)


@given(times)
def test_without_an_error_the_step_stays_as_planned(remaining: float) -> None:
    landing = solve((0.0, 0.0), remaining)
    assert landing.remaining == remaining
    assert landing.place == pytest.approx(NOMINAL, abs=1e-12)
    assert landing.excess == 0.0


@given(errors, times)
def test_the_landing_is_within_reach_and_its_time_within_bounds(error: Point, remaining: float) -> None:
    landing = solve(error, remaining)
    assert abs(landing.place[0]) <= REACH.stride + 1e-12
    assert REACH.nearest - 1e-12 <= landing.place[1] <= REACH.farthest + 1e-12
    assert P.placement_freeze_time - 1e-12 <= landing.remaining <= remaining + P.max_step_extension + 1e-9
    assert landing.excess >= 0.0


@given(st.tuples(st.floats(-0.03, 0.03), st.floats(-0.01, 0.01)))
def test_an_error_that_place_and_ankle_can_take_changes_no_time_and_leaves_nothing(error: Point) -> None:
    landing = solve(error)
    assert landing.remaining == REMAINING
    assert landing.excess == 0.0
    # The foot goes where the DCM will be, beyond it by what the double support lets the error grow.
    shift = P.double_support_time / TC
    gain = P.placement_gain * shift / (1.0 - math.exp(-shift)) * math.exp(REMAINING / TC)
    assert landing.place[0] - NOMINAL[0] == pytest.approx(gain * error[0], abs=1e-9)


def test_where_the_foot_cannot_go_the_ankle_takes_the_rest() -> None:
    growth = math.exp(REMAINING / TC)
    inside = NOMINAL[1] - REACH.nearest  # [m] that the foot can come nearer
    ankle = P.ankle_share * P.zmp_limit_side * (growth - 1.0)
    assert solve((0.0, -(inside + 0.9 * ankle) / growth)).excess == 0.0
    assert solve((0.0, -(inside + 1.5 * ankle) / growth)).excess > 0.0


@pytest.mark.parametrize("sideways", [0.12, 0.14, 0.16])
def test_pushed_to_the_side_of_the_swing_foot_it_lands_earlier_and_further_out(sideways: float) -> None:
    landing = solve((0.0, sideways))
    assert landing.remaining < REMAINING
    assert landing.place[1] > NOMINAL[1]


@pytest.mark.parametrize(("forward", "foot"), [(0.2, (0.3, 0.27)), (-0.3, (-0.3, 0.27))])
def test_pushed_beyond_a_stride_it_lands_early_when_the_foot_is_near(forward: float, foot: Point) -> None:
    landing = solve((forward, 0.0), foot=foot)
    assert landing.remaining < REMAINING
    assert math.copysign(landing.place[0], forward) == landing.place[0]
    assert abs(landing.place[0]) > 0.8 * REACH.stride


@pytest.mark.parametrize("forward", [0.2, -0.3])
def test_the_foot_is_given_the_time_that_its_way_takes(forward: float) -> None:
    foot = (-0.02 * math.copysign(1.0, forward), 0.27)  # still behind
    landing = solve((forward, 0.0), foot=foot, extension=0.3)
    way = math.dist(landing.place, foot)
    assert landing.remaining > REMAINING
    # A swing of minimum jerk is 1.9 times as fast in its middle as on average; the grid of times is 8 ms fine.
    assert 1.9 * way / P.max_swing_speed <= landing.remaining + 0.008


@given(errors)
def test_the_time_found_costs_no_more_than_the_planned_one_if_the_foot_is_fast_enough(error: Point) -> None:
    quick = StepAdjustment(replace(P, max_swing_speed=100.0), REACH, TC, 1.0)
    landing = solve(error, adjustment=quick)
    decay, growth = math.exp(-REMAINING / TC), math.exp(REMAINING / TC)
    shift = P.double_support_time / TC
    gain = P.placement_gain * shift / (1.0 - math.exp(-shift))
    ranges = (
        ((-REACH.stride, REACH.stride), (-P.zmp_limit_heel, P.zmp_limit_toe)),
        ((REACH.nearest, REACH.farthest), (-P.zmp_limit_side, P.zmp_limit_side)),
    )
    left, way = [], []
    for axis, ((low, high), (ankle_low, ankle_high)) in enumerate(ranges):
        at_landing = (LANDING_DCM[axis] * decay + error[axis]) * growth - LANDING_DCM[axis]
        moved = min(max(NOMINAL[axis] + gain * at_landing, low), high) - NOMINAL[axis]
        rest, ankle = at_landing - moved, P.ankle_share * (growth - 1.0)
        left.append(rest - min(max(rest, ankle * ankle_low), ankle * ankle_high))
        way.append(moved)
    # What lies outside the swing foot counts more.
    planned = math.hypot(*left) ** 2 + (P.outer_excess_weight - 1.0) * max(left[1], 0.0) ** 2
    planned += P.step_place_weight * math.hypot(*way) ** 2
    assert landing.excess <= math.sqrt(planned) + 1e-9


@given(errors, times)
def test_left_and_right_are_mirror_images(error: Point, remaining: float) -> None:
    decay = math.exp(-remaining / TC)
    dcm = (LANDING_DCM[0] * decay + error[0], LANDING_DCM[1] * decay + error[1])
    foot, latest = (0.03, 0.25), remaining + P.max_step_extension
    left = RIGHT_STANDS.solve(dcm, LANDING_DCM, NOMINAL, foot, remaining, latest)
    right = LEFT_STANDS.solve(
        mirrored(dcm), mirrored(LANDING_DCM), mirrored(NOMINAL), mirrored(foot), remaining, latest
    )
    assert right.remaining == left.remaining
    assert right.place == pytest.approx(mirrored(left.place), abs=1e-12)
    assert right.excess == pytest.approx(left.excess, abs=1e-12)
