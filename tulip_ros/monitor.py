"""What the nodes say about themselves, and a table of it for people."""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from rich.table import Table

from tulip_ros import topics
from tulip_ros.launch import ProcessState

SILENT = 3.0  # [s] without diagnostics, which come each second, before a node counts as silent
STYLES = {"ok": "green", "warning": "yellow", "silent": "red", "starting": "dim"}


class Monitor:
    """Listens to the diagnostics of all nodes in a node's namespace."""

    def __init__(self, node: Node) -> None:
        self._heard: dict[str, tuple[float, DiagnosticStatus]] = {}
        topics.DIAGNOSTICS.subscribe_from(node, self._on_diagnostics)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._heard[status.name] = (monotonic(), status)

    def health(self, name: str) -> str:
        """Return "ok", "warning", "silent" or "starting" (not heard yet)."""
        if name not in self._heard:
            return "starting"
        when, status = self._heard[name]
        if monotonic() - when > SILENT:
            return "silent"
        return "warning" if status.level != DiagnosticStatus.OK else "ok"

    def message(self, name: str) -> str:
        """Return what the node says about itself, or ""."""
        return str(self._heard[name][1].message) if name in self._heard else ""

    def rates(self, name: str) -> dict[str, float]:
        """Return how many messages [1/s] a node takes in, by topic."""
        if name not in self._heard:
            return {}
        pairs = ((pair.key, pair.value) for pair in self._heard[name][1].values)
        return {
            key.removeprefix("rate ").removesuffix(" [1/s]"): float(value)
            for key, value in pairs
            if key.startswith("rate ")
        }

    def table(self, states: Sequence[ProcessState]) -> Table:
        """Return a table of all processes."""
        table = Table(box=None, pad_edge=False)
        for column in ("node", "process", "restarts", "health", "fastest input [1/s]", "says"):
            table.add_column(column)
        for state in states:
            health = self.health(state.name) if state.state == "running" else state.state
            rates = self.rates(state.name) if state.state == "running" else {}
            fastest = max(rates, key=lambda topic: rates[topic], default="")
            table.add_row(
                state.name,
                str(state.pid or "-"),
                str(state.restarts),
                f"[{STYLES.get(health, 'red')}]{health}[/]",
                f"{rates[fastest]:.0f} {fastest}" if fastest else "-",
                self.message(state.name) if state.state == "running" else "",
            )
        return table
