"""Programs that only look give way."""

from __future__ import annotations

import os
import subprocess
import sys

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
print(os.getpriority(os.PRIO_PROCESS, 0), *inherited)
print(group.read_text() if group.exists() else "")
"""


def priorities(own_session: bool) -> tuple[list[int], str]:
    """Return the priorities of a program that gives way and of a thread that it began then, and its session's line."""
    command = [sys.executable, "-c", PROGRAM]
    run = subprocess.run(command, start_new_session=own_session, stdout=subprocess.PIPE, text=True, check=True)
    own, session = run.stdout.split("\n", 1)
    return [int(word) for word in own.split()], session.strip()


def test_its_threads_have_the_lower_priority_too() -> None:
    expected = max(NICE, os.getpriority(os.PRIO_PROCESS, 0))
    assert priorities(own_session=True)[0] == [expected, expected]


@pytest.mark.skipif(not GROUP.exists(), reason="this system does not weigh sessions against each other")
def test_a_session_of_its_own_gives_way_as_a_whole_and_one_of_a_users_terminal_does_not() -> None:
    before = GROUP.read_text().strip()
    assert priorities(own_session=False)[1] == before
    session = priorities(own_session=True)[1]
    if not session:  # the file is there, but this kernel gave the new session no group
        pytest.skip("this system does not weigh a new session against others")
    assert session.endswith(f"nice {NICE}")
