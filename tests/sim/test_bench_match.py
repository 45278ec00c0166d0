"""Bench match says what came out of matches."""

from __future__ import annotations

from tulip_sim.bench import match
from tulip_sim.bench.runner import Row


def row(mode: str, seed: int, decided_by: str, trials: list[list[object]], factor: float) -> Row:
    return {
        "mode": mode,
        "seed": seed,
        "score": [1, 0],
        "result": "1:0, cyan wins (goals)",
        "decided by": decided_by,
        "trials": trials,
        "striker's touches": 4,
        "keeper's touches": 1,
        "falls": 1,
        "removals": 2,
        "simulated [s]": 120.0,
        "localization error [m]": [0.05, 0.1],
        "real-time factor": factor,
        "log lines": 1,
        "log": ["00:00.0  0:0  trial 1: cyan strikes, magenta keeps"],
    }


ROWS = [
    row("lockstep", 1, "goals", [[0, "goal", 40.0], [1, "out", 10.0]], 1.4),
    row("lockstep", 2, "", [[0, "goal", 20.0]], 1.2),
    row("graph", 1, "draw", [[0, "time", 150.0]], 0.5),
]


def test_summary_names_matches_trials_and_the_first_log() -> None:
    text = "\n".join(match.summarize(ROWS))
    assert "- matches that ran to their end: 2 of 3" in text
    assert "- trials: 4, ended by goal 2, out 1, time 1; median time to goal 30 s" in text
    assert "- falls: 3; removals: 6" in text
    assert "one match at a time: median 1.30, least 1.20" in text
    assert "| graph | 1 | 1:0, cyan wins (goals) | 1 | 1 | 2 | 120 s | 0.050 m and 0.100 m | 0.50 |" in text
    assert ROWS[0]["log"][0] in text


def test_ten_matches_in_lockstep_and_one_as_a_graph_one_at_a_time() -> None:
    assert [mode for mode, _ in match.BENCH.trials] == ["lockstep"] * 10 + ["graph"]
    assert match.BENCH.workers == 1
