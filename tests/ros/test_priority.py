"""Programs that only look give way."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tulip_ros.priority import GROUP, NICE

PROGRAM = """
import os
from pathlib import Path
from threading import Thread
from tulip_ros.priority import give_way
give_way()
inherited = []
Thread(target=lambda: inherited.append(os.getpriority(os.PRIO_PROCESS, 0))).start()
group = Path("/proc/self/autogroup")
print(os.getpriority(os.PRIO_PROCESS, 0), *inherited, *(group.read_text().split("nice")[1:] if group.exists() else []))
"""


def priorities(own_session: bool) -> list[int]:
    """Return the priority of a program that gives way, of a thread that it began then, and of its session."""
    command = [sys.executable, "-c", PROGRAM]
    run = subprocess.run(command, start_new_session=own_session, stdout=subprocess.PIPE, text=True, check=True)
    return [int(word) for word in run.stdout.split()]


def test_its_threads_have_the_lower_priority_too() -> None:
    expected = max(NICE, os.getpriority(os.PRIO_PROCESS, 0))
    assert priorities(own_session=True)[:2] == [expected, expected]


@pytest.mark.skipif(not GROUP.exists(), reason="this system does not weigh sessions against each other")
def test_a_session_of_its_own_gives_way_as_a_whole_and_one_of_a_users_terminal_does_not() -> None:
    before = int(Path("/proc/self/autogroup").read_text().split("nice")[1])
    assert priorities(own_session=True)[2] == NICE
    assert priorities(own_session=False)[2] == before
