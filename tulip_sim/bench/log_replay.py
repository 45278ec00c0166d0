"""How late a replay is: a recording is played to its topics and recorded again by another process.

The middleware itself notes when it received each message; by that the recorder's own work cannot show.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tulip_ros import transport
from tulip_ros.log_file import Log
from tulip_sim.bench.runner import Row
from tulip_sim.lockstep import Settings
from tulip_sim.match_lockstep import play_lockstep

PLAYED = 15.0  # [s]
PATIENCE = 20.0  # [s] until a process must have ended
READY = 6.0  # [s] that programs have to start, and to find each other


def measure(rate: float) -> Row:
    """Replay a trial's beginning and compare the times between messages.

    Args:
        rate: Times the recorded speed.

    Raises:
        subprocess.TimeoutExpired: if a program does not end.
    """
    with tempfile.TemporaryDirectory(prefix="tulip_log_") as scratch:
        recorded, again = Path(scratch) / "recorded", Path(scratch) / "again"
        play_lockstep(1, settings=Settings(), record=recorded, eyes_beside=True)
        recorder = _run("recorder_node", path=again, exclude="['.*rosout', '.*diagnostics']", picture_rate=0.0)
        replay = _run("replay_node", file=recorded, rate=rate, duration=PLAYED * rate, delay=READY)
        try:
            time.sleep(2.0 * READY + PLAYED)
            for process in (replay, recorder):
                process.send_signal(signal.SIGINT)
                process.wait(PATIENCE)
        finally:
            for process in (replay, recorder):
                process.kill()
                process.wait()
            transport.remove_leftovers()
        with Log(recorded) as log:
            expected = _times(log, log.span[0] + round(PLAYED * rate * 1e9))
        with Log(again) as log:
            came = _times(log, None)
    offsets = [(came[name][: len(times)] - times / rate) for name, times in expected.items() if name in came]
    late = np.concatenate(offsets)
    late = np.abs(late - np.median(late)) * 1e-6
    return {
        "part": "replay",
        "rate": rate,
        "messages": sum(map(len, expected.values())),
        "arrived": sum(min(len(times), len(came.get(name, ()))) for name, times in expected.items()),
        "median [ms]": round(float(np.median(late)), 3),
        "99 % [ms]": round(float(np.percentile(late, 99.0)), 2),
        "greatest [ms]": round(float(late.max()), 1),
    }


def _run(module: str, **parameters: object) -> subprocess.Popen[bytes]:
    given = [part for name, value in parameters.items() for part in ("-p", f"{name}:={value}")]
    return subprocess.Popen([sys.executable, "-m", f"tulip_ros.{module}", "--ros-args", *given])


def _times(log: Log, end: int | None) -> dict[str, NDArray[np.float64]]:
    """Return the log times [ns] of each topic's messages, after those of latched topics at the beginning."""
    found: dict[str, list[int]] = {}
    for record in log.records(None, None, end):
        if "transient_local" not in record.topic.quality and record.topic.name != "/clock":
            found.setdefault(record.topic.name, []).append(record.log_time)
    return {name: np.array(times, dtype=np.float64) for name, times in found.items()}
