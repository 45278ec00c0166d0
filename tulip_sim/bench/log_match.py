"""What recording a match costs: the recorder's share of a core, messages lost, bytes a minute."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from tulip_ros import log_notes
from tulip_ros.launch import Launcher
from tulip_ros.log_file import Log
from tulip_ros.run import ComponentNode, session
from tulip_sim.bench.free_port import free_port
from tulip_sim.bench.processor_time import processor_time
from tulip_sim.bench.runner import Row
from tulip_sim.match_graph import SILENCE, TrialWatcher, trial_plan
from tulip_sim.match_rules import MatchRules
from tulip_sim.match_two_graph import MatchWatcher, match_plan

Spin = Callable[[float], None]
WATCHED = 60.0  # [s] of simulated time, of which the robots stand still in the first few
MINUTES = 10.0  # of a match whose size is asked for


def measure(robots: int, seed: int) -> Row:
    """Record a graph of one or two robots with camera, and watch the recorder's process.

    Raises:
        RuntimeError: if the simulator falls silent.
    """
    with tempfile.TemporaryDirectory(prefix="tulip_log_") as scratch:
        record = Path(scratch) / "match"
        if robots == 1:
            plan = trial_plan(seed, record=record, referee_port=free_port())
        else:
            ports = free_port(), free_port()
            plan = match_plan(seed, MatchRules(playing_time=WATCHED), record, referee_ports=ports)
        make_watcher = TrialWatcher if robots == 1 else MatchWatcher
        with Launcher(plan) as launcher, session(make_watcher, arguments=[], handle_signals=False) as (watcher, spin):
            first, spent, begun = _wait(watcher, spin, launcher, 1.0)
            last, more, ended = _wait(watcher, spin, launcher, 1.0 + WATCHED)
            spin(0.1)
        with closing(Log(record)) as log:
            lost = sum(int(count) for count in log.metadata[log_notes.LOST].values())
            messages = sum(topic.messages for topic in log.topics.values())
            pictures = sum(topic.messages for name, topic in log.topics.items() if name.endswith("compressed"))
            size = sum(len(record.data) for record in log.records() if record.topic.name.endswith("compressed"))
        written = sum(file.stat().st_size for file in record.glob("*.mcap"))
    simulated = last * 1e-9
    return {
        "part": "match",
        "robots": robots,
        "seed": seed,
        "simulated [s]": round(simulated, 1),
        "real-time factor": round((last - first) * 1e-9 / (ended - begun), 2),
        "recorder, share of a core": round((more - spent) / (ended - begun), 4),
        "recorder [s] per simulated second": round((more - spent) / ((last - first) * 1e-9), 4),
        "messages": messages,
        "lost": lost,
        "pictures": pictures,
        "one picture [kB]": round(size / 1e3 / max(1, pictures), 1),
        "written [MB]": round(written / 1e6, 2),
        "pictures [MB]": round(size / 1e6, 2),
        "10 minutes [MB]": round(written / 1e6 / simulated * 60.0 * MINUTES, 1),
    }


def _wait(
    watcher: TrialWatcher | MatchWatcher, spin: Spin, launcher: Launcher, until: float
) -> tuple[int, float, float]:
    """Wait for a simulated time [s] or the end; return it [ns], the recorder's CPU and wall-clock time [s]."""
    while watcher.stamp < until * 1e9 and not _has_ended(watcher):
        spin(0.05)
        launcher.poll()
        if time.monotonic() - watcher.heard > SILENCE:
            raise RuntimeError(f"the simulator has said nothing for {SILENCE:.0f} s; see {launcher.log_folder}")
    pid = next(state.pid for state in launcher.states() if state.name == "recorder")
    return watcher.stamp, processor_time(pid), time.monotonic()


def _has_ended(watcher: ComponentNode) -> bool:
    if isinstance(watcher, TrialWatcher):
        return watcher.truth is not None and bool(watcher.truth.outcome)
    return isinstance(watcher, MatchWatcher) and watcher.report.finished
