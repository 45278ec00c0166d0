"""Pictures of 640x480 in colour, 30 a second, from one node to two others, one of which is then killed."""

from __future__ import annotations

import array
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from sensor_msgs.msg import Image

from tulip_ros import topics
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import header, stamp_of
from tulip_sim.bench.processor_time import processor_time
from tulip_sim.bench.runner import Row

WIDTH, HEIGHT = 640, 480
PERIOD = 1.0 / 30.0  # [s]
SETTLE, STEADY, AFTER = 2.0, 8.0, 5.0  # [s] before it is measured; with both receivers; after one was killed
ON_ITS_WAY = 0.1  # [s] before the kill: such a picture may be hit by it
PATIENCE = 60.0  # [s]


def measure() -> Row:
    """Send pictures; return latencies [ms], processor time [core], and what a kill does.

    Raises:
        RuntimeError: if the nodes do not find each other.
    """
    sender, receiver, victim = (_start(role) for role in ("send", "receive", "receive"))
    both = sender.pid, receiver.pid
    try:
        for process in (receiver, victim):
            if _line(process) != "receives":
                raise RuntimeError("no picture came")
        time.sleep(SETTLE)
        begin, before = time.monotonic(), [processor_time(pid) for pid in both]
        time.sleep(STEADY)
        killed = time.monotonic()
        spent = [processor_time(pid) - earlier for pid, earlier in zip(both, before, strict=True)]
        victim.kill()
        victim.wait()
        time.sleep(AFTER)
        end = time.monotonic()
        received, sent = (np.array(_ask(process)).reshape(-1, 2) for process in (receiver, sender))
    finally:
        for process in (sender, receiver, victim):
            process.kill()
            process.wait()
    row: Row = {}
    for name, first, last in (("", begin, killed - ON_ITS_WAY), (" after the kill", killed - ON_ITS_WAY, end - 1.0)):
        out = sent[(sent[:, 0] >= first) & (sent[:, 0] < last)]
        came = received[np.isin(received[:, 0], out[:, 0])]
        late = 1e3 * (came[:, 1] - came[:, 0])
        row |= {
            f"sent{name}": len(out),
            f"lost{name}": len(out) - len(came),
            f"median{name} [ms]": round(float(np.median(late)), 2),
            f"99 %{name} [ms]": round(float(np.percentile(late, 99)), 2),
            f"most{name} [ms]": round(float(late.max()), 1),
            f"longest sending{name} [ms]": round(1e3 * float(out[:, 1].max()), 1),
        }
    cores = [round(each / (killed - begin), 3) for each in spent]
    return {**row, "sender [core]": cores[0], "receiver [core]": cores[1]}


def _start(role: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", __name__, role]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def _line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def _ask(process: subprocess.Popen[str]) -> Any:
    """Have a node end, and return what it noted."""
    said, _ = process.communicate("\n", PATIENCE)
    return json.loads(said)


def _send() -> None:
    """Send until standard input says something; then tell when each picture was sent, and how long that took [s]."""
    notes: list[tuple[float, float]] = []
    told = _told()
    data = array.array("B", np.random.default_rng(1).integers(0, 256, WIDTH * HEIGHT * 3, np.uint8).tobytes())
    picture = Image(height=HEIGHT, width=WIDTH, encoding="bgr8", step=3 * WIDTH, data=data)
    with session(lambda: ComponentNode("sender"), [], handle_signals=False) as (node, spin):
        publisher = node.sender(topics.CAMERA_IMAGE)
        while publisher.get_subscription_count() < 2:
            spin(0.02)
        due = time.monotonic()
        while not told():
            spin(0.0)
            time.sleep(max(0.0, due - time.monotonic()))
            due += PERIOD
            stamp = time.monotonic_ns()
            picture.header = header(stamp)
            publisher.publish(picture)
            notes.append((stamp * 1e-9, time.monotonic() - stamp * 1e-9))
    print(json.dumps(notes))


def _receive() -> None:
    """Receive until standard input says something; then tell when each picture was sent, and when it came [s]."""
    notes: list[tuple[float, float]] = []
    told = _told()

    def on_picture(picture: Image) -> None:
        notes.append((stamp_of(picture) * 1e-9, time.monotonic()))
        if len(notes) == 1:
            print("receives", flush=True)

    name = f"receiver_{time.monotonic_ns()}"
    with session(lambda: ComponentNode(name), [], handle_signals=False) as (node, spin):
        node.listen(topics.CAMERA_IMAGE, on_picture)
        while not told():
            spin(0.05)
    print(json.dumps(notes))


def _told() -> Callable[[], bool]:
    """Return what says whether standard input has said something."""
    told = threading.Event()

    def listen() -> None:
        sys.stdin.readline()
        told.set()

    threading.Thread(target=listen, daemon=True).start()
    return told.is_set


if __name__ == "__main__":
    {"send": _send, "receive": _receive}[sys.argv[1]]()
