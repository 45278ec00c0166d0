"""The bench of localization: one kidnapping for real, and what it makes of rows."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.stats import chi2

from tulip_sim.bench.localization import BENCH, BOUND, bounds, draw, kidnap, settings_of, summarize
from tulip_sim.bench.runner import Row


def walk_row(seed: int, error: float, nees: float) -> Row:
    path = [[0.02 * second, 0.0, 0.0] for second in range(120)]
    return {
        "kind": "walk",
        "seed": seed,
        "perception": "vision",
        "poles": seed % 2 == 0,
        "upright": True,
        "distance [m]": 20.0,
        "start error [m]": 0.4,
        "start error [deg]": 10.0,
        "absorbed after [s]": 2.0,
        "RMSE [m]": error,
        "RMSE [deg]": 0.5,
        "NEES": [nees] * 120,
        "true x, y [m], yaw [rad]": path,
        "believed x, y [m], yaw [rad]": path,
        "covariance xx, xy, yy [m^2]": [[1e-4, 2e-5, 5e-5]] * 120,
    }


def kidnapping_row(seed: int, found: float | None, mirrored: bool = False) -> Row:
    return {
        "kind": "kidnapping",
        "seed": seed,
        "perception": "vision",
        "poles": seed % 2 == 0,
        "upright": True,
        "noticed after [s]": 0.5,
        "found after [s]": found,
        "mirrored": mirrored,
    }


ROWS = [
    *(walk_row(seed, 0.03 if seed else 0.05, 2.0 if seed else 20.0) for seed in range(4)),
    *(kidnapping_row(seed, 1.0 + seed) for seed in range(3)),
    kidnapping_row(3, None, mirrored=True),
]


def test_bench_has_twenty_walks_and_a_hundred_kidnappings_with_real_vision() -> None:
    assert [trial[0] for trial in BENCH.trials] == ["walk"] * 20 + ["kidnap"] * 100
    assert all(len(trial) == 2 for trial in BENCH.trials)
    assert settings_of("vision", 0).perception is None
    with pytest.raises(ValueError, match="perception is 'eyes'"):
        settings_of("eyes", 0)


def test_summary_gives_rmse_share_inside_the_bound_and_what_became_of_the_kidnapped() -> None:
    text = "\n".join(summarize(ROWS))
    assert f"{math.sqrt((0.05**2 + 3 * 0.03**2) / 4):.4f} m" in text
    assert "75.0 % of 440 looks" in text
    assert "found within 10 s 3 of 4" in text
    assert "mirrored 1" in text
    assert "no result" not in text


def test_summary_of_a_quick_look_says_that_it_is_no_result() -> None:
    assert "no result" in "\n".join(summarize([{**row, "perception": "quick"} for row in ROWS]))


def test_bounds_are_those_of_chi_square_of_three_values() -> None:
    assert chi2.cdf(BOUND, df=3) == pytest.approx(0.95)
    low, high = bounds(20)
    assert low < 3.0 < high
    values = np.random.default_rng(0).chisquare(3, (4000, 20)).mean(axis=1)
    assert np.mean((values > low) & (values < high)) == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize("rows", [ROWS, ROWS[:4], ROWS[4:]], ids=["all", "walks", "kidnappings"])
def test_picture_is_drawn_from_any_rows(rows: list[Row], tmp_path: Path) -> None:
    draw(rows, tmp_path / "localization.png")
    picture = cv2.imread(str(tmp_path / "localization.png"))
    assert picture is not None
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10


@pytest.mark.sim
@pytest.mark.slow
def test_kidnapped_robot_is_found_and_not_mirrored_with_features_from_the_truth() -> None:
    row = kidnap(1, "quick")  # without poles
    assert row["knew its place before"]
    assert row["upright"]
    assert row["found after [s]"] is not None
    assert not row["mirrored"]
    assert row["error at the end [m]"] < 0.1
