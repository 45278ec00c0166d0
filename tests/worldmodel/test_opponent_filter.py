from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walk_simulation import CAMERA, Simulation, stand, tour

from tulip_description.planar import Pose2D
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_worldmodel.association import assign
from tulip_worldmodel.odometry_history import Increment
from tulip_worldmodel.opponent_filter import OpponentFilter, OpponentParameters
from tulip_worldmodel.sighting import Observer
from tulip_worldmodel.world_model import WorldModel, WorldModelParameters

OBSERVER = Observer(0, Pose2D(), CAMERA)


def shot(*places: tuple[float, float], bearing_only: bool = False) -> Features:
    features = []
    for x, y in places:
        azimuth = math.atan2(y - CAMERA[1], x - CAMERA[0])
        elevation = -math.atan2(CAMERA[2], math.hypot(x - CAMERA[0], y - CAMERA[1]))
        features.append(
            Feature(FeatureClass.OPPONENT, azimuth, math.nan if bearing_only else elevation, 0.01, 0.01, 0.9)
        )
    return Features(0, CAMERA, np.array([0.6, -0.6, -1.1, 0.2]), tuple(features))


def feed(opponents: OpponentFilter, picture: Features, times: int) -> None:
    for _ in range(times):
        opponents.predict(Increment(Pose2D(), 0.0, 0.0, 0.1), np.zeros(2))
        opponents.update(picture, OBSERVER, 0.1)


def test_opponent_is_confirmed_by_the_third_sighting() -> None:
    opponents = OpponentFilter(OpponentParameters())
    counts = []
    for _ in range(3):
        feed(opponents, shot((3.0, 0.5)), 1)
        counts.append(len(opponents.confirmed))
    assert counts == [0, 0, 1]


def test_opponent_that_should_be_visible_but_is_not_dies_within_4_seconds() -> None:
    opponents = OpponentFilter(OpponentParameters())
    feed(opponents, shot((3.0, 0.5)), 10)
    feed(opponents, shot(), 40)
    assert opponents.confirmed == ()


def test_opponent_outside_the_picture_is_remembered_for_10_seconds() -> None:
    opponents = OpponentFilter(OpponentParameters())
    feed(opponents, shot((3.0, 0.5)), 10)
    elsewhere = Features(0, CAMERA, np.array([2.0, 1.0, -1.1, 0.2]), ())
    feed(opponents, elsewhere, 100)
    assert len(opponents.confirmed) == 1


def test_two_opponents_keep_their_own_sightings_in_any_order() -> None:
    opponents = OpponentFilter(OpponentParameters())
    for index in range(12):
        places = [(3.0, 0.8), (2.5, -0.8)]
        feed(opponents, shot(*(places if index % 2 else reversed(places))), 1)
    found = sorted(tuple(np.round(each.point.state[:2], 1)) for each in opponents.confirmed)
    assert found == [(2.5, -0.8), (3.0, 0.8)]


def test_sightings_that_fit_one_body_are_one_opponent() -> None:
    opponents = OpponentFilter(OpponentParameters())
    feed(opponents, shot((2.0, 0.0), (2.0, 0.12)), 6)
    assert len(opponents.confirmed) == 1


def test_sighting_without_range_turns_a_known_opponent_but_bears_none() -> None:
    opponents = OpponentFilter(OpponentParameters())
    feed(opponents, shot((2.0, 0.3), bearing_only=True), 5)
    assert opponents.confirmed == ()
    feed(opponents, shot((2.0, 0.0)), 5)
    feed(opponents, shot((2.0, 0.1), bearing_only=True), 10)
    (opponent,) = opponents.confirmed
    assert opponent.point.state[1] == pytest.approx(0.1, abs=0.04)


def test_confirmed_opponent_hides_what_stands_behind_it_only() -> None:
    opponents = OpponentFilter(OpponentParameters())
    feed(opponents, shot((2.0, 0.0)), 5)
    assert opponents.hides(np.array([0.02, -0.3]), 3.0, OBSERVER, shot())
    assert not opponents.hides(np.array([0.02, -0.3]), 1.5, OBSERVER, shot())
    assert not opponents.hides(np.array([0.5, -0.3]), 3.0, OBSERVER, shot())


