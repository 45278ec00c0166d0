"""Benches: they run, keep their rows, and say what came out."""

from __future__ import annotations

import importlib.util
import json
import time
from dataclasses import replace
from pathlib import Path

import pytest

from tulip_sim.bench import challenges, engines, ilc, kick, push, simcheck, strategy, stress, walk
from tulip_sim.bench.runner import Bench, Row, run, save, write_results
from tulip_sim.parameters import ENGINES

BENCHES = (strategy.BENCH, walk.BENCH, push.BENCH, kick.BENCH, ilc.BENCH, stress.BENCH, simcheck.BENCH, engines.BENCH)

TRIAL_ROWS: list[Row] = [
    {
        "part": "standing",
        "seed": seed,
        "outcome": outcome,
        "time [s]": duration,
        "touches": 5,
        "falls": falls,
        "distance walked [m]": 3.0,
        "localization error [m]": error,
        "heading error [deg]": 2.0,
        "real-time factor": 1.5,
    }
    for seed, outcome, duration, falls, error in (
        (1, "goal", 20.0, 0, 0.1),
        (2, "fallen", 60.0, 2, 0.3),
        (3, "goal", 40.0, 1, 0.2),
    )
]
WALK_ROWS: list[Row] = [
    {
        "walk": "forward 0.6 m/s",
        "seed": seed,
        "friction": 0.8,
        "upright": seed == 1,
        "time [s]": 60.0,
        "greatest tilt [rad]": 0.1 * seed,
        "greatest torque by limit": 0.9 - 0.1 * seed,
        "greatest joint speed [rad/s]": 7.0 + seed,
        "speed [m/s, rad/s]": 0.64 - 0.03 * seed - 0.03,
        "off the line after 20 m [m]": 0.2 if seed == 1 else None,
        "way [m]": [[0.0, 0.0], [1.0, 0.1]],
    }
    for seed in (1, 2)
] + [
    {
        "walk": "slalom",
        "seed": 1,
        "friction": 0.8,
        "upright": True,
        "time [s]": 30.0,
        "greatest tilt [rad]": 0.1,
        "greatest torque by limit": 0.8,
        "greatest joint speed [rad/s]": 8.0,
    }
]
KICK_ROWS: list[Row] = [
    {
        "kind": kind,
        "foot": "left",
        "seed": seed,
        "told": True,
        "wanted direction [rad]": 0.0,
        "wanted speed [m/s]": 3.2,
        "refusal": refusal,
        "upright": upright,
        "ball speed [m/s]": speed,
        "direction error [deg]": direction,
        "greatest joint speed [rad/s]": 9.0,
        "greatest torque by limit": 0.9,
        "greatest tilt [rad]": 0.1,
    }
    for kind, seed, refusal, upright, speed, direction in (
        ("forward", 0, "", True, 3.5, 3.0),
        ("forward", 1, "", False, 3.5, -4.0),
        ("forward", 2, "", True, 2.9, 0.0),
        ("walking", 3, "out of reach", True, 0.0, 90.0),
    )
]


def test_trials_are_counted_and_those_without_a_goal_named() -> None:
    text = "\n".join(strategy.summarize(TRIAL_ROWS))
    line = "| keeper's figure stands off-centre | 2 of 3 | 95 of 100 | 3 | 30 s, 38 s | fallen (seed 2) |"
    assert line in text
    assert "median of the trials' RMS: 0.200 m, 2.0 deg" in text


def test_trials_without_a_goal_have_no_time_to_goal() -> None:
    assert "| 0 of 1 | 95 of 100 | 2 | none | fallen (seed 2) |" in "\n".join(strategy.summarize(TRIAL_ROWS[1:2]))


def test_shots_are_counted_beside_those_that_a_figure_stops() -> None:
    shots: list[Row] = [
        {
            "part": "shots",
            "seed": seed,
            "speed [m/s]": speed,
            "kept out": kept,
            "fell": False,
            "touches": 1,
            "kept out by a still figure": False,
        }
        for seed, speed, kept in ((1, 1.5, True), (2, 1.9, True), (3, 1.8, False))
    ]
    text = "\n".join(strategy.summarize(shots))
    assert "kept out: 2 of 3 (bar: 60%); of those at 1.75 m/s or more 1 of 2; falls 0" in text
    assert "0.3 m before the line: 0 of 3" in text


