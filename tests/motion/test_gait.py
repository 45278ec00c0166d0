"""Footsteps, swing foot, kick profile and ZMP feedback."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.planar import Pose2D
from tulip_motion.footsteps import Footstep, centre_beside, foot_beside, next_footstep, plan_footsteps
from tulip_motion.gait import SwingFoot, sole_point
from tulip_motion.interface import Side
from tulip_motion.kick_path import cosine_profile
from tulip_motion.parameters import MotionParameters
from tulip_motion.stabilizer import SupportArea, stabilize

P = MotionParameters()
velocities = st.tuples(st.floats(-0.3, 0.6), st.floats(-0.2, 0.2), st.floats(-1.0, 1.0))


@given(st.sampled_from(Side), velocities)
def test_feet_never_come_nearer_than_the_stance_width_sideways(
    side: Side, velocity: tuple[float, float, float]
) -> None:
    stance = Footstep(side, Pose2D(0.3, -0.2, 0.7))
    landed = next_footstep(stance, velocity, P.step_time, P.stance_width)
    beside = stance.pose.inverse() @ landed.pose
    outwards = beside.y if landed.side is Side.LEFT else -beside.y
    # A turning foot swings round the middle between the feet; its yaw is at most 0.9 rad here.
    assert outwards >= 0.5 * P.stance_width * (1.0 + math.cos(0.9)) - 1e-9


@given(velocities)
def test_footsteps_advance_by_the_commanded_velocity(velocity: tuple[float, float, float]) -> None:
    start = Footstep(Side.LEFT, Pose2D(0.0, 0.5 * P.stance_width, 0.0))
    straight = (velocity[0], velocity[1], 0.0)
    steps = plan_footsteps(start, straight, P.step_time, P.stance_width, 8)
    # The last of the eight is a left foot again: the pair has moved by eight step times of velocity.
    moved = centre_beside(steps[7], P.stance_width)
    assert moved.x == pytest.approx(8 * P.step_time * velocity[0], abs=1e-12)
    assert moved.y == pytest.approx(8 * P.step_time * velocity[1], abs=1e-12)


def test_centre_beside_is_the_inverse_of_foot_beside() -> None:
    centre = Pose2D(1.0, -2.0, 0.4)
    for side in Side:
        assert centre_beside(foot_beside(centre, side, 0.24), 0.24).x == pytest.approx(1.0)


def test_swing_foot_reaches_a_target_that_moved_on_the_way_and_lands_at_rest() -> None:
    swing = SwingFoot(Pose2D(0.0, 0.1, 0.0), 0.4, 0.045, 0.15)
    heights = []
    for k in range(100):
        target = Pose2D(0.2, 0.1, 0.1) if k < 50 else Pose2D(0.25, 0.05, 0.2)
        foot = swing.advance(target, 0.4 - 0.004 * k, 0.004)
        heights.append(foot.position[2])
    np.testing.assert_allclose(foot.position, [0.25, 0.05, 0.0], atol=1e-3)
    assert foot.yaw == pytest.approx(0.2, abs=1e-3)
    np.testing.assert_allclose(foot.velocity[:2], 0.0, atol=0.02)  # the last tick of the quintic is cut
    assert max(heights) == pytest.approx(0.045, abs=1e-4)


def test_swing_foot_that_meets_no_ground_goes_on_down() -> None:
    swing = SwingFoot(Pose2D(), 0.4, 0.045, 0.15)
    for k in range(125):
        foot = swing.advance(Pose2D(), 0.4 - 0.004 * k, 0.004)
    assert foot.position[2] == pytest.approx(-0.15 * 0.1, abs=2e-3)


def test_cosine_profile_covers_the_way_and_its_rate_is_the_derivative() -> None:
    duration, h = 0.25, 1e-6
    assert cosine_profile(0.0, duration) == (0.0, 0.0, 0.0)
    assert cosine_profile(duration, duration)[0] == pytest.approx(1.0)
    assert cosine_profile(duration / 2, duration)[1] == pytest.approx(2.0 / duration)
    for time in (0.05, 0.1, 0.2):
        _, rate, acceleration = cosine_profile(time, duration)
        later, earlier = cosine_profile(time + h, duration), cosine_profile(time - h, duration)
        assert rate == pytest.approx((later[0] - earlier[0]) / (2 * h), abs=1e-6)
        assert acceleration == pytest.approx((later[1] - earlier[1]) / (2 * h), abs=1e-4)


LEFT = Footstep(Side.LEFT, Pose2D(0.0, 0.12, 0.0))
RIGHT = Footstep(Side.RIGHT, Pose2D(0.05, -0.12, 0.0))


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.booleans())
def test_commanded_zmp_stays_inside_the_support(x: float, y: float, both: bool) -> None:
    balance = stabilize(SupportArea.of(P, LEFT, RIGHT if both else None), (0.0, 0.0), (0.0, 0.0), (x, y))
    share = balance.right_share
    left, right = (np.array(sole_point(foot, P.zmp_forward, P.zmp_inward)) for foot in (LEFT, RIGHT))
    offset = np.array(balance.zmp) - ((1 - share) * left + share * right)
    assert -P.zmp_limit_heel - 1e-12 <= offset[0] <= P.zmp_limit_toe + 1e-12
    assert abs(offset[1]) <= P.zmp_limit_side + 1e-12
    assert both or share == 0.0
    beyond = np.abs(np.subtract(balance.cmp, balance.zmp))
    assert beyond.max() <= P.cmp_beyond_sole + 1e-12
    if beyond.any():  # the ankles come first
        clipped = np.isclose(offset, (P.zmp_limit_toe, P.zmp_limit_side)) | np.isclose(
            offset, (-P.zmp_limit_heel, -P.zmp_limit_side)
        )
        assert np.all(clipped | (beyond < 1e-12))


def test_zmp_feedback_is_exact_where_it_is_not_clipped() -> None:
    aim = sole_point(LEFT, P.zmp_forward, P.zmp_inward)
    balance = stabilize(SupportArea.of(P, LEFT, None), aim, aim, (aim[0] + 0.01, aim[1] - 0.01))
    gain = 1.0 + P.dcm_gain
    assert balance.zmp == pytest.approx((aim[0] + gain * 0.01, aim[1] - gain * 0.01))
    assert balance.cmp == balance.zmp


def test_parameters_refuse_a_double_support_longer_than_the_step() -> None:
    with pytest.raises(ValueError, match="double_support_time"):
        MotionParameters(double_support_time=0.5)
