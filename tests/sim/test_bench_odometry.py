"""The odometry bench: one short walk, its summary and its picture."""

from __future__ import annotations

from pathlib import Path

import pytest

from tulip_sim.bench import odometry
from tulip_sim.bench.runner import Row

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def row() -> Row:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(odometry, "DURATION", 5.0)
        return odometry.measure(7)


def test_a_walk_has_a_look_at_every_period(row: Row) -> None:
    assert row["upright"]
    assert len(row["NEES"]) == len(row["errors x, y [m], yaw [rad]"]) == 2
    assert row["position error [m]"] < 0.05


def test_summary_and_picture_leave_out_the_fallen(row: Row, tmp_path: Path) -> None:
    fallen = {**row, "upright": False, "NEES": [], "errors x, y [m], yaw [rad]": [], "drift [%]": 9.0}
    text = "\n".join(odometry.summarize([row, fallen]))
    assert "upright: 1 of 2" in text
    assert "most 9.00 %" in text
    assert "of 2 times inside the 95 % bounds 0.22 to 9.35" in text  # chi-square of 3 degrees of freedom
    assert "NEES" not in "\n".join(odometry.summarize([fallen]))
    odometry.draw([row, fallen], tmp_path / "odometry.png")
    assert (tmp_path / "odometry.png").read_bytes().startswith(b"\x89PNG")
    odometry.draw([fallen], tmp_path / "none.png")
    assert not (tmp_path / "none.png").exists()
