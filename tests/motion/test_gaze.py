from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.gaze import GazeParameters, GazePlanner
from tulip_motion.gaze_landmarks import Landmarks, Sight, ball_after_look, landmark_angles, pose_after_look
from tulip_motion.head_geometry import HeadGeometry
from tulip_motion.interface import GazeInput

FIELD, ROBOT, PARAMETERS = load_field(), load_robot(), GazeParameters()
GEOMETRY = HeadGeometry(ROBOT, PARAMETERS.gaze_limit_margin)
EYE = GEOMETRY.eye
SIGHT = Sight(
    half_width=0.56,
    half_height=0.43,
    azimuth_spread=0.007,
    elevation_spread=0.007,
    common_azimuth_spread=0.007,
    tilt_spread=0.01,
    landmark_spread=0.03,
    found=0.8,
)
LANDMARKS = Landmarks(FIELD, 8.0, 7.0, 5.0, 3.5)
PERIOD = 20_000_000  # [ns]
START = Pose2D(1.0, 0.5, 0.0)
SURE, UNSURE = (0.01, 0.005), (0.3, 0.15)  # [m], [rad]
OUTWARDS = Pose2D(2.25, 1.6, math.pi / 2.0)  # at the side line, where a ball ahead has no landmark beside it


def known(
    position: float = 0.05,
    heading: float = 0.03,
    ball: tuple[float, float] = (1.0, 0.2),
    ball_spread: float = 0.02,
    age: float = 0.0,
    pose: Pose2D = START,
    stamp: int = 10**9,
) -> GazeInput:
    return GazeInput(
        stamp,
        pose,
        np.diag([position**2, position**2, heading**2]),
        np.array(ball),
        np.zeros(2),
        np.diag([ball_spread**2, ball_spread**2, 0.01, 0.01]),
        age,
    )


def watch(planner: GazePlanner, seconds: float, **what: object) -> list[tuple[float, float, float] | None]:
    """Plan at 50 Hz with a world model that stays as unsure as it is."""
    return [
        planner.plan(known(stamp=10**9 + tick * PERIOD, **what))  # type: ignore[arg-type]
        for tick in range(round(seconds * 50))
    ]


def away(points: list[tuple[float, float, float] | None], ball: tuple[float, float]) -> float:
    """Return the share of the plans whose gaze leaves the ball by more than a quarter of a picture."""
    on_ball = GEOMETRY.angles_towards((*ball, FIELD.ball_radius))
    far = [
        point is not None and float(np.abs(GEOMETRY.angles_towards(point) - on_ball).max()) > 0.4 for point in points
    ]
    return sum(far) / len(far)


def test_derivatives_of_the_landmarks_angles_are_those_of_finite_differences() -> None:
    pose = np.array([0.4, -0.7, 0.8, 0.0, 0.0, 0.0])
    _, jacobian = landmark_angles(pose, LANDMARKS.places, EYE)
    for column in range(6):
        step = np.zeros(6)
        step[column] = 1e-6
        after, _ = landmark_angles(pose + step, LANDMARKS.places, EYE)
        before, _ = landmark_angles(pose - step, LANDMARKS.places, EYE)
        assert np.allclose((after - before) / 2e-6, jacobian[:, :, column], atol=1e-5), column


@settings(max_examples=30)
@given(
    x=st.floats(-4.0, 4.0),
    y=st.floats(-2.5, 2.5),
    yaw=st.floats(-3.0, 3.0),
    pan=st.floats(-2.0, 2.0),
    tilt=st.floats(0.0, 1.0),
    spread=st.floats(0.01, 0.5),
)
def test_a_look_never_makes_the_pose_less_sure(
    x: float, y: float, yaw: float, pan: float, tilt: float, spread: float
) -> None:
    before = np.diag([spread**2, (2.0 * spread) ** 2, spread**2])
    after = pose_after_look(Pose2D(x, y, yaw), before, np.array([[pan, tilt]]), LANDMARKS, EYE, SIGHT)[0]
    assert np.linalg.eigvalsh(before - after)[0] > -1e-9
    assert np.linalg.eigvalsh(after)[0] > 0.0


def test_a_look_where_no_landmark_is_tells_nothing() -> None:
    before = np.diag([0.01, 0.01, 0.01])
    at_side_line = Pose2D(1.5, 2.9, math.pi / 2.0)
    outwards, inwards = pose_after_look(
        at_side_line,
        before,
        np.array([[0.0, 0.3], [2.0, 0.3]]),
        Landmarks(FIELD.without_poles(), 8, 7, 5, 3.5),
        EYE,
        SIGHT,
    )
    assert np.trace(outwards) > 0.98 * np.trace(before)
    assert np.trace(inwards) < 0.9 * np.trace(before)


def test_common_errors_bound_what_many_landmarks_tell_about_the_heading() -> None:
    many = Landmarks(FIELD, 8.0, 7.0, 5.0, 3.5)
    many.places, many.reaches = np.repeat(many.places, 500, axis=0), np.repeat(many.reaches, 500)
    sure_place = np.diag([1e-8, 1e-8, 0.04])
    after = pose_after_look(Pose2D(), sure_place, np.array([[0.0, 0.3]]), many, EYE, SIGHT)[0]
    assert math.sqrt(after[2, 2]) == pytest.approx(SIGHT.common_azimuth_spread, rel=0.05)


