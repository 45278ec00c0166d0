"""Matches in lockstep, one after the other in this process, and what it holds meanwhile."""

from __future__ import annotations

import gc
import os
import time
from functools import cache
from pathlib import Path

from tulip_sim.bench.soaking import samples
from tulip_sim.bench.soaking.resources import resources, shared_memory_files
from tulip_sim.bench.soaking.samples import SIMULATED, Sample
from tulip_sim.match_settings import MatchSettings
from tulip_sim.match_summary import MatchSummary
from tulip_sim.play_lockstep_match import play_lockstep_match

MODE = "lockstep"
PERIOD = 60.0  # [s] of simulated time between two samples
SEED, ENDED = "seed", "ended"
SHARED, OBJECTS = "files in shared memory", "Python objects"
PROCESSOR, WALL = "processor time by simulated time", "wall time by simulated time"


def play_until(folder: Path, target: float, settings: MatchSettings) -> None:
    """Play whole matches until a folder holds so much of them.

    Args:
        folder: Of the samples. What earlier processes left there counts.
        target: Simulated time [s].
        settings: Of each match.
    """
    while sum(segment.duration for segment in samples.read(folder, MODE)) < target:
        seeds = [sample[SEED] for segment in samples.read(folder, MODE) for sample in segment.samples]
        watch = _of_this_process(folder)
        watch.seed = max(seeds, default=0) + 1
        watch.end(play_lockstep_match(watch.seed, settings, progress=watch.look))


class _Watch:
    """Takes samples of this process while it plays."""

    def __init__(self, folder: Path) -> None:
        self.seed = 0
        self._file = samples.new_segment(folder, MODE)
        self._before = 0.0  # [s] simulated in the matches that ended
        self._last = (0.0, time.process_time(), time.monotonic())

    def look(self, simulated: float, doing: str) -> None:
        """Take a sample if it is time; told once in a simulated second of a match."""
        if self._before + simulated - self._last[0] >= PERIOD:
            self._take(self._before + simulated)

    def end(self, match: MatchSummary) -> None:
        """Keep how a match ended."""
        self._before += match.duration
        trials = match.report.trials
        self._take(
            self._before,
            {
                "result": match.report.verdict,
                "trials": len(trials),
                "goals": sum(trial.result == "goal" for trial in trials),
                "falls": match.falls,
                "removals": match.removals,
            },
        )

    def _take(self, simulated: float, ended: Sample | None = None) -> None:
        sample: Sample = {
            SIMULATED: round(simulated, 3),
            SEED: self.seed,
            **resources(os.getpid()),
            OBJECTS: len(gc.get_objects()),
            SHARED: shared_memory_files([os.getpid()]),
        }
        played = simulated - self._last[0]
        if played >= 0.5 * PERIOD:  # of less, as at the end of a match, the cost says little
            sample[PROCESSOR] = round((time.process_time() - self._last[1]) / played, 4)
            sample[WALL] = round((time.monotonic() - self._last[2]) / played, 4)
            self._last = (simulated, time.process_time(), time.monotonic())
        samples.add(self._file, sample | ({} if ended is None else {ENDED: ended}))


@cache
def _of_this_process(folder: Path) -> _Watch:
    return _Watch(folder)
