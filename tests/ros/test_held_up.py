"""Nodes that are held up for some seconds: nobody forgets them."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tulip_ros import topics
from tulip_ros.launch import HUNG, Launcher
from tulip_ros.plan import make_plan
from tulip_ros.run import ComponentNode, session
from tulip_ros.transport import profile_path

NODES = ["user_input", "game_input"]
HELD_UP = 6.0  # [s], less than the launcher's patience
WAIT = 60.0  # [s] of wall-clock time at most


@pytest.mark.parametrize("name", ["shared_memory", "udp"])
def test_who_is_silent_is_killed_before_the_others_forget_it(name: str) -> None:
    durations = [each for each in ElementTree.parse(profile_path(name)).iter() if each.tag.endswith("}leaseDuration")]
    assert [float(each[0].text or 0.0) for each in durations] == [2.0 * HUNG]


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.usefixtures("ros_domain")
def test_nodes_held_up_in_turn_are_known_and_heard_afterwards(tmp_path: Path) -> None:
    heard: list[str] = []
    with Launcher(make_plan(NODES, None), tmp_path) as launcher:
        with session(lambda: ComponentNode("listener"), [], handle_signals=False) as (node, spin):
            node.listen(topics.DIAGNOSTICS, lambda message: heard.extend(status.name for status in message.status))

            def names() -> set[str]:
                return set(node.get_node_names())

            def until(condition: Callable[[], object]) -> None:
                end = time.monotonic() + WAIT
                while not condition():
                    assert launcher.poll() == []
                    assert time.monotonic() < end
                    spin(0.02)

            until(lambda: names() >= set(NODES) and set(heard) >= set(NODES))
            for state in launcher.states():
                os.kill(state.pid, signal.SIGSTOP)
                end = time.monotonic() + HELD_UP
                until(lambda end=end: time.monotonic() > end)
                assert names() >= set(NODES)
                os.kill(state.pid, signal.SIGCONT)
            heard.clear()
            until(lambda: set(heard) >= set(NODES))
            assert names() >= set(NODES)
