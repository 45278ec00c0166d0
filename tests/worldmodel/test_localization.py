from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walk_simulation import CAMERA, ROUGH_WORLD, Errors, Simulation, stand, tour

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import load_robot
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_vision.lens import head_camera_lens
from tulip_vision.view import SpreadParameters, View
from tulip_worldmodel.camera_error import LEAST_SPREAD, CameraErrorParameters, own_spread
from tulip_worldmodel.localization import Localization
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.odometry_history import Increment
from tulip_worldmodel.world_model import WorldModel

START = Pose2D(-1.5, 0.3, 0.2)
FIELD = load_field()


def errors_of(simulation: Simulation, guess: Pose2D) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, 3) pose errors and (n,) their normalised squares, one row a tick."""
    world = WorldModel(ROUGH_WORLD, FIELD, guess)
    errors, normalised = [], []
    for moment in simulation.run():
        world.add_odometry(moment.odometry)
        if moment.features is not None:
            world.add_features(moment.features)
        robot = world.state(moment.stamp).robot
        error = np.array(
            [
                robot.pose.x - moment.pose.x,
                robot.pose.y - moment.pose.y,
                wrap_angle(robot.pose.yaw - moment.pose.yaw),
            ]
        )
        errors.append(error)
        normalised.append(error @ np.linalg.solve(robot.covariance, error))
    return np.array(errors), np.array(normalised)


@pytest.mark.parametrize("seed", range(3))
def test_walk_of_a_minute_stays_within_15_cm_and_4_degrees(seed: int) -> None:
    rng = np.random.default_rng(seed)
    guess = Pose2D(START.x + 0.2, START.y - 0.2, START.yaw + math.radians(10.0))
    errors, normalised = errors_of(Simulation(tour, 60.0, START, rng), guess)
    position = np.sqrt(np.mean(errors[:, 0] ** 2 + errors[:, 1] ** 2))
    heading = np.sqrt(np.mean(errors[:, 2] ** 2))
    assert position <= 0.15
    assert heading <= math.radians(4.0)
    assert 0.2 < np.mean(normalised) < 6.0  # 3 for an ideal filter: neither much too sure nor far too careful


def test_dead_reckoning_alone_misses_these_bounds_on_the_same_walk() -> None:
    errors, _ = errors_of(Simulation(tour, 60.0, START, np.random.default_rng(0), Errors(vision=False)), START)
    assert np.sqrt(np.mean(errors[:, 0] ** 2 + errors[:, 1] ** 2)) > 0.3
    assert abs(errors[-1, 2]) > math.radians(20.0)


def test_walk_with_half_of_the_features_missed_and_twice_the_noise_stays_within_15_cm_and_4_degrees() -> None:
    bad = Errors(
        miss=0.5, angle_spread=math.radians(0.8), tilt_spread=math.radians(1.0), azimuth_bias=math.radians(0.5)
    )
    errors, _ = errors_of(Simulation(tour, 40.0, START, np.random.default_rng(5), bad), START)
    assert np.sqrt(np.mean(errors[:, 0] ** 2 + errors[:, 1] ** 2)) <= 0.15
    assert np.sqrt(np.mean(errors[:, 2] ** 2)) <= math.radians(4.0)


def test_walk_on_a_field_without_poles_stays_within_15_cm_and_4_degrees() -> None:
    simulation = Simulation(tour, 40.0, START, np.random.default_rng(6), arena=FIELD.without_poles())
    errors, _ = errors_of(simulation, START)
    assert np.sqrt(np.mean(errors[:, 0] ** 2 + errors[:, 1] ** 2)) <= 0.15
    assert np.sqrt(np.mean(errors[:, 2] ** 2)) <= math.radians(4.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_start_error_of_30_cm_and_10_degrees_is_absorbed_within_3_seconds_of_looking_round(sign: float) -> None:
    guess = Pose2D(START.x + 0.21 * sign, START.y - 0.21, START.yaw + sign * math.radians(10.0))
    errors, _ = errors_of(Simulation(stand, 4.0, START, np.random.default_rng(1)), guess)
    assert np.hypot(errors[150:, 0], errors[150:, 1]).max() < 0.12
    assert np.abs(errors[150:, 2]).max() < math.radians(2.0)


def walk(localization: Localization, ticks_per_second: int, seconds: int, forward: float, turn: float) -> np.ndarray:
    """Predict a walk at constant velocity and return the covariance."""
    dt = 1.0 / ticks_per_second
    for _ in range(ticks_per_second * seconds):
        localization.predict(Increment(Pose2D(forward * dt, 0.0, turn * dt), forward * dt, turn * dt, dt))
    return localization.covariance


@pytest.mark.parametrize(("forward", "turn"), [(0.3, 0.0), (0.0, 0.4), (0.0, 0.0)])
def test_uncertainty_grows_while_nothing_is_seen(forward: float, turn: float) -> None:
    localization = Localization(LocalizationParameters(), FIELD, START)
    spreads = [np.sqrt(np.diag(walk(localization, 50, 5, forward, turn))) for _ in range(4)]
    assert all(np.all(later > earlier) for earlier, later in pairwise(spreads))


def test_growth_of_uncertainty_does_not_depend_on_the_tick_rate() -> None:
    slow = walk(Localization(LocalizationParameters(), FIELD, START), 25, 10, 0.3, 0.2)
    fast = walk(Localization(LocalizationParameters(), FIELD, START), 250, 10, 0.3, 0.2)
    assert np.allclose(np.diag(slow), np.diag(fast), rtol=0.05)


def test_prediction_without_change_agrees_with_the_filter() -> None:
    localization = Localization(LocalizationParameters(), FIELD, START)
    moved = Increment(Pose2D(0.4, 0.1, 0.3), 0.42, 0.3, 1.0)
    pose, covariance = localization.predicted(moved)
    localization.predict(moved)
    assert pose == localization.pose
    assert np.allclose(covariance, localization.covariance)


def picture(*features: Feature) -> Features:
    return Features(10**9, CAMERA, np.array([2.0, -2.0, -1.2, 0.3]), features)


def seen_from(pose: Pose2D, kind: FeatureClass, place: tuple[float, float]) -> Feature:
    x, y = pose.inverse().transform(place)
    azimuth = math.atan2(y - CAMERA[1], x - CAMERA[0])
    elevation = -math.atan2(CAMERA[2], math.hypot(x - CAMERA[0], y - CAMERA[1]))
    return Feature(kind, azimuth, elevation, 0.007, 0.007, 0.9)


def test_false_crossing_far_from_every_landmark_changes_nothing() -> None:
    localization = Localization(replace(LocalizationParameters(), start_position_spread=0.05), FIELD, START)
    before, spread = localization.pose, localization.covariance
    place = START.transform((1.6, 0.3))
    rejected = localization.update(picture(seen_from(START, FeatureClass.CROSSING_L, place)), 0.1)
    assert [entry.reason for entry in rejected] == ["no landmark inside the gate"]
    assert localization.pose == before
    assert np.array_equal(localization.covariance, spread)


def test_post_that_may_be_either_of_two_is_rejected_as_ambiguous() -> None:
    parameters = LocalizationParameters(start_heading_spread=math.radians(30.0), start_position_spread=0.6)
    localization = Localization(parameters, FIELD, Pose2D(1.0, 0.0, 0.0))
    middle = Feature(FeatureClass.GOAL_POST, 0.02, math.nan, 0.007, 0.007, 0.9)
    rejected = localization.update(picture(middle), 0.1)
    assert len(rejected) == 1
    assert "ambiguous" in rejected[0].reason


def test_two_posts_together_resolve_what_each_alone_leaves_open() -> None:
    truth = Pose2D(1.0, 0.0, 0.0)
    parameters = LocalizationParameters(start_heading_spread=math.radians(20.0), start_position_spread=0.3)
    localization = Localization(parameters, FIELD, Pose2D(1.0, 0.0, math.radians(15.0)))
    posts = [seen_from(truth, FeatureClass.GOAL_POST, (post.x, post.y)) for post in FIELD.opponent_goal.posts]
    assert localization.update(picture(*posts), 0.1) == ()
    assert abs(localization.pose.yaw) < math.radians(4.0)


def test_one_landmark_is_not_used_for_two_features_of_a_picture() -> None:
    localization = Localization(LocalizationParameters(), FIELD, START)
    mark = seen_from(START, FeatureClass.PENALTY_MARK, FIELD.penalty_marks[1])
    twin = replace(mark, azimuth=mark.azimuth + 0.002)
    rejected = localization.update(picture(mark, twin), 0.1)
    assert len(rejected) >= 1


def test_features_beyond_the_horizon_or_too_far_are_rejected_with_the_reason() -> None:
    localization = Localization(LocalizationParameters(), FIELD, START)
    high = Feature(FeatureClass.CROSSING_T, 0.0, 0.1, 0.007, 0.007, 0.9)
    line = Feature(FeatureClass.LINE, 0.0, -0.4, 0.007, 0.007, 0.9, end_azimuth=0.3, end_elevation=0.05)
    short = Feature(FeatureClass.LINE, 0.0, -0.6, 0.007, 0.007, 0.9, end_azimuth=0.1, end_elevation=-0.6)
    reasons = [entry.reason for entry in localization.update(picture(high, line, short), 0.1)]
    assert reasons == ["too far away", "an end of the line is not below the horizon", "the piece of line is too short"]


kinds = st.sampled_from([kind for kind in FeatureClass if kind not in (FeatureClass.BALL, FeatureClass.OPPONENT)])
angles = st.floats(-3.1, 3.1)
elevations = st.one_of(st.floats(-1.4, 0.5), st.just(math.nan))
anything = st.builds(
    Feature,
    kinds,
    angles,
    elevations,
    st.floats(0.001, 0.1),
    st.floats(0.001, 0.1),
    st.floats(0.0, 1.0),
    angles,
    elevations,
)
moves = st.builds(
    Increment,
    st.builds(Pose2D, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-1.0, 1.0)),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 2.0),
)


@settings(max_examples=60)
@given(steps=st.lists(st.tuples(moves, st.lists(anything, max_size=6)), min_size=1, max_size=6))
def test_covariance_stays_symmetric_and_positive_semidefinite_whatever_is_seen(steps) -> None:
    localization = Localization(LocalizationParameters(), FIELD, START)
    for moved, features in steps:
        localization.predict(moved)
        localization.update(picture(*features), moved.duration)
        covariance = localization.covariance
        assert np.array_equal(covariance, covariance.T)
        assert np.linalg.eigvalsh(covariance).min() >= -1e-12
        assert np.all(np.isfinite(localization.pose.as_array()))
        assert -math.pi <= localization.pose.yaw < math.pi


@pytest.mark.parametrize("wrong", [{"drift_time": 0.0}, {"gate_probability": 1.0}, {"association_odds": 0.5}])
def test_parameters_out_of_range_are_refused_by_name(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        LocalizationParameters(**wrong)


def test_camera_pose_spread_is_visions_and_counted_once() -> None:
    """Taken out of what vision claims, it leaves a feature nothing of its own if there was nothing else."""
    spread = SpreadParameters(pixel=0.0)
    camera = CameraErrorParameters()
    assert (camera.pose_azimuth_spread, camera.pose_elevation_spread) == (spread.pose_azimuth, spread.pose_elevation)
    view = View(head_camera_lens(), camera_in_footprint(load_robot(), 0.9, (0.0, 0.0, 0.0, 1.0), 0.3, 0.4), spread)
    ray = np.array([0.8, 0.2, -0.5]) / np.linalg.norm([0.8, 0.2, -0.5])
    azimuth_spread, elevation_spread = view.spreads(ray)
    azimuth, elevation = math.atan2(ray[1], ray[0]), math.asin(ray[2])
    kind = FeatureClass.PENALTY_MARK
    whole = Feature(kind, azimuth, elevation, azimuth_spread, elevation_spread, 0.9)
    own = own_spread(whole, camera)
    assert (own.azimuth_spread, own.elevation_spread) == (LEAST_SPREAD, LEAST_SPREAD)
    noisy = replace(whole, azimuth_spread=math.hypot(azimuth_spread, 0.01), elevation_spread=0.02)
    own = own_spread(noisy, camera)
    assert own.azimuth_spread == pytest.approx(0.01)
    assert own.elevation_spread == pytest.approx(math.sqrt(0.02**2 - spread.pose_elevation**2))
