"""A node is killed and at once started again: when is it in the graph, and when do its topics flow again?

Beside a body without physics and motion control, node `head` answers joint states with joint commands: they flow when
the new process hears the driver, and is heard itself. Node `user_input` has a latched topic.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from tulip_ros import topics
from tulip_ros.launch import Launcher
from tulip_ros.plan import Start, make_plan
from tulip_ros.run import ComponentNode, session
from tulip_ros.topics import Topic
from tulip_sim.bench.runner import Row

KILLS = 4  # of each node
BETWEEN = 1.0  # [s] between two kills
OLD = 0.1  # [s] after a kill in which messages may still be the dead process's; a new one takes longer to start
PATIENCE = 60.0  # [s]
KILLED = {"head": topics.HEAD_JOINT_COMMAND, "user_input": topics.USER_COMMAND}


def measure() -> Row:
    """Kill each node several times; return the times [s] since the kill.

    Raises:
        RuntimeError: if a node does not come.
    """
    begin = time.monotonic()
    subprocess.run([sys.executable, "-c", "import tulip_motion.head_node"], check=True)
    row: Row = {"start of Python [s]": round(time.monotonic() - begin, 3)}
    with (
        tempfile.TemporaryDirectory(prefix="tulip_log_") as scratch,
        Launcher(make_plan(["motion"], "echo")),
        session(lambda: ComponentNode("watcher"), arguments=[], handle_signals=False) as (watcher, spin),
    ):
        for start in make_plan(list(KILLED), None):
            matched, flowing = _kill(start, Path(scratch), watcher, spin)
            row |= {f"{start.name} matched [s]": matched, f"{start.name} flowing [s]": flowing}
    return row


def _kill(
    start: Start, folder: Path, watcher: ComponentNode, spin: Callable[[float], None]
) -> tuple[list[float], list[float]]:
    topic = KILLED[start.name]
    came: list[float] = []
    topic.subscribe_from(watcher, lambda _: came.append(time.monotonic()), raw=True)
    command = start.command(folder / f"{start.name}.yaml")
    matched, flowing = [], []
    process = subprocess.Popen(command)
    try:
        _wait(lambda: came, spin, topic)
        for _ in range(KILLS):
            end = time.monotonic() + BETWEEN
            while time.monotonic() < end:
                spin(0.05)
            before = _publishers(watcher, topic)
            killed = time.monotonic()
            process.kill()
            process.wait()
            process = subprocess.Popen(command)
            _wait(partial(_is_new, watcher, topic, before), spin, topic)
            matched.append(round(time.monotonic() - killed, 3))
            _wait(partial(_came, came, killed + OLD), spin, topic)
            flowing.append(round(next(moment for moment in came if moment > killed + OLD) - killed, 3))
    finally:
        process.kill()
        process.wait()
    return matched, flowing


def _is_new(watcher: ComponentNode, topic: Topic, before: set[tuple[int, ...]]) -> bool:
    return bool(_publishers(watcher, topic) - before)


def _came(moments: list[float], after: float) -> bool:
    return moments[-1] > after


def _publishers(watcher: ComponentNode, topic: Topic) -> set[tuple[int, ...]]:
    """Return the ids of those who publish a topic, as far as the watcher knows."""
    return {tuple(each.endpoint_gid) for each in watcher.get_publishers_info_by_topic(f"/{topic.name}")}


def _wait(holds: Callable[[], Any], spin: Callable[[float], None], topic: Topic) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        spin(0.005)
        if time.monotonic() > end:
            raise RuntimeError(f"nobody publishes {topic.name} within {PATIENCE:.0f} s")
