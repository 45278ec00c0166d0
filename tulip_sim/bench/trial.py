"""Whole dribble and kick trials in lockstep, camera and vision included."""

from __future__ import annotations

import numpy as np

from tulip_sim.bench.runner import Bench, Row
from tulip_sim.match_lockstep import play_lockstep

SEEDS = range(1, 21)


def measure(seed: int) -> Row:
    """Play one trial."""
    summary = play_lockstep(seed)
    return {
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
    """Return the totals and one line a trial."""
    goals = [row for row in rows if row["outcome"] == "goal"]
    time = f"{np.median([row['time [s]'] for row in goals]):.0f} s" if goals else "none"
    place, heading, factor = (
        float(np.median([row[name] for row in rows]))
        for name in ("localization error [m]", "heading error [deg]", "real-time factor")
    )
    lines = [
        "Robot in its own half, heading random within 45 deg of the goal, ball 0.5-3 m away in any direction, keeper"
        " off-centre; 150 s of play. Camera, vision, localization, strategy and referee run as in the graph.",
        "",
        f"- goals: {len(goals)} of {len(rows)}; median time to goal {time}",
        f"- falls: {sum(row['falls'] for row in rows)}",
        f"- localization error, median of the trials' RMS: {place:.3f} m, {heading:.1f} deg",
        f"- real-time factor of one trial with one more on the other core, median: {factor:.1f}",
        "",
        "| seed | outcome | time | touches | falls | walked | localization error |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        error = f"{row['localization error [m]']:.3f} m, {row['heading error [deg]']:.1f} deg"
        lines.append(
            f"| {row['seed']} | {row['outcome']} | {row['time [s]']} s | {row['touches']} | {row['falls']}"
            f" | {row['distance walked [m]']} m | {error} |"
        )
    return lines


BENCH = Bench("trial", "Trials in lockstep", [(seed,) for seed in SEEDS], measure, summarize)
