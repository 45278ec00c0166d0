"""How long it takes from the camera's shutter to a world state that knows the picture, in the graph of processes.

Everything runs: simulator, camera, vision, world model, motion, head, strategy, referee. A watcher beside them hears
the joints' readings, which come the moment they are measured, and so knows the wall-clock time of each stamp.
"""

from __future__ import annotations

import bisect
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from sensor_msgs.msg import JointState

from tulip_msgs.msg import WorldState
from tulip_ros import topics
from tulip_ros.launch import Launcher
from tulip_ros.run import session
from tulip_ros.time import from_message, stamp_of
from tulip_sim.bench.free_port import free_port
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.match_graph import SILENCE, TrialWatcher, trial_plan

SEEDS = (1, 2, 3)
WATCHED = 40.0  # [s] of simulated time that the robot plays, all nodes being up; less if a goal comes first
BAR = 50.0  # [ms]
BINS = np.arange(0.0, 120.0, 2.5)  # [ms]


class LatencyWatcher(TrialWatcher):
    """Notes when each picture has come to be known."""

    def begin_anew(self) -> None:
        """Forget the trial before."""
        super().begin_anew()
        self._stamps: list[int] = []  # [ns] of joint readings
        self._moments: list[float] = []  # [s] wall-clock time when each came
        self._picture = 0
        self.latencies: list[float] = []
        """Of each picture, by the wall clock [s]."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__()
        self.listen(topics.JOINT_STATES, self._on_joints)
        self.listen(topics.WORLD_STATE, self._on_news)

    def _on_joints(self, message: JointState) -> None:
        self._stamps.append(stamp_of(message))
        self._moments.append(time.monotonic())

    def _on_news(self, message: WorldState) -> None:
        now, picture = time.monotonic(), from_message(message.picture)
        plays = self.truth is not None and self.truth.trial_time > 0.0
        if picture == self._picture or not self._stamps or not plays:
            return
        self._picture = picture
        exposed = bisect.bisect_left(self._stamps, picture)  # joints are read every 4 ms, the shutter at one of them
        if 0 < exposed < len(self._stamps):
            self.latencies.append(now - self._moments[exposed])


def measure(seed: int) -> Row:
    """Play one trial and watch it."""
    with (
        Launcher(trial_plan(seed, referee_port=free_port())) as launcher,
        session(LatencyWatcher, arguments=[], handle_signals=False) as (watcher, spin),
    ):
        while watcher.truth is None or not (watcher.truth.outcome or watcher.truth.trial_time > WATCHED):
            spin(0.05)
            launcher.poll()
            if time.monotonic() - watcher.heard > SILENCE:
                raise RuntimeError(f"the simulator has said nothing for {SILENCE:.0f} s; see {launcher.log_folder}")
        factor = watcher.real_time_factor
    found = 1e3 * np.array(watcher.latencies)
    return {
        "seed": seed,
        "pictures": len(found),
        "median [ms]": round(float(np.median(found)), 1),
        "p99 [ms]": round(float(np.percentile(found, 99)), 1),
        "most [ms]": round(float(found.max()), 1),
        "real-time factor": round(factor, 2),
        "histogram": np.histogram(np.minimum(found, BINS[-1]), BINS)[0].tolist(),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return one line a trial."""
    lines = [
        "From the shutter to the first world state that knows the picture, by the wall clock, while the robot plays;"
        " the whole graph on this machine's cores, pictures of 640x480 at 15 Hz. Asked for: 99 of 100 within"
        f" {BAR:.0f} ms.",
        "",
        "| seed | pictures | median | p99 | most | real-time factor |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        lines.append(
            f"| {row['seed']} | {row['pictures']} | {row['median [ms]']} ms | {row['p99 [ms]']} ms"
            f" | {row['most [ms]']} ms | {row['real-time factor']} |"
        )
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the histogram of all pictures."""
    figure = Figure(figsize=(8.0, 3.5), layout="constrained")
    axis = figure.subplots()
    total = np.sum([row["histogram"] for row in rows], axis=0)
    axis.bar(BINS[:-1], 100.0 * total / total.sum(), width=np.diff(BINS), align="edge", color="tab:blue")
    axis.axvline(BAR, color="tab:red", linewidth=1.0, label="asked for: 99 % below")
    axis.set(xlabel="from the shutter to the world state [ms]", ylabel="share of the pictures [%]")
    axis.legend()
    figure.savefig(path, dpi=120)


BENCH = Bench(
    "latency", "From picture to world state", [(seed,) for seed in SEEDS], measure, summarize, draw, workers=1
)