def test_opponent_whose_feet_are_below_the_picture_hides_what_is_behind_it_though_its_range_is_unknown() -> None:
    opponents = OpponentFilter(OpponentParameters())
    near = shot((0.5, 0.0), bearing_only=True)  # the picture's lower edge shows the ground 0.6 m ahead
    assert opponents.hides(np.array([0.1, -0.4]), 2.5, OBSERVER, near)
    assert not opponents.hides(np.array([0.1, -0.4]), 0.4, OBSERVER, near)
    assert not opponents.hides(np.array([0.8, -0.4]), 2.5, OBSERVER, near)


def test_walking_robot_knows_a_standing_keeper_within_30_cm_in_map() -> None:
    keeper = np.array([4.2, 0.3])
    simulation = Simulation(tour, 12.0, Pose2D(-0.5, 0.0, 0.0), np.random.default_rng(4), opponent=lambda time: keeper)
    world = WorldModel(WorldModelParameters(), simulation.arena, simulation.start)
    errors = []
    for moment in simulation.run():
        world.add_odometry(moment.odometry)
        if moment.features is not None:
            world.add_features(moment.features)
        opponents = world.state(moment.stamp).opponents
        if moment.stamp > 4e9 and opponents:
            assert len(opponents) == 1
            errors.append(np.linalg.norm(opponents[0].position_in_map - keeper))
    assert len(errors) > 250
    assert np.sqrt(np.mean(np.square(errors))) < 0.3


def test_walking_opponent_is_followed_with_its_velocity() -> None:
    simulation = Simulation(
        stand,
        6.0,
        Pose2D(),
        np.random.default_rng(2),
        opponent=lambda time: np.array([3.0, -1.0 + 0.35 * time]),
        head_pan=lambda time: 0.0,
    )
    world = WorldModel(WorldModelParameters(), simulation.arena, simulation.start)
    velocities = []
    for moment in simulation.run():
        world.add_odometry(moment.odometry)
        if moment.features is not None:
            world.add_features(moment.features)
        opponents = world.state(moment.stamp).opponents
        if moment.stamp > 3.5e9:
            assert abs(opponents[0].position_in_map[1] - simulation.opponent((moment.stamp - 10**9) * 1e-9)[1]) < 0.3
            velocities.append(opponents[0].velocity[1])
    assert 0.15 < np.mean(velocities) < 0.45


def test_assignment_minimises_the_sum_of_distances_and_obeys_the_gates() -> None:
    limits = np.full(2, 10.0)
    assert assign(np.array([[1.0, 2.0], [1.1, 9.0]]), limits) == [(0, 1), (1, 0)]
    assert assign(np.array([[1.0, 20.0], [30.0, 40.0]]), limits) == [(0, 0)]
    assert assign(np.array([[20.0, 5.0]]), np.array([10.0, 4.0])) == []
    assert assign(np.zeros((0, 3)), np.full(3, 1.0)) == []


@given(
    st.integers(1, 5).flatmap(
        lambda rows: st.lists(st.lists(st.floats(0.0, 30.0), min_size=3, max_size=3), min_size=rows, max_size=rows)
    )
)
def test_assignment_uses_every_object_and_sighting_once_at_most(distances) -> None:
    pairs = assign(np.array(distances), np.full(3, 9.0))
    assert len({row for row, _ in pairs}) == len(pairs)
    assert len({column for _, column in pairs}) == len(pairs)
    assert all(distances[row][column] <= 9.0 for row, column in pairs)


places = st.lists(st.tuples(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0)), max_size=6)


@settings(max_examples=50)
@given(pictures=st.lists(places, min_size=1, max_size=10))
def test_number_stays_bounded_and_covariances_positive_semidefinite_whatever_is_seen(pictures) -> None:
    opponents = OpponentFilter(OpponentParameters())
    for picture in pictures:
        feed(opponents, shot(*picture), 2)
        assert len(opponents.confirmed) <= OpponentParameters().most
        for opponent in opponents.confirmed:
            covariance = opponent.point.covariance
            assert np.array_equal(covariance, covariance.T)
            assert np.linalg.eigvalsh(covariance).min() >= -1e-12
