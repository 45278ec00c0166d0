from __future__ import annotations

import math

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.lost import LostDetector
from tulip_worldmodel.odometry_history import PathPoint, increment

P = LocalizationParameters()


def test_explained_features_are_no_evidence() -> None:
    detector = LostDetector(P)
    for _ in range(100):
        detector.add(3, 0)
    assert detector.evidence == 0.0
    assert not detector.lost


def test_one_picture_however_strange_is_not_enough() -> None:
    detector = LostDetector(P)
    detector.add(0, 50)
    assert detector.evidence == P.most_evidence
    assert not detector.lost


def test_pictures_that_nothing_explains_are_enough_after_as_many_as_the_evidence_asks_for() -> None:
    detector, pictures = LostDetector(P), 0
    while not detector.lost:
        detector.add(0, 3)
        pictures += 1
    assert pictures == math.ceil(P.lost_evidence / P.most_evidence)


def test_evidence_goes_away_when_features_are_explained_again() -> None:
    detector, pictures = LostDetector(P), 0
    for _ in range(1000):
        detector.add(0, 3)
    while detector.lost:
        detector.add(3, 0)
        pictures += 1
    assert pictures <= math.ceil(P.lost_evidence / P.most_evidence)


def test_a_share_of_false_features_as_expected_raises_no_alarm_in_ten_minutes() -> None:
    rng = np.random.default_rng(0)
    detector = LostDetector(P)
    for _ in range(9000):
        explained = int(rng.binomial(4, P.explained_rate))
        detector.add(explained, 4 - explained)
        assert not detector.lost


def test_false_findings_on_bare_carpet_raise_no_alarm_in_ten_minutes() -> None:
    rng = np.random.default_rng(0)
    detector = LostDetector(P)
    for _ in range(9000):
        detector.add(0, int(rng.poisson(0.1)))  # a few times as often as vision does
        assert not detector.lost


def test_chance_matches_only_are_noticed_within_3_seconds() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        detector = LostDetector(P)
        pictures = 0
        while not detector.lost:
            explained = int(rng.binomial(3, P.chance_rate))
            detector.add(explained, 3 - explained)
            pictures += 1
        assert pictures <= 45


def test_odometrys_own_covariance_adds_up_over_increments_whatever_the_heading() -> None:
    """Q of a way is what is left when the heading's error, carried along the way, is taken off."""
    yaw_variance, slip = 0.01, np.diag([0.02, 0.005])
    first = PathPoint(0, Pose2D(1.0, 2.0, 0.7), covariance=np.diag([0.0, 0.0, yaw_variance]))
    carried = np.eye(3)
    carried[:2, 2] = -0.5, 1.5
    after = carried @ np.diag([0.0, 0.0, yaw_variance]) @ carried.T
    turn = Pose2D(0.0, 0.0, 0.7).rotation()
    after[:2, :2] += turn @ slip @ turn.T
    second = PathPoint(10**9, Pose2D(2.5, 2.5, 0.9), covariance=after)
    moved = increment(first, second)
    assert moved.slip == pytest.approx(slip, abs=1e-12)
    assert increment(PathPoint(0, Pose2D()), second).slip is None
