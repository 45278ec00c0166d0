"""What a node tells of its health."""

from __future__ import annotations

from time import monotonic

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from tulip_ros import topics
from tulip_ros.finding import Level
from tulip_ros.run import ComponentNode, session

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]


def test_a_warning_is_told_though_another_follows_at_once_and_only_the_last_words_of_each_event() -> None:
    heard: list[DiagnosticArray] = []
    with session(lambda: ComponentNode("node"), [], handle_signals=False) as (node, spin):
        topics.DIAGNOSTICS.subscribe_from(node, heard.append)
        end = monotonic() + 20.0
        while not heard and monotonic() < end:
            spin(0.05)
        node.health.count("refused walk command", "old words: ask again")
        node.health.count("refused walk command", "wrong mode: send another")
        node.health.count("refused kick", "no ball: wait for it")
        while not (heard and heard[-1].status[0].level[0] == Level.WARNING) and monotonic() < end:
            spin(0.05)
    words = heard[-1].status[0].message
    assert "wrong mode: send another" in words and "no ball: wait for it" in words
    assert "old words" not in words
