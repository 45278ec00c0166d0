"""Following base_link over the ground: where soles pivot, and which foot is believed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.footsteps import Footstep
from tulip_motion.ground_track import BLUNTNESS, FRICTION, GRAVITY, GroundTrack, carried, pivot
from tulip_motion.interface import Side
from tulip_motion.parameters import MotionParameters
from tulip_motion.state_estimator import Estimate, Sole

P = MotionParameters()
CELLS = [foot.cells for foot in load_robot().feet]
WEIGHT = 225.0  # [N]
EVEN = np.full(4, WEIGHT / 4.0)
FORCES = st.lists(st.floats(5.0, 200.0), min_size=4, max_size=4)


def seen(
    base: Pose2D,
    soles: Sequence[Pose2D],
    loads: tuple[float, float],
    rates: tuple[float, float] = (0.0, 0.0),
    pressed: tuple[float, float] = (0.0, 0.0),
) -> Estimate:
    """Return an estimate with base_link and soles at these places, each sole pressed at a point in its axes."""
    left, right = (Sole((sole.x, sole.y, 0.0), flat(sole)) for sole in soles)
    none, legs, dcm = np.zeros(3), np.zeros(12), (0.0, 0.0)
    position = np.array([base.x, base.y, 1.05])
    pressures = [(load, load * pressed[0], load * pressed[1]) for load in loads]
    return Estimate(
        position, np.eye(3), none, none, legs, legs, none, none, dcm, (left, right), rates, pressures, loads, 0.0
    )


def flat(sole: Pose2D) -> list[list[float]]:
    """Return the axes of a level sole, by rows."""
    (c, minus_s), (s, _) = sole.rotation().tolist()
    return [[c, minus_s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]


def turned_about(point: tuple[float, float], angle: float, pose: Pose2D) -> Pose2D:
    return Pose2D(*point, angle) @ Pose2D(-point[0], -point[1]) @ pose


def test_a_sole_that_rests_stays_at_its_centre_of_pressure() -> None:
    track, feet = GroundTrack(P, CELLS), (Pose2D(0.0, 0.14), Pose2D(0.0, -0.14))
    at_rest = seen(Pose2D(), feet, (WEIGHT, 0.0), pressed=(0.03, -0.02))
    track.begin(at_rest, (0.0, 0.0))
    track.update(at_rest, np.array([EVEN, np.zeros(4)]), (1.0, -2.0))
    assert track.pivots == [pytest.approx((0.03, -0.02)), (0.0, 0.0)]


@given(
    forces=FORCES,
    pushed=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    sense=st.sampled_from((-1.0, 1.0)),
)
def test_friction_about_the_pivot_bears_the_push_of_the_leg(
    forces: list[float], pushed: tuple[float, float], sense: float
) -> None:
    cells = np.array(CELLS[0])
    at = np.array(pivot(CELLS[0], forces, pushed, sense, iterations=400))
    if math.hypot(*at) > 0.29:
        return  # a pivot that far off is cut: the sole slides
    arms = cells - at
    ways = sense * np.column_stack([-arms[:, 1], arms[:, 0]]) / np.sqrt((arms**2).sum(1) + BLUNTNESS**2)[:, None]
    friction = FRICTION * GRAVITY * np.array(forces) / sum(forces) @ ways  # against the motion, by the sole on the leg
    np.testing.assert_allclose(friction, pushed, atol=0.02)


def test_a_sole_pivots_near_the_corner_that_carries_most() -> None:
    forces = [20.0, 5.0, 10.0, 190.0]
    at = np.array(pivot(CELLS[0], forces, (0.0, 0.0), 1.0))
    centre = np.array(forces) @ np.array(CELLS[0]) / sum(forces)
    corner = np.array(CELLS[0][3])
    assert np.linalg.norm(at - corner) < 0.5 * np.linalg.norm(centre - corner)


@pytest.mark.parametrize("push", [(0.0, 0.0), (1.5, 1.0)])
def test_a_sole_that_twists_about_its_pivot_takes_the_body_along(push: tuple[float, float]) -> None:
    """The joints alone, with the sole held to be fixed, would see the body turn about the sole's origin."""
    foot, other, body = Pose2D(0.3, 0.12, 0.4), Pose2D(0.1, -0.12), Pose2D(0.2, 0.05)
    forces, rate = np.vstack([EVEN, np.zeros(4)]), 1.0
    track = GroundTrack(P, CELLS)
    track.begin(seen(body, (foot, other), (WEIGHT, 0.0)), (body.x, body.y))
    c, s = math.cos(foot.yaw), math.sin(foot.yaw)
    for tick in range(50):
        if tick > 2:  # a sole that stands, twists, and pivots as it is pressed
            pushed = (-c * push[0] - s * push[1], s * push[0] - c * push[1])
            foot = turned_about(foot.transform(pivot(CELLS[0], EVEN.tolist(), pushed, rate)), rate * 0.004, foot)
            c, s = math.cos(foot.yaw), math.sin(foot.yaw)
        body = Pose2D(body.x + 0.001, body.y - 0.0005)
        # whatever the estimator takes for the place of base_link cancels
        believed = Pose2D(0.3, 0.12)
        away = Pose2D(believed.x - foot.x, believed.y - foot.y)
        shown = [Pose2D(at.x + away.x, at.y + away.y, at.yaw) for at in (foot, other)]
        estimate = seen(Pose2D(body.x + away.x, body.y + away.y), shown, (WEIGHT, 0.0), (rate, 0.0))
        track.update(estimate, forces, push)
    assert track.position == pytest.approx((body.x, body.y), abs=2e-4)  # 9 mm by the sole's origin; steps of 4 mrad
    assert track.signs.twist == pytest.approx(50 * 0.004)


