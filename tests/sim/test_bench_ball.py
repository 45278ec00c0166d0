"""The bench of ball and opponents: short trials, its tables and its picture."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tulip_sim.bench import ball, ball_trials, opponent_trials
from tulip_sim.bench.ball_trials import _longest_gap
from tulip_sim.bench.runner import Row

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ball_trials, "WATCHED", 1.0)
        patch.setattr(opponent_trials, "DURATION", 5.0)
        patch.setattr(opponent_trials, "GONE", 4.0)
        return [
            ball.measure("standing", 3.0, False, 0),
            ball.measure("rolling", 1.0, False, 0),
            ball.measure("hidden", True, False, 1),
            ball.measure("opponents", 2, True, False, 1),
        ]


def test_resting_ball_is_known_within_5_percent_of_its_range(rows: list[Row]) -> None:
    assert rows[0]["known [%]"] == 100.0
    assert np.sqrt(np.mean(np.square(rows[0]["error [%]"]))) < 5.0


def test_velocity_of_a_kicked_ball_is_known_within_15_cm_per_second_after_half_a_second(rows: list[Row]) -> None:
    errors = rows[1]["velocity error [m/s]"]
    assert len(errors) > 2
    assert np.sqrt(np.mean(np.square(errors))) < 0.15


def test_ball_that_rolls_behind_an_opponent_is_hidden_and_kept(rows: list[Row]) -> None:
    assert rows[2]["hidden [s]"] > 0.5
    assert rows[2]["kept"]


def test_two_opponents_are_confirmed_and_no_third(rows: list[Row]) -> None:
    assert rows[3]["in view"] == rows[3]["confirmed"] == 2
    assert rows[3]["false track [s]"] < 1.0


def test_tables_and_picture_show_what_was_measured(rows: list[Row], tmp_path: Path) -> None:
    text = "\n".join(ball.summarize(rows))
    assert "Resting ball" in text and "1 of 1 were in view" in text and "kept 1 of 1" in text
    assert "| walk | stands | 2 of 2 |" in text
    ball.draw(rows, tmp_path / "ball.png")
    picture = cv2.imread(str(tmp_path / "ball.png"))
    assert picture is not None
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10


def test_longest_gap_is_the_longest_run_without_the_ball() -> None:
    assert _longest_gap([True, False, True, False, False, True]) == (3, 4)
    assert _longest_gap([True, True]) == (0, -1)
    assert _longest_gap([True, False, False]) == (1, 2)
