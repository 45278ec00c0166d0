"""Bench clik: what it measures, and what its table and picture say."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from tulip_sim.bench import clik, clik_solvers
from tulip_sim.bench.clik_reference import WalkReference, tracking_errors, walk_reference
from tulip_sim.bench.runner import Row


def rows() -> list[Row]:
    errors = dict.fromkeys(
        ("CoM RMS [mm]", "torso RMS [mrad]", "foot RMS [mm]", "foot RMS [mrad]", "stance foot RMS [mm]"), 0.5
    )
    times = {"ours": 30.0, "ours, dead-beat": 31.0, "Pink": 100.0, "Pink with limits": 120.0, "PlaCo": 10.0}
    made: list[Row] = [
        {"solver": name, "median [us]": time + slower, "p99 [us]": 2 * time, "solves": 9, "remark": "", **errors}
        for slower in (0.0, 1.0, 50.0)  # one round was disturbed
        for name, time in times.items()
    ]
    names = ("median [us]", "p99 [us]", "median of processor time [us]", "p99 of processor time [us]")
    made.append({"tick": "whole", "seed": 0, "ticks": 9, **dict(zip(names, (150.0, 400.0, 149.0, 300.0), strict=True))})
    made.append({"tick": "parts", "seed": 0, **{f"{part} [us]": 20.0 for part in (*clik.PARTS, "rest")}})
    return made


def test_table_holds_ratios_to_pink_and_placo_and_the_share_of_each_part() -> None:
    text = "\n".join(clik.summarize(rows()))
    assert "0.31 of Pink's time" in text  # 31 / 101: medians of the rounds
    assert "2.8 times that of PlaCo" in text
    assert "150 us median, 400 us p99" in text
    parts = len(clik.PARTS) + 1
    assert text.count(f"| 20.0 us | {100.0 / parts:.0f} % |") == parts
    assert text.index("| ours |") < text.index("| Pink |") < text.index("| PlaCo |")


def test_picture_is_written(tmp_path: Path) -> None:
    clik.draw(rows(), tmp_path / "clik.png")
    assert (tmp_path / "clik.png").read_bytes().startswith(b"\x89PNG")


def test_solvers_take_turns_in_one_process() -> None:
    names = [which for what, which in clik.BENCH.trials if what == "solver"]
    assert names == list(clik_solvers.SOLVERS) * clik.ROUNDS
    assert clik.BENCH.workers == 1


def test_missing_pink_is_said_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RuntimeError, match=r"pip install -e '\.\[bench\]'"):
        clik_solvers.prepare(print)


@pytest.mark.sim
def test_own_solver_follows_the_recorded_walk_with_and_without_velocities() -> None:
    whole = walk_reference()
    part = WalkReference(whole.start, whole.instants[:700])
    for dead_beat in (False, True):
        replay = clik_solvers.replay_own(part, dead_beat)
        assert len(replay.seconds) == 699 and np.all(replay.seconds > 0.0)
        errors = tracking_errors(part, replay.postures)
        assert errors["CoM RMS [mm]"] < 1.0 and errors["foot RMS [mm]"] < 2.0 and errors["torso RMS [mrad]"] < 2.0


@pytest.mark.sim
def test_pink_follows_the_recorded_walk() -> None:
    pytest.importorskip("pink")
    whole = walk_reference()
    part = WalkReference(whole.start, whole.instants[:300])
    errors = tracking_errors(part, clik_solvers.replay_pink(part, limited=True, solver="daqp").postures)
    assert errors["CoM RMS [mm]"] < 0.1 and errors["foot RMS [mm]"] < 0.1


@pytest.mark.sim
def test_parts_of_the_tick_add_up_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clik, "WALK", (((0.3, 0.0, 0.0), 1.0),))
    original = clik.Motion.tick
    whole, parts = clik.measure_tick(1), clik.measure_parts(1)
    assert whole["ticks"] == 375 and whole["upright"]
    figures = [value for name, value in parts.items() if name.endswith("[us]")]
    assert len(figures) == len(clik.PARTS) + 1 and min(figures) > 0.0
    assert clik.Motion.tick is original  # the stopwatches are gone
