"""Strategy, with camera and vision in lockstep: trials against two kinds of keeper, and the robot as goalkeeper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tulip_description.field import load_field
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.bench.shots import IN_GOAL, draw_shot, goes_in, keep
from tulip_sim.match_lockstep import play_lockstep

SEEDS = range(1, 101)
SHOTS = range(1, 51)
KEEPERS = {"standing": "trial", "following": "trial_moving_keeper"}
"""Scenarios by how the keeper's figure behaves."""
WORDS = {
    "standing": "keeper's figure stands off-centre",
    "following": "keeper's figure follows the ball along the goal line at 0.2 m/s",
}
BARS = {"standing": 95, "following": 70}
MOST_FALLS = 2
KEPT = 0.6


def measure(part: str, seed: int) -> Row:
    """Play one trial, or shoot once."""
    if part == "shots":
        shot = draw_shot(seed)
        kept, fell, touches = keep(shot, seed)
        return {
            "part": part,
            "seed": seed,
            "speed [m/s]": round(float(np.hypot(*shot.velocity)), 2),
            "kept out": kept,
            "fell": fell,
            "touches": touches,
            "kept out by a still figure": not goes_in(shot, load_field(), seed, IN_GOAL),
        }
    summary = play_lockstep(seed, KEEPERS[part])
    return {
        "part": part,
        "seed": seed,
        "outcome": summary.outcome,
        "time [s]": round(summary.time, 1),
        "touches": summary.touches,
        "falls": summary.falls,
        "distance walked [m]": round(summary.distance_walked, 1),
        "localization error [m]": round(summary.localization_error, 3),
        "heading error [deg]": round(summary.heading_error, 2),
        "real-time factor": round(summary.real_time_factor, 2),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return the tables."""
    lines = [
        "Trials: robot in its own half, heading random within 45 deg of the goal, ball 0.5-3 m away in any direction,"
        " 150 s of play. Camera, vision, localization, strategy and referee run as in the graph.",
        "",
        "| keeper | goals | asked for | falls (at most 2) | time to goal: median, 90 % | other ends |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for part, words in WORDS.items():
        here = [row for row in rows if row["part"] == part]
        if here:
            lines.append(_line(part, words, here))
    played = [row for row in rows if row["part"] in KEEPERS]
    if played:
        place, heading, factor = (
            float(np.median([row[name] for row in played]))
            for name in ("localization error [m]", "heading error [deg]", "real-time factor")
        )
        lines += [
            "",
            f"Localization error, median of the trials' RMS: {place:.3f} m, {heading:.1f} deg. Real-time factor of one"
            f" trial with one more on the other core, median: {factor:.1f}.",
        ]
    shots = [row for row in rows if row["part"] == "shots"]
    if shots:
        lines += ["", *_shots(shots)]
    return lines


def _line(part: str, words: str, rows: Sequence[Row]) -> str:
    goals = [row["time [s]"] for row in rows if row["outcome"] == "goal"]
    falls = sum(row["falls"] for row in rows)
    times = "none" if not goals else f"{np.median(goals):.0f} s, {np.percentile(goals, 90):.0f} s"
    ends = [f"{row['outcome']} (seed {row['seed']})" for row in rows if row["outcome"] != "goal"]
    bar = f"{BARS[part]} of 100"
    return f"| {words} | {len(goals)} of {len(rows)} | {bar} | {falls} | {times} | {', '.join(ends) or 'none'} |"


def _shots(rows: Sequence[Row]) -> list[str]:
    kept, still, falls = (sum(row[name] for row in rows) for name in ("kept out", "kept out by a still figure", "fell"))
    quick = [row for row in rows if row["speed [m/s]"] >= 1.75]
    return [
        f"Goalkeeper: {len(rows)} shots from 3 m, up to 40 deg aside, launched at 1 to 2 m/s at a random place of the"
        " goal; those that would stop before the line are drawn again, so that each goes in on an empty field. The"
        " robot has had 5 s of play to take its place.",
        "",
        f"- kept out: {kept} of {len(rows)} (bar: {KEPT:.0%}); of those at 1.75 m/s or more"
        f" {sum(row['kept out'] for row in quick)} of {len(quick)}; falls {falls}",
        "- the same shots against a still figure in the middle of the goal, 0.3 m before the line:"
        f" {still} of {len(rows)}",
    ]


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw how many trials have ended with a goal by what time."""
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axes = figure.add_subplot()
    for part, words in WORDS.items():
        here = [row for row in rows if row["part"] == part]
        times = sorted(row["time [s]"] for row in here if row["outcome"] == "goal")
        if times:
            share = np.arange(len(times) + 1) / len(here)
            axes.step([0.0, *times], share, where="post", label=words)
    axes.set(xlabel="time of play [s]", ylabel="share of trials with a goal", xlim=(0.0, 150.0), ylim=(0.0, 1.0))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right", fontsize=8)
    figure.savefig(path, dpi=110)


TRIALS = [
    *(("shots", seed) for seed in SHOTS),
    *((part, seed) for part in KEEPERS for seed in SEEDS),
]
BENCH = Bench("strategy", "Strategy", TRIALS, measure, summarize, draw)
