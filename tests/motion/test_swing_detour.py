"""The swing foot's way around the stance foot."""

from __future__ import annotations

import math

import coal
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import load_robot
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import SwingFoot
from tulip_motion.interface import Side
from tulip_motion.swing_detour import detour

SOLES = load_robot().feet
GAP = 0.015  # [m]
DURATION, HEIGHT = 0.4, 0.05  # [s], [m]
TICK = 0.004  # [s]
HEADING = Pose2D(3.0, -1.0, 2.0)
LEFT_FOOT = Footstep(Side.LEFT, HEADING)


def distance(stance: Footstep, other: Pose2D) -> float:
    """Return the distance between both soles on the ground [m], by a library."""
    shapes = []
    for side, pose in ((stance.side, stance.pose), (stance.side.other, other)):
        sole = SOLES[side]
        centre = pose.transform((sum(sole.x) / 2.0, sum(sole.y) / 2.0))
        box = coal.Box(sole.x[1] - sole.x[0], sole.width, 0.01)
        turn = np.eye(3)
        turn[:2, :2] = pose.rotation()
        shapes += [box, coal.Transform3s(turn, np.array([*centre, 0.0]))]
    return float(coal.distance(*shapes, coal.DistanceRequest(), coal.DistanceResult()))


def least_distance(stance: Footstep, start: Pose2D, landing: Pose2D, around: bool) -> float:
    """Swing from start to landing; return how near the feet come [m]."""
    way = detour(SOLES, stance, start, landing, GAP) if around else None
    swing = SwingFoot(start, DURATION, HEIGHT, 0.1)
    least = math.inf
    for tick in range(round(DURATION / TICK)):
        foot = swing.advance(landing, DURATION - tick * TICK, TICK)
        if way is not None:
            foot = way.added_to(foot, (tick + 1) * TICK / DURATION, 1.0 / DURATION)
        least = min(least, distance(stance, Pose2D(foot.position[0], foot.position[1], foot.yaw)))
    return least


def test_a_straight_step_goes_straight() -> None:
    for side, y in ((Side.LEFT, -0.24), (Side.RIGHT, 0.24)):
        start, landing = HEADING @ Pose2D(-0.2, y), HEADING @ Pose2D(0.2, y)
        assert detour(SOLES, Footstep(side, HEADING), start, landing, GAP) is None


@pytest.mark.parametrize("side", Side)
def test_on_a_fast_curve_the_foot_goes_around_the_one_that_stands(side: Side) -> None:
    """The steps are those of a walk at 0.29 m/s and 1.16 rad/s; to the right they are the mirror image."""
    sign = 1.0 if side is Side.LEFT else -1.0
    stance = Footstep(side, HEADING)
    start = HEADING @ Pose2D(-0.14, -sign * 0.17, -sign * 0.25)
    landing = HEADING @ Pose2D(0.14, -sign * 0.17, sign * 0.25)
    assert least_distance(stance, start, landing, around=False) < 0.012
    assert least_distance(stance, start, landing, around=True) >= GAP - 0.001


places = st.tuples(st.floats(0.17, 0.3), st.floats(-0.5, 0.5))


@given(places, places, st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_the_way_around_is_free_wherever_both_ends_are(
    start: tuple[float, float], landing: tuple[float, float], back: float, ahead: float
) -> None:
    begin = HEADING @ Pose2D(back, -start[0], start[1])
    end = HEADING @ Pose2D(ahead, -landing[0], landing[1])
    # Near its ends the way is as given: the feet stand there, and room to lift the foot is the footsteps' matter.
    assume(min(distance(LEFT_FOOT, begin), distance(LEFT_FOOT, end)) > 1.5 * GAP)
    assert least_distance(LEFT_FOOT, begin, end, around=True) > 0.5 * GAP


def test_velocity_and_acceleration_belong_to_the_way() -> None:
    start, landing = HEADING @ Pose2D(-0.14, -0.17, -0.3), HEADING @ Pose2D(0.14, -0.17, 0.3)
    way = detour(SOLES, LEFT_FOOT, start, landing, GAP)
    assert way is not None
    still = SwingFoot(start, DURATION, HEIGHT, 0.1).advance(start, DURATION, TICK)
    step = 1e-5
    for time in np.linspace(0.02, DURATION - 0.02, 9):
        before, now, after = (
            way.added_to(still, (time + shift) / DURATION, 1.0 / DURATION) for shift in (-step, 0.0, step)
        )
        for i in (0, 1):
            speed = (after.position[i] - before.position[i]) / (2.0 * step)
            change = (after.velocity[i] - before.velocity[i]) / (2.0 * step)
            assert now.velocity[i] - still.velocity[i] == pytest.approx(speed - still.velocity[i], abs=1e-5)
            assert now.acceleration[i] - still.acceleration[i] == pytest.approx(change, abs=1e-3)
    for end in (0.0, 1.0, 1.3):
        there = way.added_to(still, end, 1.0 / DURATION)
        assert there.position == still.position and there.velocity == still.velocity
    assert abs(wrap_angle(math.atan2(way.y, way.x) - HEADING.yaw + 0.5 * math.pi)) < 1e-9  # to the right of a left foot
