"""The recorder is killed at a random moment, again and again: what is in the file afterwards?

A publisher sends numbered messages as a match does: four topics at 250 Hz, pictures as JPEG at 15 Hz. An independent
subscriber (rclpy, not raw, in this process) notes each message, whose stamp tells by the same clock when it was sent.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message

from tulip_ros import topics, transport
from tulip_ros.recovery import recover
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import stamp_of
from tulip_ros.topics import Topic
from tulip_sim.bench.runner import Row

TOPICS = (
    topics.JOINT_STATES,
    topics.IMU,
    topics.FOOT_FORCES,
    topics.LEG_COMMAND,
    topics.CAMERA_COMPRESSED,
    topics.GAME_STATE,
)
EARLIEST, LATEST = 1.5, 4.0  # [s] after the first message, when the recorder is killed
PATIENCE = 40.0  # [s] until all programs must be there
PUBLISHER = """
import array, random, sys, time
from tulip_ros import topics
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import header
from tulip_sim.bench.log_kill import TOPICS

with session(lambda: ComponentNode("sender"), []) as (node, spin):
    senders = [node.sender(topic) for topic in TOPICS]
    while not all(sender.get_subscription_count() == 2 for sender in senders):
        spin(0.02)
    spin(0.5)
    rng, begin, tick = random.Random(1), time.monotonic(), 0
    senders[5].publish(topics.GAME_STATE.message(header=header(time.time_ns()), version=7))
    while True:
        tick += 1
        for topic, sender in zip(TOPICS[:4], senders):
            sender.publish(topic.message(header=header(time.time_ns())))
        if tick % 16 == 0:
            picture = topics.CAMERA_COMPRESSED.message(header=header(time.time_ns()), format="jpeg")
            picture.data = array.array("B", rng.randbytes(40_000))
            senders[4].publish(picture)
        time.sleep(max(0.0, begin + tick * 0.004 - time.monotonic()))
"""


class Witness(ComponentNode):
    """Notes what is sent."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__("witness")
        self.seen: dict[str, list[tuple[int, Any]]] = {}
        for topic in TOPICS:
            self.listen(topic, self._noting(topic), depth=1000)

    def _noting(self, topic: Topic) -> Callable[[Any], None]:
        entries = self.seen.setdefault(f"/{topic.name}", [])
        return lambda message: entries.append((stamp_of(message), message))


def measure(number: int) -> Row:
    """Kill a recorder once, recover its file, and compare it with what the witness saw.

    Raises:
        RuntimeError: if the programs do not come up.
    """
    rng = np.random.default_rng(number)
    after = float(rng.uniform(EARLIEST, LATEST))
    with tempfile.TemporaryDirectory(prefix="tulip_log_") as scratch:
        folder = Path(scratch) / "killed"
        arguments = ["--ros-args", "-p", f"path:={folder}", "-p", "exclude:=['.*rosout', '.*diagnostics']"]
        arguments += ["-p", "picture_rate:=0.0"]
        recorder = subprocess.Popen([sys.executable, "-m", "tulip_ros.recorder_node", *arguments])
        sender = subprocess.Popen([sys.executable, "-c", PUBLISHER])
        try:
            with session(Witness, [], handle_signals=False) as (witness, spin):
                seen = witness.seen
                end = time.monotonic() + PATIENCE
                while not seen["/joint_states"]:
                    spin(0.02)
                    if time.monotonic() > end:
                        raise RuntimeError(f"no message within {PATIENCE:.0f} s")
                end = time.monotonic() + after
                while time.monotonic() < end:
                    spin(0.02)
                killed = time.time_ns()
                recorder.send_signal(signal.SIGKILL)
                recorder.wait()
                end = time.monotonic() + 0.3
                while time.monotonic() < end:
                    spin(0.02)
        finally:
            for process in (recorder, sender):
                process.kill()
                process.wait()
            transport.remove_leftovers()
        result = recover(folder)
        assert result.output is not None
        return {"part": "kill", "number": number, "after [s]": round(after, 3), **_compare(result.output, seen, killed)}


def _compare(output: Path, seen: dict[str, list[tuple[int, Any]]], killed: int) -> Row:
    """Compare what rosbags reads with what was sent."""
    from rosbags.highlevel import AnyReader

    classes = {f"/{topic.name}": topic.message for topic in TOPICS}
    read: dict[str, list[Any]] = {}
    with AnyReader([output]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)  # the other program can decode it, too
            message = deserialize_message(bytes(data), classes[connection.topic])
            read.setdefault(connection.topic, []).append(message)
    equal, first_missing = True, killed
    for name, entries in seen.items():
        saved = read.get(name, [])
        equal = equal and saved == [message for _, message in entries[: len(saved)]]
        if len(saved) < len(entries):
            first_missing = min(first_missing, entries[len(saved)][0])
    return {
        "saved": sum(map(len, read.values())),
        "sent before": sum(sent < killed for entries in seen.values() for sent, _ in entries),
        "lost [s]": round((killed - first_missing) * 1e-9, 3),
        "equal": equal,
    }