def test_walks_are_summarized_one_line_a_walk() -> None:
    lines = walk.summarize(WALK_ROWS)
    assert lines[-2:] == [
        "| forward 0.6 m/s, 60 s | 1 of 2 | 0.55, 0.56 m/s | 0.20 m | 0.20 rad | 0.75, 0.80 | 9.0 rad/s |",
        "| slalom, 30 s | 1 of 1 |  |  | 0.10 rad | 0.80, 0.80 | 8.0 rad/s |",
    ]


@pytest.mark.sim
def test_a_short_stand_is_measured_on_each_engine_that_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(engines.TASKS, "stand", (None, 0.5))
    names = [name for name in ENGINES if importlib.util.find_spec(name) is not None]
    rows = [engines.measure("stand", name, 0) for name in names]
    assert all(row["upright"] and row["time [s]"] == 0.5 for row in rows)
    lines = [line for line in engines.summarize(rows) if line.startswith("| stand")]
    assert [f"| {name} | 1 of 1 |" in line for name, line in zip(names, lines, strict=True)] == [True] * len(names)


def test_good_kicks_are_carried_out_fast_and_leave_the_robot_upright() -> None:
    lines = kick.summarize(KICK_ROWS)
    assert (
        "| forward | 3.2 m/s | 1 of 3 at 3.0 m/s or more | 2 of 3 | 2.90, 3.50 m/s | 2.9, -0.3 deg"
        " | 9.0 rad/s | 0.90 | 0.10 rad |"
    ) in lines
    assert "- walking, left foot, seed 3: out of reach" in lines


def test_where_the_balls_went_is_drawn(tmp_path: Path) -> None:
    kick.draw(KICK_ROWS, tmp_path / "kick.png")
    assert (tmp_path / "kick.png").read_bytes().startswith(b"\x89PNG")
    save(kick.BENCH, KICK_ROWS, tmp_path)
    write_results([kick.BENCH], tmp_path, tmp_path / "results.md")
    assert f"![Kicking]({tmp_path.name}/kick.png)" in (tmp_path / "results.md").read_text()


def _late(index: int) -> Row:
    time.sleep(0.3 if index == 0 else 0.0)
    return {"index": index}


def test_rows_keep_the_order_of_the_trials_whichever_ends_first() -> None:
    came: list[Row] = []
    bench = Bench("late", "Late", [(index,) for index in range(4)], _late, lambda rows: [])
    rows = run(bench, workers=2, done=came.append)
    assert [row["index"] for row in rows] == [0, 1, 2, 3]
    assert sorted(row["index"] for row in came) == [0, 1, 2, 3]
    assert came[0]["index"] != 0


@pytest.mark.sim
def test_a_kick_is_measured_kept_and_published(tmp_path: Path) -> None:
    bench = replace(kick.BENCH, trials=kick.BENCH.trials[:1])
    rows = run(bench, workers=1)
    assert [(row["kind"], row["foot"], row["refusal"]) for row in rows] == [("forward", "left", "")]
    kept = save(bench, rows, tmp_path / "results")
    assert kept == tmp_path / "results" / "kick.json"
    assert json.loads(kept.read_text()) == {"bench": "kick", "rows": rows}
    page = tmp_path / "results.md"
    write_results(BENCHES, tmp_path / "results", page)
    text = page.read_text()
    assert "## Kicking (`kick`)" in text
    assert "| forward | 3.2 m/s | 1 of 1 at 3.0 m/s or more | 1 of 1 |" in text
    assert "## Walking" not in text  # nothing is known of it


@pytest.mark.sim
def test_a_walk_that_is_cut_short_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(walk.WALKS, "forward 0.6 m/s", ((0.6, 0.0, 0.0), 8.0, 1))
    row = walk.measure("forward 0.6 m/s", 1)
    assert row["upright"]
    assert row["time [s]"] == 8.0
    assert 0.55 < row["speed [m/s, rad/s]"] < 0.65
    assert row["off the line after 20 m [m]"] is None  # it did not come so far
    assert 0.6 <= row["friction"] <= 1.0
    assert 0.0 < row["greatest torque by limit"] <= 1.0


@pytest.mark.sim
def test_a_light_push_is_survived_and_a_hard_one_is_not() -> None:
    assert push.survives(180, 0.4, 5.0, 1)
    assert not push.survives(180, 0.4, 40.0, 1)


