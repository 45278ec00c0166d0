"""Stamps that jump back."""

from __future__ import annotations

from tulip_ros.timeline import JUMP, Arrival, Timeline

SECOND = 1_000_000_000


def test_time_begins_anew_once_for_all_topics() -> None:
    times = Timeline()
    for stamp in (0, 4_000_000, 30 * SECOND):
        assert times.see("joints", stamp) is times.see("imu", stamp) is Arrival.CURRENT
    assert times.see("imu", 0) is Arrival.ANEW
    assert times.see("joints", 0) is Arrival.CURRENT
    assert times.see("imu", 4_000_000) is times.see("joints", 4_000_000) is Arrival.CURRENT
    times.see("imu", 20 * SECOND)
    assert times.see("imu", 0) is Arrival.ANEW  # and again


def test_messages_that_were_overtaken_are_old() -> None:
    times = Timeline()
    for name in ("joints", "odometry"):
        times.see(name, 30 * SECOND)
    assert times.see("joints", 0) is Arrival.ANEW
    assert times.see("odometry", 30 * SECOND + 20_000_000) is Arrival.OLD
    assert times.see("odometry", 20_000_000) is Arrival.CURRENT
    assert times.see("odometry", 5 * SECOND) is Arrival.CURRENT  # a topic heard anew may run ahead


def test_a_topic_silent_during_the_jump_is_heard_later() -> None:
    times = Timeline()
    times.see("joints", 30 * SECOND)
    times.see("walk", 2 * SECOND)
    assert times.see("joints", 0) is Arrival.ANEW
    times.see("joints", 10 * SECOND)
    assert times.see("walk", 10 * SECOND + JUMP) is Arrival.CURRENT


def test_small_steps_back_are_no_new_beginning() -> None:
    times = Timeline()
    times.see("features", SECOND)
    assert times.see("features", SECOND - JUMP) is Arrival.CURRENT
    assert times.see("features", SECOND - 2 * JUMP - 1) is Arrival.ANEW
