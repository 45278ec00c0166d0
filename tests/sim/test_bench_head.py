"""The bench of the head: short trials, its tables and its picture."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_sim.bench import head, head_trials
from tulip_sim.bench.head_play import HeadPlay
from tulip_sim.bench.runner import Row

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(head_trials, "SHARE_DURATION", 8.0)
        shares = [head.measure("share", gaze, 3) for gaze in ("planner", "fixed glance")]
    return [
        head.measure("coverage", False),
        *shares,
        head.measure("search", 0),
        head.measure("roll", "planner", 2.0, 1),
    ]


def test_a_followed_ball_stays_known_and_the_start_error_is_absorbed(rows: list[Row]) -> None:
    planned = rows[1]
    assert planned["position RMSE [m]"] < 0.1
    assert planned["heading RMSE [deg]"] < 3.0
    assert planned["ball error, median [%]"] < 10.0
    assert planned["ball in picture [%]"] > 60.0
    assert sum(planned["pictures by deviation"]) == 32


def test_a_ball_is_found_and_a_rolling_one_stays_in_the_picture(rows: list[Row]) -> None:
    assert not math.isnan(rows[3]["found after [s]"])
    assert rows[4]["known before"]
    assert rows[4]["ball in picture [%]"] > 80.0


def test_tables_and_picture_show_what_was_measured(rows: list[Row], tmp_path: Path) -> None:
    text = "\n".join(head.summarize(rows))
    assert "| planner |" in text and "| fixed glance |" in text
    assert "found 1 of 1" in text
    head.draw(rows, tmp_path / "head.png")
    assert (tmp_path / "head.png").read_bytes().startswith(b"\x89PNG")


def test_the_same_seed_gives_the_same_play() -> None:
    def run() -> HeadPlay:
        play = HeadPlay(4, Pose2D(0.5, 0.2, 0.3), (1.5, 0.5))
        play.go(1.5, lambda now: (HeadCommand(now.stamp, HeadMode.LOOK_AT, (1.0, 0.0, 0.1)), (0.2, 0.0, 0.1)))
        return play

    a, b = run(), run()
    assert a.state is not None and b.state is not None
    assert a.state.robot.pose == b.state.robot.pose
    assert np.array_equal(a.state.robot.covariance, b.state.robot.covariance)