@pytest.mark.parametrize("slides", list(Side))
def test_in_double_support_the_foot_that_carries_little_slides(slides: Side) -> None:
    left, right, body = Pose2D(0.3, 0.12), Pose2D(0.0, -0.12), Pose2D(0.2, 0.0)
    loads = (40.0, 185.0) if slides is Side.LEFT else (185.0, 40.0)
    forces = np.outer(loads, np.full(4, 0.25))
    track = GroundTrack(P, CELLS)
    track.begin(seen(body, (left, right), loads), (body.x, body.y))
    for _ in range(2):
        track.update(seen(body, (left, right), loads), forces, (0.0, 0.0))
    for tick in range(10):
        slid = Pose2D(0.001 * (tick + 1), -0.002)
        feet = (left @ slid, right) if slides is Side.LEFT else (left, right @ slid)
        track.update(seen(body, feet, loads), forces, (0.0, 0.0))
    assert track.position == pytest.approx((body.x, body.y), abs=1e-12)


def test_feet_that_carry_nothing_count_as_flight() -> None:
    feet, body = (Pose2D(0.0, 0.12), Pose2D(0.0, -0.12)), Pose2D()
    track = GroundTrack(P, CELLS)
    track.begin(seen(body, feet, (0.0, 0.0)), (1.0, 2.0))
    for _ in range(25):
        track.update(seen(body, feet, (0.0, 5.0)), np.zeros((2, 4)), (0.0, 0.0))
    assert track.signs.flight == pytest.approx(0.1)
    assert track.signs.twist == 0.0
    assert track.position == (1.0, 2.0)


def test_feet_keep_their_places_to_each_other_when_a_slip_is_taken_off() -> None:
    stance, lifted = Footstep(Side.LEFT, Pose2D(0.0, 0.12)), Footstep(Side.RIGHT, Pose2D(0.0, -0.12))
    landed = Footstep(Side.RIGHT, Pose2D(0.32, -0.13))  # shift included
    estimate = seen(Pose2D(), (Pose2D(0.0, 0.12, 0.1), Pose2D(0.3, -0.12)), (WEIGHT, 0.0))
    left, right = carried((stance, lifted), (stance, landed), (0.02, -0.01), estimate)
    assert right == landed
    assert left.pose.as_array() == pytest.approx([0.02, 0.11, 0.1])
    assert carried((stance, lifted), (stance, lifted), (0.02, -0.01), estimate) == (stance, lifted)
