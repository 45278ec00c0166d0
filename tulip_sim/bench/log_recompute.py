"""Part `recompute` of bench log: how many times faster than real time recorded runs are computed anew."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tulip_ros.log_file import Log
from tulip_sim.bench.log_trial import record_trial
from tulip_sim.bench.runner import Row
from tulip_sim.recompute.run import recompute

TRIALS: tuple[tuple[str, str, int, float], ...] = (
    ("worldmodel", "none", 1, 20.0),
    ("worldmodel", "compressed", 1, 20.0),
    ("worldmodel,strategy,head", "none", 1, 20.0),
    ("vision,worldmodel", "compressed", 1, 20.0),
    ("vision,worldmodel", "png", 1, 10.0),
)
"""Components, pictures in the recording ("none": made-up features), seed, length [s]."""
BARS = {True: 3.0, False: 20.0}
"""Times real time, with vision and without."""


def measure(components: str, pictures: str, seed: int, seconds: float) -> Row:
    """Record a trial's beginning in lockstep and compute components anew as `replay.py --recompute` does.

    Once with `--no-output`: compared with what was recorded and with the truth; once written as well.

    Args:
        components: Joined by commas.
        pictures: "compressed", "png", or "none" for features made up from the truth.
        seed: Of the trial.
        seconds: Recorded time [s].
    """
    chosen = components.split(",")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recorded"
        record_trial(folder, pictures, seed, seconds)
        with Log(folder) as log:
            recompute(log, chosen)  # compiles vision's loops, fills the system's cache
            begin = time.perf_counter()
            outcome = recompute(log, chosen)
            compared = time.perf_counter() - begin
            begin = time.perf_counter()
            recompute(log, chosen, Path(temporary) / "recomputed")
            written = time.perf_counter() - begin
            differences = outcome.differences.values()
            return {
                "part": "recompute",
                "components": components,
                "pictures": pictures,
                "seed": seed,
                "recorded_s": outcome.seconds,
                "recording_mb": sum(path.stat().st_size for path in log.files) / 1e6,
                "times_real_time_comparing": outcome.seconds / compared,
                "times_real_time_writing": outcome.seconds / written,
                "messages": sum(each.recorded for each in differences),
                "messages_equal": sum(each.equal for each in differences),
            }


def lines(rows: Sequence[Row]) -> list[str]:
    """Return the table in markdown, with the bars."""
    text = [
        "`replay.py --recompute` on lockstep recordings of trials with all topics, pictures at 15.6 Hz: compared with"
        " what was recorded and with the truth (`--no-output`), and written as well. Asked for:"
        f" {BARS[True]:.0f} times real time with vision, {BARS[False]:.0f} times without.",
        "",
        "| components | pictures | recorded [s] | times real time | with writing | equal | bar |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        bar = BARS["vision" in row["components"].split(",")]
        text.append(
            f"| {row['components'].replace(',', ', ')} | {row['pictures']} | {row['recorded_s']:.0f}"
            f" | {row['times_real_time_comparing']:.1f}"
            f" | {row['times_real_time_writing']:.1f} | {row['messages_equal']} of {row['messages']} | {bar:.0f} |"
        )
    return text
