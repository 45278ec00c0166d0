"""The summary of a trial and the observer that measures it."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from tulip_description.planar import Pose2D
from tulip_sim.trial import PORTION, TrialObserver, TrialSummary

SUMMARY = TrialSummary(
    mode="lockstep",
    seed=4,
    outcome="goal",
    time=34.38,
    touches=7,
    falls=0,
    distance_walked=3.21,
    localization_error=0.123,
    heading_error=2.5,
    real_time_factor=1.5,
    recording="trial/trial.mcap",
)


def test_only_a_goal_is_a_score() -> None:
    assert SUMMARY.scored
    for outcome in ("own goal", "out", "time", "fallen", "unfinished"):
        assert not replace(SUMMARY, outcome=outcome).scored


def test_summary_becomes_json_without_nan() -> None:
    unseen = replace(SUMMARY, localization_error=math.nan, heading_error=math.nan)
    again = json.loads(json.dumps(unseen.as_dict(), allow_nan=False))
    assert again == {
        "mode": "lockstep",
        "seed": 4,
        "outcome": "goal",
        "time": 34.38,
        "touches": 7,
        "falls": 0,
        "distance_walked": 3.21,
        "localization_error": None,
        "heading_error": None,
        "real_time_factor": 1.5,
        "recording": "trial/trial.mcap",
        "scored": True,
    }


def test_lines_for_people_name_outcome_and_recording() -> None:
    lines = dict(SUMMARY.lines())
    assert lines["outcome"] == "goal after 34.4 s"
    assert lines["localization error"] == "0.12 m, 2.5 deg (RMS)"
    assert lines["recording"] == "trial/trial.mcap"
    assert dict(replace(SUMMARY, recording="").lines())["recording"] == "none"


def test_distance_follows_the_way_and_ignores_sway() -> None:
    observer = TrialObserver()
    for k in range(2001):  # 4 m ahead in 2 mm, swaying by 30 mm to either side
        observer.see_truth(Pose2D(0.002 * k, 0.03 * math.sin(0.05 * k), 0.0))
    assert observer.distance == pytest.approx(4.0, rel=0.03, abs=PORTION)


def test_standing_and_swaying_is_no_way() -> None:
    observer = TrialObserver()
    for k in range(1000):
        observer.see_truth(Pose2D(1.0, 0.05 * math.sin(k), 0.1 * math.sin(k)))
    assert observer.distance == 0.0


def test_errors_are_the_rms_over_all_estimates() -> None:
    observer = TrialObserver()
    observer.see_truth(Pose2D(1.0, 2.0, 0.5))
    observer.see_estimate(Pose2D(1.3, 2.4, 0.5))  # 0.5 m
    observer.see_estimate(Pose2D(1.0, 2.0, 0.5 + math.radians(10.0)))
    assert observer.localization_error == pytest.approx(0.5 / math.sqrt(2.0))
    assert observer.heading_error == pytest.approx(10.0 / math.sqrt(2.0))


def test_headings_either_side_of_half_a_turn_are_close() -> None:
    observer = TrialObserver()
    observer.see_truth(Pose2D(0.0, 0.0, math.radians(179.0)))
    observer.see_estimate(Pose2D(0.0, 0.0, math.radians(-179.0)))
    assert observer.heading_error == pytest.approx(2.0)


def test_errors_are_unknown_before_truth_and_estimate() -> None:
    observer = TrialObserver()
    observer.see_estimate(Pose2D(1.0, 0.0, 0.0))  # the truth is not known yet
    assert math.isnan(observer.localization_error)
    assert math.isnan(observer.heading_error)
