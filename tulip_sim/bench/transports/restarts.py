"""A node is killed and at once started again: when is it in the graph, and when do its topics flow again?

Beside a body without physics and motion control, node `head` answers joint states with joint commands: they flow when
the new process hears the driver, and is heard itself. Node `user_input` has a latched topic.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
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
MOMENTS = ("joined", "matched", "flowing")
"""Its sockets are open; others have its topic in their graph; the first message of the new process comes."""
KILLED = {"head": topics.HEAD_JOINT_COMMAND, "user_input": topics.USER_COMMAND}


def measure() -> Row:
    """Kill each node several times; return the times [s] of each of `MOMENTS` since the kill.

    Raises:
        RuntimeError: if a node does not come.
    """
    row: Row = {}
    with (
        tempfile.TemporaryDirectory(prefix="tulip_log_") as scratch,
        Launcher(make_plan(["motion"], "echo")),
        session(lambda: ComponentNode("watcher"), arguments=[], handle_signals=False) as (watcher, spin),
    ):
        for start in make_plan(list(KILLED), None):
            times = _kill(start, Path(scratch), watcher, spin)
            row |= {f"{start.name} {what} [s]": [each[column] for each in times] for column, what in enumerate(MOMENTS)}
    return row


def _kill(start: Start, folder: Path, watcher: ComponentNode, spin: Callable[[float], None]) -> list[tuple[float, ...]]:
    topic = KILLED[start.name]
    came: list[float] = []
    topic.subscribe_from(watcher, lambda _: came.append(time.monotonic()), raw=True)
    command = start.command(folder / f"{start.name}.yaml")
    times = []
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
            _wait(partial(_has_sockets, process.pid), spin, topic)
            joined = time.monotonic()
            _wait(partial(_is_new, watcher, topic, before), spin, topic)
            matched = time.monotonic()
            _wait(partial(_came, came, killed + OLD), spin, topic)
            flowing = next(moment for moment in came if moment > killed + OLD)
            times.append(tuple(round(moment - killed, 3) for moment in (joined, matched, flowing)))
    finally:
        process.kill()
        process.wait()
    return times


def _has_sockets(pid: int) -> bool:
    for path in Path(f"/proc/{pid}/fd").glob("*"):
        with suppress(FileNotFoundError):  # closed meanwhile
            if path.readlink().name.startswith("socket:"):
                return True
    return False


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
