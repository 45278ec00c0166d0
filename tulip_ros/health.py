"""A node's health, published once a second on `diagnostics`, and at once when it gets worse."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from functools import cache
from importlib import metadata
from time import monotonic, process_time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from tulip_ros import topics
from tulip_ros.finding import Finding, Level, say, worst
from tulip_ros.heartbeat import beat
from tulip_ros.node_process import RESTARTS_VARIABLE
from tulip_ros.time import to_message
from tulip_ros.topics import Topic
from tulip_ros.watches import HOLD, InputWatch, StallWatch, TimeWatch

LOOK = 0.2  # [s] of wall-clock time between two looks: a stalled simulation must still show
LOG_PERIOD = 1.0  # [s] between two lines of the log about the same event
LOOKS = 5  # of which one is published in any case

Check = Callable[[], Finding | None]
"""Tells what is the matter right now, or None; asked once a second."""


class Health:
    """Watches what a node needs, counts what it does, and publishes both.

    The wall clock serves here alone: rates tell how the program runs, not how the robot moves.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = topics.DIAGNOSTICS.publish_from(node)
        self._inputs: dict[str, InputWatch] = {}
        self._checks: list[Check] = []
        self._found: list[Finding] = []  # by the checks and tallies of the last second
        self._events: Counter[str] = Counter()
        self._figures: dict[str, str] = {}
        self._due = False
        self._shown: dict[str, int] = {}
        self._warnings: dict[str, tuple[str, float]] = {}  # by event: words, and when they were last given [s]
        self._logged: dict[str, float] = {}  # when each event's warning was last written into the log [s]
        self._level = Level.OK
        self._looks = 0
        self._last = monotonic()
        self._processor_time = process_time()
        self._time = TimeWatch(self._last)
        self._stalls = StallWatch(self._last)
        self._timer = node.create_timer(LOOK, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def expect(self, topic: Topic) -> InputWatch:
        """Return the watch over a topic that the node listens to; who listens raises its count with each message."""
        watch = InputWatch(topic.name, topic.publishers, topic.rate, topic.missed_after, monotonic())
        return self._inputs.setdefault(topic.name, watch)

    def check(self, check: Check) -> None:
        """Have something asked once a second, before the health is published."""
        self._checks.append(check)

    def begin_anew(self) -> None:
        """Forget the stamps: time began anew."""
        for watch in self._inputs.values():
            watch.begin_anew()

    def show(self, figure: str, value: str) -> None:
        """Have a figure of another kind published beside the rates and counts, soon.

        Args:
            figure: A few fixed words, the key in the diagnostics, as in "recording".
            value: What it is now.
        """
        self._due |= self._figures.get(figure) != value
        self._figures[figure] = value

    def count(self, event: str, warning: str = "", times: int = 1) -> None:
        """Count an event.

        Args:
            event: A few fixed words, the key in the diagnostics, as in "rejected features".
            warning: What is wrong, in words: goes into the status, and into the log (an event once a second at most).
            times: How often it happened.
        """
        self._events[event] += times
        if warning:
            now = monotonic()
            self._warnings[event] = (warning, now)
            if now - self._logged.get(event, -LOG_PERIOD) >= LOG_PERIOD:
                self._logged[event] = now
                self._node.get_logger().warning(warning)

    def _look(self) -> None:
        now = monotonic()
        self._looks += 1
        due = self._looks % LOOKS == 1  # the first one, too: it tells that the node is there
        deaf = self._stalls.look(now, sum(watch.count for watch in self._inputs.values() if watch.regular))
        if due and deaf is None:
            beat()  # who hears nobody gives no sign of life, so that the launcher starts it again
        if due:
            asked = [check() for check in self._checks] + [watch.tally() for watch in self._inputs.values()]
            self._found = [finding for finding in asked if finding is not None]
        time = self._node.get_clock().now().nanoseconds
        watched = [self._time.look(now, time), *(watch.look(now, time) for watch in self._inputs.values())]
        findings = self._found + [finding for finding in (deaf, *watched) if finding is not None]
        self._warnings = {event: given for event, given in self._warnings.items() if now - given[1] < HOLD}
        findings += [Finding(Level.WARNING, words) for words, _ in self._warnings.values()]
        level = worst(findings)
        if due or self._due or level > self._level:
            self._publish(now, level, say(findings))
        self._level = level

    def _publish(self, now: float, level: Level, words: str) -> None:
        self._due = False
        elapsed, self._last = max(now - self._last, 1e-3), now
        busy, self._processor_time = process_time() - self._processor_time, process_time()
        values = {
            f"rate {name} [1/s]": f"{(watch.count - self._shown.get(name, 0)) / elapsed:.1f}"
            for name, watch in sorted(self._inputs.items())
        }
        self._shown = {name: watch.count for name, watch in self._inputs.items()}
        latencies = {name: watch.latency() for name, watch in sorted(self._inputs.items())}
        values |= {f"latency {name} [ms]": f"{1e3 * mean:.1f}" for name, mean in latencies.items() if mean is not None}
        values |= {event: str(count) for event, count in sorted(self._events.items())}
        values |= self._figures | {"processor [%]": f"{100.0 * busy / elapsed:.1f}", "version": version()}
        if RESTARTS_VARIABLE in os.environ:
            values["restarts"] = os.environ[RESTARTS_VARIABLE]
        if self._time.jumps:
            values["jumps of the clock"] = str(self._time.jumps)
        status = DiagnosticStatus(
            level=bytes([level]),
            name=self._node.get_name(),
            message=words or "running",
            hardware_id=self._node.get_namespace(),
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = to_message(max((watch.stamp for watch in self._inputs.values()), default=0))
        self._publisher.publish(message)


@cache
def version() -> str:
    """Return the project's version as installed, or "unknown" where the packages only lie in the path."""
    try:
        return metadata.version("tulip-soccer")
    except metadata.PackageNotFoundError:
        return "unknown"
