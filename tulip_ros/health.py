"""A node's health, published once a second on `diagnostics`."""

from __future__ import annotations

from collections import Counter
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from tulip_ros import topics
from tulip_ros.time import to_message

PERIOD = 1.0  # [s] of wall-clock time: a stalled simulation must still show
WARNING_HOLDS = 5.0  # [s] a warning stays in the status, so that a person sees it


class Health:
    """Counts what a node does and publishes it.

    The wall clock serves here alone: rates tell how the program runs, not how the robot moves.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = topics.DIAGNOSTICS.publish_from(node)
        self._inputs: Counter[str] = Counter()
        self._events: Counter[str] = Counter()
        self._shown: dict[str, int] = {}
        self._newest = 0
        self._warning = ""
        self._warned_at = 0.0
        self._last = monotonic()
        self._timer = node.create_timer(PERIOD, self._publish, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def received(self, topic_name: str, stamp: int = 0) -> None:
        """Count a message, with its stamp [ns] where it has one."""
        self._inputs[topic_name] += 1
        self._newest = max(self._newest, stamp)

    def begin_anew(self) -> None:
        """Forget the newest stamp: time began anew."""
        self._newest = 0

    def count(self, event: str, warning: str = "", times: int = 1) -> None:
        """Count an event.

        Args:
            event: A few fixed words, the key in the diagnostics, as in "rejected features".
            warning: What is wrong, in words: goes into the status, and into the log (once a second at most).
            times: How often it happened.
        """
        self._events[event] += times
        if warning:
            self._warning, self._warned_at = warning, monotonic()
            self._node.get_logger().warning(warning, throttle_duration_sec=1.0)

    def _publish(self) -> None:
        now = monotonic()
        elapsed, self._last = now - self._last, now
        values = [
            KeyValue(key=f"rate {name} [1/s]", value=f"{(count - self._shown.get(name, 0)) / elapsed:.1f}")
            for name, count in sorted(self._inputs.items())
        ]
        self._shown = dict(self._inputs)
        values += [KeyValue(key=event, value=str(count)) for event, count in sorted(self._events.items())]
        warns = bool(self._warning) and now - self._warned_at < WARNING_HOLDS
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if warns else DiagnosticStatus.OK,
            name=self._node.get_name(),
            message=self._warning if warns else "running",
            hardware_id=self._node.get_namespace(),
            values=values,
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = to_message(self._newest)
        self._publisher.publish(message)