def test_a_ball_in_the_picture_becomes_surer_and_one_outside_does_not() -> None:
    before = 0.04 * np.eye(2)
    gazes = np.array([GEOMETRY.angles_towards((1.5, 0.0, 0.1)), (1.5, 0.3)])
    ball = np.array([[1.5, 0.0], [1.5, 0.0]])
    on, off = ball_after_look(ball, before, gazes, FIELD.ball_radius, EYE, SIGHT, 8.0)
    assert np.trace(on) < 0.35 * np.trace(before)
    assert np.trace(off) > 0.97 * np.trace(before)


def test_a_vague_ball_is_worth_less_than_one_whose_place_is_known_well_enough_to_be_in_the_picture() -> None:
    gaze = GEOMETRY.angles_towards((1.5, 0.0, 0.1))[None]
    ball = np.array([[1.5, 0.0]])
    left = [
        np.trace(ball_after_look(ball, spread**2 * np.eye(2), gaze, 0.1, EYE, SIGHT, 8.0)[0]) / (2.0 * spread**2)
        for spread in (0.2, 1.0, 3.0)
    ]
    assert left[0] < left[1] < left[2]


def test_a_robot_sure_of_its_place_watches_the_ball() -> None:
    points = watch(GazePlanner(PARAMETERS, FIELD, ROBOT), 4.0, position=0.02, heading=0.01)
    assert away(points, (1.0, 0.2)) == 0.0


def test_the_less_sure_the_place_the_more_willingly_the_gaze_leaves_a_ball_without_landmarks() -> None:
    shares = []
    for spread in (0.01, 0.12, 0.3):
        planner = GazePlanner(PARAMETERS, FIELD.without_poles(), ROBOT)
        points, age = [], 0.0
        for tick in range(300):
            what = known(spread, 0.5 * spread, age=age, pose=OUTWARDS, stamp=10**9 + tick * PERIOD)
            points.append(planner.plan(what))
            age = 0.0 if away(points[-1:], (1.0, 0.2)) == 0.0 else age + 0.02
        shares.append(away(points, (1.0, 0.2)))
    assert shares[0] == 0.0
    assert 0.0 < shares[1] <= shares[2], shares


def test_a_ball_not_seen_for_long_draws_the_gaze_back() -> None:
    planner = GazePlanner(PARAMETERS, FIELD, ROBOT)
    gazes = planner.gazes(known()).angles
    head = gazes[np.argmin(np.abs(gazes - (-1.5, 0.45)).sum(axis=1))]
    worth = [planner.values(known(age=age), gazes, head)[0] for age in (0.0, 0.5, 1.0)]
    assert worth[0][0] < worth[1][0] < worth[2][0]  # the first gaze is the ball
    far = int(np.argmin(np.abs(gazes - head).sum(axis=1)))
    assert worth[0][far] == pytest.approx(worth[2][far], rel=0.05)


def test_a_ball_at_the_feet_keeps_most_of_the_time() -> None:
    ball, age, variance = (0.4, 0.1), 0.0, 0.1**2
    planner = GazePlanner(PARAMETERS, FIELD, ROBOT)
    points = []
    for tick in range(500):
        spread = math.sqrt(variance)
        points.append(planner.plan(known(spread, 0.5 * spread, ball, 0.01, age, stamp=10**9 + tick * PERIOD)))
        looks_away = away(points[-1:], ball) > 0.0
        age = age + 0.02 if looks_away else 0.0
        # As in play: landmarks make the pose sure, walking makes it less sure again.
        variance = 0.03**2 if age > 0.5 else variance + 0.05**2 * 0.02
    assert 0.0 < away(points, ball) < 0.5


def test_a_rolling_ball_is_never_looked_past() -> None:
    planner = GazePlanner(PARAMETERS, FIELD, ROBOT)
    for tick in range(100):
        still = known(ball=(1.5, 0.8), stamp=10**9 + tick * PERIOD)
        assert planner.plan(replace(still, ball_velocity=np.array([0.0, -2.0]))) is None


def test_a_look_at_landmarks_is_held_until_the_head_has_been_there_and_then_given_up() -> None:
    planner = GazePlanner(PARAMETERS, FIELD.without_poles(), ROBOT)
    first = planner.plan(known(*UNSURE, pose=OUTWARDS))
    assert first is not None
    elsewhere, held = known(*SURE, ball=(0.5, 1.5), age=1.0, pose=OUTWARDS), 1
    while held < 200 and planner.plan(replace(elsewhere, stamp=10**9 + held * PERIOD)) == first:
        held += 1
    assert 2.0 * PARAMETERS.gaze_look <= held * PERIOD * 1e-9 < 1.5  # the way there, and the look


def test_after_a_pause_the_plan_begins_anew() -> None:
    first, second = GazePlanner(PARAMETERS, FIELD, ROBOT), GazePlanner(PARAMETERS, FIELD, ROBOT)
    watch(first, 1.0, position=0.3, heading=0.3)
    later = known(0.02, 0.01, stamp=10**11)
    assert first.plan(later) == second.plan(later)


def test_the_same_world_is_looked_at_in_the_same_way() -> None:
    a, b = (watch(GazePlanner(PARAMETERS, FIELD, ROBOT), 2.0, position=0.2, heading=0.1) for _ in range(2))
    assert a == b


@pytest.mark.parametrize("wrong", [{"gaze_found": 1.2}, {"gaze_look": 0.0}, {"gaze_farthest_tilt": 0.9}])
def test_parameters_out_of_range_are_refused_by_name(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        GazeParameters(**wrong)  # type: ignore[arg-type]
