"""How much faster a batch is with two workers than with one."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from tulip_sim.batch.jobs import Batch
from tulip_sim.batch.parameter_sets import DEFAULT
from tulip_sim.batch.workers import play_here
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.lockstep import Settings
from tulip_sim.referee import RefereeParameters

GAMES = 16
PLAYING = 10.0  # [s] too short for a goal, so that all games are equally long
REPEATS = 2
BAR = 1.9


def measure(workers: int, repeat: int) -> Row:
    """Play all games with so many workers; their start counts, too."""
    rules = replace(RefereeParameters(), playing_time=PLAYING, ends_when_ball_is_out=False)
    batch = Batch("trial", "trial", {DEFAULT: Settings(referee=rules)}, range(1, GAMES + 1))
    begin = time.perf_counter()
    seeds = sorted(row["seed"] for row in play_here(batch, batch.jobs(), workers))
    elapsed = time.perf_counter() - begin
    if seeds != list(batch.seeds):
        raise RuntimeError(f"seeds {seeds} were played; expected each of 1 to {GAMES} once")
    return {"workers": workers, "repeat": repeat, "games": GAMES, "wall-clock time [s]": round(elapsed, 1)}


def summarize(rows: list[Row]) -> list[str]:
    """Return the throughput of each number of workers and the ratio."""
    median = {
        workers: float(np.median([row["wall-clock time [s]"] for row in rows if row["workers"] == workers]))
        for workers in sorted({row["workers"] for row in rows})
    }
    return [
        f"{GAMES} games of {PLAYING:.0f} s of play with camera and vision, start of the processes included; medians of"
        f" {REPEATS} runs on an otherwise idle machine with two cores.",
        "",
        "| workers | wall-clock time | games a minute | times one worker |",
        "| --- | --- | --- | --- |",
        *(
            f"| {workers} | {elapsed:.1f} s | {60.0 * GAMES / elapsed:.1f} | {median[1] / elapsed:.2f} |"
            for workers, elapsed in median.items()
        ),
        "",
        f"Asked: {BAR} times the throughput with two workers.",
    ]


BENCH = Bench(
    "batch",
    "Batches on two cores",
    [(workers, repeat) for repeat in range(REPEATS) for workers in (1, 2)],
    measure,
    summarize,
    workers=1,
)
