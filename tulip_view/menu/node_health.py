"""The health of all nodes for the menu: from the aggregator where there is one, else from the nodes' own words."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from datetime import datetime
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from tulip_ros import topics
from tulip_ros.aggregation import NOT_HEARD, STALE_AFTER, Report, by_topic
from tulip_ros.finding import Level
from tulip_ros.monitor import Monitor, report_from_status
from tulip_ros.recorder_node import RECORDING
from tulip_view.menu.sight import NodeLine, Said

KEPT = 20  # complaints that are remembered
STATES = {Level.OK: "ok", Level.WARNING: "warning", Level.ERROR: "error", Level.STALE: "silent"}
NOBODY = "no node says anything: start some (python3 scripts/launch.py), or see --namespace and ROS_DOMAIN_ID"


class NodeHealth:
    """Hears what nodes say of themselves, and what the aggregator says of them."""

    def __init__(self, node: Node, robot: str) -> None:
        """Listen.

        Args:
            node: Outside all namespaces.
            robot: Namespace of the robot; "" for one that is alone.
        """
        self._prefix = f"{robot}/" if robot else ""
        # Tools and the simulator of a match may tell of themselves outside all namespaces.
        self._own = Monitor(node, namespaces=tuple(dict.fromkeys((robot, ""))), publishes=False)
        topics.DIAGNOSTICS_AGG.within(robot).subscribe_from(node, self._on_sum)
        self._sum: tuple[float, Report, dict[str, Report]] | None = None
        self._said: deque[Said] = deque(maxlen=KEPT)
        self._levels: dict[str, Level] = {}

    def _on_sum(self, message: DiagnosticArray) -> None:
        whole, *nodes = [report_from_status(status) for status in message.status]
        names = [self._short(status.name.split("/", 2)[-1]) for status in message.status[1:]]
        self._sum = monotonic(), whole, dict(zip(names, nodes, strict=True))

    def look(self) -> dict[str, Any]:
        """Return what a sight tells of nodes: state, sum, nodes, said, recording. Call it several times a second."""
        reports = {self._short(name): report for name, report in self._own.reports().items()}
        whole = self._own.summary() if reports else Report(Level.STALE, NOBODY)
        if self._sum is not None and monotonic() - self._sum[0] < STALE_AFTER:
            _, whole, summed = self._sum
            reports = summed | {name: report for name, report in reports.items() if name not in summed}
        self._note(reports)
        recorders = [report.values[RECORDING] for report in reports.values() if RECORDING in report.values]
        return {
            "state": STATES[whole.level],
            "sum": whole.words,
            "nodes": tuple(_line(name, report) for name, report in reports.items()),
            "said": tuple(self._said),
            "recording": max(recorders, default=None),
        }

    def _short(self, name: str) -> str:
        return name.removeprefix(self._prefix)

    def _note(self, reports: Mapping[str, Report]) -> None:
        """Remember complaints that are new: figures in their words grow, which makes no new complaint."""
        for name, report in reports.items():
            before = self._levels.get(name, Level.OK)
            self._levels[name] = report.level
            said = Said(datetime.now().strftime("%H:%M:%S"), name, STATES[report.level], report.words)
            if report.level > before:
                self._said.appendleft(said)
            elif report.level is not Level.OK:
                self._renew(said)
        for gone in self._levels.keys() - reports.keys():
            del self._levels[gone]

    def _renew(self, said: Said) -> None:
        """Replace the words of a complaint that lasts."""
        for index, old in enumerate(self._said):
            if old.node == said.node:
                self._said[index] = Said(old.time, said.node, said.state, said.words)
                return


def _line(name: str, report: Report) -> NodeLine:
    rates = by_topic(report.values, "rate")
    fastest = max(rates, key=lambda topic: rates[topic], default="")
    return NodeLine(
        name,
        "starting" if report.words == NOT_HEARD else STATES[report.level],
        f"{rates[fastest]:.0f} {fastest}" if fastest else "",
        report.values.get("processor [%]", ""),
        report.values.get("restarts", ""),
        report.words,
    )