def test_the_worst_push_of_a_direction_is_told() -> None:
    rows = [
        {"direction [deg]": direction, "phase": phase, "seed": seed, "survived [N s]": 9 + seed + direction // 45}
        for direction in push.DIRECTIONS
        for phase in push.PHASES
        for seed in (1, 2)
    ]
    lines = push.summarize(rows)
    assert any(line.startswith("| 0 deg | 10 |") and line.endswith("| 10 N s |") for line in lines)
    assert any(line.startswith("| 90 deg |") and line.endswith("| 12 N s |") for line in lines)


@pytest.mark.sim
def test_half_a_minute_of_random_commands_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stress, "DURATION", 16.0)
    monkeypatch.setattr(stress, "WINDOW", 4.0)
    row = stress.measure(3)
    assert row["upright"]
    assert row["time [s]"] >= 16.0
    assert 0.5 < row["joint error, first 300 s [mrad]"] < 30.0
    assert row["memory at the end [MB]"] >= row["memory at 300 s [MB]"] > 0.0
    assert row["odometry error at the end [m]"] < 0.2


def test_all_benches_have_names_of_their_own_and_independent_trials() -> None:
    assert len({bench.name for bench in BENCHES}) == len(BENCHES)
    for bench in BENCHES:
        assert len(set(bench.trials)) == len(bench.trials) > 0


def ilc_rows() -> list[Row]:
    curves = {"none": [4.0] * 60, "waveform": [4.0] * 10 + [1.0] * 50, "adaptive": [4.0] * 10 + [3.0] * 50}
    return [
        {
            "robot": "nominal",
            "learning": law,
            "seed": 1,
            "upright": True,
            "greatest learned torque [N m]": 2.0,
            "notes": "",
            ilc.MEASURED: curve,
            ilc.TRUE: curve,
        }
        for law, curve in curves.items()
    ]


def test_learning_curves_are_compared_with_the_same_seed_without_learning() -> None:
    text = "\n".join(ilc.summarize(ilc_rows()))
    assert "| nominal | waveform | 4.0 mrad | 0.25, 0.25 | 0.25, 0.25 | 1 of 1 |" in text
    assert "| nominal | adaptive | 4.0 mrad | 0.75, 0.75 | 0.75, 0.75 | 0 of 1 |" in text


def test_learning_curves_are_drawn_and_shown_on_the_page(tmp_path: Path) -> None:
    folder = tmp_path / "results"
    save(ilc.BENCH, ilc_rows(), folder)
    assert ilc.BENCH.draw is not None
    ilc.BENCH.draw(ilc_rows(), folder / "ilc.png")
    assert (folder / "ilc.png").read_bytes().startswith(b"\x89PNG")
    write_results(BENCHES, folder, tmp_path / "results.md")
    assert "![Iterative learning control](results/ilc.png)" in (tmp_path / "results.md").read_text()


@pytest.mark.sim
def test_a_short_walk_gives_an_error_for_each_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ilc, "STEPS", 6)
    row = ilc.measure("heavier, with friction", "waveform", 1)
    assert row["upright"]
    assert len(row[ilc.TRUE]) == len(row[ilc.MEASURED]) == 6
    assert 4.0 < row[ilc.TRUE][3] < 12.0  # [mrad] before learning acts
    assert row["greatest learned torque [N m]"] > 0.5


def test_the_challenges_table_tells_goals_and_misses() -> None:
    course, throw_in = challenges.COURSE, challenges.THROW_IN
    rows = [
        {"part": course, "seed": 1, "outcome": "goal", "time [s]": 40.0, "touches": 9, "falls": 0},
        {"part": course, "seed": 2, "outcome": "fallen", "time [s]": 20.0, "touches": 3, "falls": 1},
        {"part": throw_in, "seed": 1, "time [s]": 20.0, "way [m]": 2.9, "miss [m]": 0.3, "falls": 0},
        {"part": throw_in, "seed": 2, "time [s]": 60.0, "way [m]": 3.2, "miss [m]": None, "falls": 0},
    ]
    text = "\n".join(challenges.summarize(rows))
    assert "goals: 1 of 2, after 40 s (median); other ends: fallen (seed 2)" in text
    assert "falls: 1" in text
    assert "kicked: 1 of 2; distance from the target at rest: median 0.30 m" in text


@pytest.mark.sim
def test_a_throw_in_is_kicked_and_measured() -> None:
    row = challenges.measure(challenges.THROW_IN, 2)
    assert row["miss [m]"] is not None
    assert row["miss [m]"] < 0.5 * row["way [m]"]
    assert row["falls"] == 0
