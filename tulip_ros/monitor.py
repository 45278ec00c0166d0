"""Listens to what the nodes say about themselves; publishes the sum of it, and makes a table of it for people."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rich.markup import escape
from rich.table import Table

from tulip_ros import topics
from tulip_ros.aggregation import NOT_HEARD, Aggregation, Report, by_topic
from tulip_ros.finding import Level
from tulip_ros.node_process import ProcessState
from tulip_ros.nodes import DRIVER, ROBOT

PERIOD = 1.0  # [s] of wall-clock time between two sums, as between two reports of a node
STYLES = {"ok": "green", "warning": "yellow", "error": "red", "stale": "red", "starting": "dim"}


class Monitor:
    """The aggregator: listens to `diagnostics`, publishes `diagnostics_agg`.

    The first status of the sum is the whole: the worst level, and the one sentence that matters most. A status for each
    node follows, named as ROS's own diagnostic_aggregator does it: /robot/motion.
    """

    def __init__(
        self, node: Node, expected: Sequence[str] = (), namespaces: Sequence[str] = ("",), publishes: bool = True
    ) -> None:
        """Connect.

        Args:
            node: Which listens and publishes.
            expected: Names of nodes that should be there, as in "motion" or, of several robots, "striker/motion".
            namespaces: Of the robots, below the node's own.
            publishes: False where another one publishes the sum.
        """
        self._node = node
        self._aggregation = Aggregation((DRIVER, *ROBOT), expected, monotonic())
        for namespace in namespaces:
            topics.DIAGNOSTICS.within(namespace).subscribe_from(node, partial(self._on_diagnostics, namespace))
        if publishes:
            self._sender = topics.DIAGNOSTICS_AGG.publish_from(node)
            self._timer = node.create_timer(PERIOD, self._publish, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_diagnostics(self, namespace: str, message: DiagnosticArray) -> None:
        for status in message.status:
            name = f"{namespace}/{status.name}" if namespace else status.name
            self._aggregation.hear(name, report_from_status(status), monotonic())

    def _publish(self) -> None:
        now = monotonic()
        root = self._node.get_namespace().rstrip("/") or "/robot"
        statuses = [_status(root, self._aggregation.summary(now))]
        statuses += [_status(f"{root}/{name}", report) for name, report in self._aggregation.reports(now).items()]
        message = DiagnosticArray(status=statuses)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._sender.publish(message)

    def summary(self) -> Report:
        """Return the worst level and the one sentence that matters most."""
        return self._aggregation.summary(monotonic())

    def reports(self) -> dict[str, Report]:
        """Return how each node is."""
        return self._aggregation.reports(monotonic())

    def table(self, states: Sequence[ProcessState]) -> Table:
        """Return a table of all processes, with the sum as its title."""
        whole, reports = self.summary(), self.reports()
        style = STYLES[_word(whole)]
        table = Table(box=None, pad_edge=False, title=f"[{style}]{escape(whole.words)}[/]", title_justify="left")
        for column in ("node", "process", "restarts", "health", "processor", "fastest [1/s]", "slowest [ms]", "says"):
            table.add_column(escape(column))
        for state in states:
            report = reports.get(state.name, Report(Level.OK, NOT_HEARD)) if state.state == "running" else None
            word = state.state if report is None else _word(report)
            values = {} if report is None else report.values
            rates, latencies = by_topic(values, "rate"), by_topic(values, "latency")
            fastest = max(rates, key=lambda topic: rates[topic], default="")
            slowest = max(latencies, key=lambda topic: latencies[topic], default="")
            table.add_row(
                state.name,
                str(state.pid or "-"),
                str(state.restarts),
                f"[{STYLES.get(word, 'red')}]{word}[/]",
                "" if report is None else f"{values.get('processor [%]', '-')} %",
                f"{rates[fastest]:.0f} {fastest}" if fastest else "-",
                f"{latencies[slowest]:.1f} {slowest}" if slowest else "-",
                "" if report is None else escape(report.words),
            )
        return table


def report_from_status(status: DiagnosticStatus) -> Report:
    """Return what a node says about itself."""
    return Report(Level(status.level[0]), status.message, {pair.key: pair.value for pair in status.values})


def _word(report: Report) -> str:
    return "starting" if report.words == NOT_HEARD else report.level.name.lower()


def _status(name: str, report: Report) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes([report.level]),
        name=name,
        message=report.words,
        values=[KeyValue(key=key, value=value) for key, value in report.values.items()],
    )
