"""The bench that compares gaits and controllers."""

from __future__ import annotations

import json

import pytest

from tulip_sim.bench import control
from tulip_sim.bench.runner import Row


def row(gait: str, seed: int, upright: bool, survived: float, cost: float | None) -> Row:
    return {
        "gait": gait,
        "feedforward": "full",
        "weighting": "zmp",
        "learning": "none",
        "seed": seed,
        "upright": upright,
        "survived [s]": survived,
        "joint error RMS [mrad]": 2.0 + seed,
        "CoM error RMS [mm]": 5.0,
        "ZMP error RMS [mm]": 20.0,
        "peak torque [N m]": 40.0,
        "cost of transport": cost,
        "distance [m]": 5.0,
    }


def test_seeds_of_a_combination_make_one_line_and_falls_have_no_cost_of_transport() -> None:
    rows = [row("dcm", 0, True, 30.0, 0.4), row("dcm", 1, False, 8.0, None), row("dcm", 2, True, 30.0, 0.6)]
    rows += [row("paper", 0, False, 7.0, None)]
    assert control.summarize(rows)[-2:] == [
        "| dcm | full | zmp | none | 2 of 3 | 30.0 s | 3.0 mrad | 5 mm | 20 mm | 40 N m | 0.50 |",
        "| paper | full | zmp | none | 0 of 1 | 7.0 s | 2.0 mrad | 5 mm | 20 mm | 40 N m | - |",
    ]


def test_every_combination_has_valid_parameters_and_each_is_there_once() -> None:
    lines = control.combinations()
    assert len(set(lines)) == len(lines)
    for line in lines:
        control.parameters(*line)
    assert len(control.BENCH.trials) == control.SEEDS * len(lines)


@pytest.mark.sim
def test_a_short_walk_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "DURATION", 4.0)
    measured = control.measure("dcm", "full", "zmp", "none", 1)
    assert json.loads(json.dumps(measured)) == measured
    assert measured["upright"] and measured["survived [s]"] == 4.0
    assert 0.1 < measured["joint error RMS [mrad]"] < 20.0
    assert 0.4 < measured["distance [m]"] < 0.9
    assert 0.0 < measured["cost of transport"] < 5.0


@pytest.mark.sim
def test_a_fall_is_measured_until_it_happens(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "DURATION", 10.0)
    # As printed, alpha from the CoM's distances to the feet loads the swinging foot as much as the standing one.
    measured = control.measure("dcm", "full", "distance", "none", 0)
    assert not measured["upright"]
    assert 0.5 < measured["survived [s]"] < 10.0
    assert measured["cost of transport"] is None
