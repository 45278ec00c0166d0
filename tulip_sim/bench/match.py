"""Whole matches of two robots: ten in lockstep, from the first trial to the last, and a short one as a graph."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from tulip_sim.bench.free_port import free_port
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.match_rules import MatchRules
from tulip_sim.match_summary import MatchSummary
from tulip_sim.match_two_graph import match_plan, play_match_graph
from tulip_sim.play_lockstep_match import play_lockstep_match

SEEDS = range(1, 11)
GRAPH_RULES = MatchRules(trials=2, extra_pairs=0)
"""Of the match as a graph, which takes twice as long as it plays: one trial a side."""


def measure(mode: str, seed: int) -> Row:
    """Play one match.

    Args:
        mode: "lockstep", with cameras and vision in processes of their own, or "graph".
        seed: Of all that is random.
    """
    return _row(play_lockstep_match(seed, eyes_beside=True) if mode == "lockstep" else _play_graph(seed))


def _play_graph(seed: int) -> MatchSummary:
    plan = match_plan(seed, GRAPH_RULES, referee_ports=(free_port(), free_port()))
    with tempfile.TemporaryDirectory() as folder:
        return play_match_graph(plan, seed, say=lambda line: None, logs=Path(folder))


def _row(summary: MatchSummary) -> Row:
    report = summary.report
    return {
        "mode": summary.mode,
        "seed": summary.seed,
        "score": list(report.score),
        "result": report.verdict,
        "decided by": report.decided_by,
        "trials": [[each.striker, each.result, round(each.seconds, 1)] for each in report.trials],
        "striker's touches": sum(each.striker_touches for each in report.trials),
        "keeper's touches": sum(each.keeper_touches for each in report.trials),
        "falls": summary.falls,
        "removals": summary.removals,
        "simulated [s]": round(summary.duration, 1),
        "localization error [m]": [round(error, 3) for error in summary.localization_errors],
        "real-time factor": round(summary.real_time_factor, 2),
        "log lines": len(report.log),
        "log": [str(line) for line in report.log],
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return the totals, one line a match, and the log of the first."""
    lockstep = [row for row in rows if row["mode"] == "lockstep"]
    trials = [trial for row in rows for trial in row["trials"]]
    goals = [seconds for _, result, seconds in trials if result == "goal"]
    endings = ", ".join(
        f"{name} {sum(result == name for _, result, _ in trials)}" for name in dict.fromkeys(each[1] for each in trials)
    )
    finished = sum(bool(row["decided by"]) for row in rows)
    factors = [row["real-time factor"] for row in lockstep]
    median = f"; median time to goal {np.median(goals):.0f} s" if goals else ""
    lines = [
        "Two robots with all their components, one world, one referee: five trials a side of up to 150 s, in turns, and"
        " extra trials while the score is level (docs/match.md). Cameras and vision as in the graph.",
        "",
        f"- matches that ran to their end: {finished} of {len(rows)}",
        f"- trials: {len(trials)}, ended by {endings}{median}",
        f"- falls: {sum(row['falls'] for row in rows)}; removals: {sum(row['removals'] for row in rows)}",
    ]
    if factors:
        middle, least = float(np.median(factors)), min(factors)
        lines.append(f"- real-time factor in lockstep, one match at a time: median {middle:.2f}, least {least:.2f}")
    lines += [
        "",
        "| mode | seed | result | trials | falls | removals | simulated | localization error | real-time factor |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        errors = " and ".join(f"{error:.3f} m" for error in row["localization error [m]"])
        cells = (
            *(row["mode"], row["seed"], row["result"], len(row["trials"]), row["falls"], row["removals"]),
            *(f"{row['simulated [s]']:.0f} s", errors, f"{row['real-time factor']:.2f}"),
        )
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    if rows:
        lines += ["", "The referee's log of the first match:", "", "```", *rows[0]["log"], "```"]
    return lines


TRIALS = [*(("lockstep", seed) for seed in SEEDS), ("graph", 1)]
BENCH = Bench("match", "Matches of two robots", TRIALS, measure, summarize, workers=1)
