"""Ctrl-C in the middle of a trial."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import match
import pytest
from graph_trial import free_port, left_in_shared_memory, shared_memory
from mcap.exceptions import McapError
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from rosbags.highlevel import AnyReader

pytestmark = [pytest.mark.ros, pytest.mark.sim, pytest.mark.slow, pytest.mark.usefixtures("ros_domain")]

MARK = "TULIP_TEST_INTERRUPT"
TOPICS = {"/joint_states", "/world_state", "/camera/image_raw/compressed"}
PLAYED = 500  # messages in the recording after which the trial is certainly under way
WAIT = 90.0  # [s] of wall-clock time for that
ENDING = 20.0  # [s] of wall-clock time for the end, which takes 1 s


def marked(mark: str) -> list[str]:
    """Return the command lines of living processes whose environment holds a mark."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if f"{MARK}={mark}".encode() in (folder / "environ").read_bytes():
                found.append((folder / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            continue  # ended, or another user's
    return found


def under_way(recording: Path) -> bool:
    """Return whether a recording that is still being written holds every component's topics and PLAYED messages."""
    names: dict[int, str] = {}
    heard: set[str] = set()
    messages = 0
    try:
        with recording.open("rb") as stream:
            for record in StreamReader(stream).records:
                if isinstance(record, Channel):
                    names[record.id] = record.topic
                elif isinstance(record, Message):
                    heard.add(names[record.channel_id])
                    messages += 1
    except (OSError, McapError):
        pass  # not begun yet, or its last chunk is not all there
    return heard >= TOPICS and messages > PLAYED


@pytest.mark.parametrize(("mode", "processes"), [("graph", 10), ("lockstep", 1)])
def test_ctrl_c_ends_the_trial_and_keeps_its_recording(mode: str, processes: int, tmp_path: Path) -> None:
    before = shared_memory()
    record = tmp_path / "bag"
    options = ["--mode", mode, "--record", str(record), "--referee-port", str(free_port())]
    trial = subprocess.Popen(
        [sys.executable, match.__file__, *options],
        env={**os.environ, "TULIP_NO_VENV": "1", MARK: str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    file, deadline = record / "bag.mcap", time.monotonic() + WAIT
    while not under_way(file) and trial.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.3)
    assert len(marked(str(tmp_path))) >= processes
    os.killpg(trial.pid, signal.SIGINT)  # as the terminal does
    output, errors = trial.communicate(timeout=ENDING)
    assert trial.returncode == match.INTERRUPTED
    assert output.strip() == ""
    assert errors == f"stopped; {record} holds what was played\n"
    assert marked(str(tmp_path)) == []
    assert left_in_shared_memory(before) == set()
    with AnyReader([record]) as reader:
        assert set(reader.topics) >= TOPICS
        read = sum(1 for connection, _, raw in reader.messages() if reader.deserialize(raw, connection.msgtype))
        assert read == reader.message_count > PLAYED
