"""One long match of two robots as a graph of processes, and what each of them holds meanwhile."""

from __future__ import annotations

import contextlib
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray

from tulip_msgs.msg import WorldState
from tulip_ros import topics
from tulip_ros.aggregation import by_topic
from tulip_ros.launch import Launcher
from tulip_ros.monitor import report_from_status
from tulip_ros.run import session
from tulip_ros.time import from_message, stamp_of
from tulip_sim.bench.free_port import free_port, own_domain
from tulip_sim.bench.processor_time import processor_time
from tulip_sim.bench.soaking import samples
from tulip_sim.bench.soaking.resources import resources, shared_memory_files
from tulip_sim.bench.soaking.samples import SIMULATED, Sample
from tulip_sim.match_graph import LOOK
from tulip_sim.match_rules import NAMESPACES, MatchRules
from tulip_sim.match_two_graph import MatchWatcher, match_plan

MODE = "graph"
SILENCE = 300.0  # [s] of wall-clock time without news from the simulator: other programs may have the machine a while
PERIOD = 20.0  # [s] of simulated time between two samples
ENDLESS = MatchRules(trials=1000, extra_pairs=0)
NODES, WHOLE, EVENTS = "nodes", "whole", "events"
SERVICE, PROCESSOR = "time over a message [ms]", "processor time by simulated time"
PICTURE, FACTOR, SHARED = "from picture to world state [ms]", "real-time factor", "files in shared memory"


class SoakWatcher(MatchWatcher):
    """Notes how long nodes take over their messages, and how old the pictures are that a world state knows."""

    def __init__(self) -> None:
        """Connect."""
        self._known: dict[int, int] = {}
        self.served: defaultdict[str, list[float]] = defaultdict(list)
        """Of each node, since they were last taken: mean time over a message in each second [ms]."""
        self.pictures: list[float] = []
        """Since they were last taken: from the shutter to the first world state that knows it, simulated time [ms]."""
        super().__init__()
        for namespace in ("", *NAMESPACES):
            topics.DIAGNOSTICS.within(namespace).subscribe_from(self, partial(self._on_diagnostics, namespace))

    def _on_diagnostics(self, namespace: str, message: DiagnosticArray) -> None:
        for status in message.status:
            values = report_from_status(status).values
            rates, latencies = by_topic(values, "rate"), by_topic(values, "latency")
            messages = sum(rates[topic] for topic in latencies)
            if messages > 0.0:
                name = f"{namespace}/{status.name}" if namespace else status.name
                self.served[name].append(sum(rates[each] * latencies[each] for each in latencies) / messages)

    def _estimate_of(self, team: int) -> Callable[[WorldState], None]:
        follow = super()._estimate_of(team)

        def on_estimate(message: WorldState) -> None:
            follow(message)
            picture = from_message(message.picture)
            if picture > self._known.get(team, 0):
                self.pictures.append((stamp_of(message) - picture) * 1e-6)
            self._known[team] = picture

        return on_estimate


def play(folder: Path, seconds: float, seed: int = 1) -> None:
    """Play for so much simulated time [s], and keep samples in a folder.

    Raises:
        RuntimeError: if the simulator falls silent.
    """
    own_domain()
    plan = match_plan(seed, ENDLESS, referee_ports=(free_port(), free_port()))
    file = samples.new_segment(folder, MODE)
    with (
        Launcher(plan) as launcher,
        session(SoakWatcher, arguments=[], handle_signals=False) as (watcher, spin),
    ):
        events: list[str] = []
        last = (0.0, time.monotonic(), dict[int, float]())
        while last[0] < seconds:
            spin(LOOK)
            events += launcher.poll()
            if time.monotonic() - watcher.heard > SILENCE:
                raise RuntimeError(f"the simulator has said nothing for {SILENCE:.0f} s; see {launcher.log_folder}")
            now = watcher.stamp * 1e-9
            if now - last[0] < PERIOD:
                continue
            pids = {
                f"{state.namespace}/{state.name}" if state.namespace else state.name: state.pid
                for state in launcher.states()
                if state.pid
            }
            period, moment = now - last[0], time.monotonic()
            nodes: dict[str, Sample] = {}
            spent: dict[int, float] = {}
            for name, pid in pids.items():
                with contextlib.suppress(OSError):  # it has ended this moment; the launcher tells
                    nodes[name], spent[pid] = resources(pid), processor_time(pid)
                    if pid in last[2]:
                        nodes[name][PROCESSOR] = round((spent[pid] - last[2][pid]) / period, 4)
                    if watcher.served[name]:
                        nodes[name][SERVICE] = round(float(np.mean(watcher.served[name])), 4)
            whole: Sample = {SHARED: shared_memory_files(list(pids.values())), FACTOR: period / (moment - last[1])}
            if watcher.pictures:
                whole[PICTURE] = round(float(np.mean(watcher.pictures)), 2)
            samples.add(file, {SIMULATED: now, WHOLE: whole, NODES: nodes, EVENTS: events})
            watcher.served.clear()
            watcher.pictures.clear()
            events, last = [], (now, time.monotonic(), spent)
