"""One state out of many: what the nodes say about themselves, who says nothing, and what matters most. No ROS here."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from tulip_ros.finding import Level

STALE_AFTER = 3.0  # [s] of wall-clock time without a report, of which one comes each second
STARTING = 10.0  # [s] of wall-clock time in which an expected node may still start
NOT_HEARD = "starting"


def by_topic(values: Mapping[str, str], kind: str) -> dict[str, float]:
    """Return a node's figures of its inputs, by topic; NaN for what is no number.

    Args:
        values: The figures of its report.
        kind: "rate" [1/s], or "latency" [ms].
    """
    keys = {key.split()[1]: value for key, value in values.items() if re.fullmatch(rf"{kind} \S+ \[\S+\]", key)}
    return {topic: _number(value) for topic, value in keys.items()}


def _number(words: str) -> float:
    try:
        return float(words)
    except ValueError:
        return math.nan


@dataclass(frozen=True)
class Report:
    """What one node said about itself last, or what is said about it.

    Attributes:
        level: How it is.
        words: In words.
        values: Its figures, by name.
    """

    level: Level
    words: str
    values: Mapping[str, str] = field(default_factory=dict)


class Aggregation:
    """Collects the nodes' reports.

    A node is looked after when it is expected, or when it is part of a robot and was ever heard. Tools come and go: one
    that was not expected is forgotten when it falls silent.
    """

    def __init__(self, order: Iterable[str], expected: Iterable[str], now: float) -> None:
        """Begin.

        Args:
            order: The robot's nodes in the order of the data flow: of two faults as bad, the earlier one may be the
                cause of the other.
            expected: Names of the nodes that should be there, each with its namespace where it has one.
            now: Wall-clock time [s].
        """
        self._order = {name: index for index, name in enumerate(order)}
        self._expected = tuple(dict.fromkeys(expected))
        self._begun = now
        self._heard: dict[str, tuple[float, Report]] = {}

    def hear(self, name: str, report: Report, now: float) -> None:
        """Take a node's report at a wall-clock time [s]."""
        self._heard[name] = (now, report)

    def reports(self, now: float) -> dict[str, Report]:
        """Return how each node is at a wall-clock time [s], in the order of the data flow."""
        for name, (when, _) in list(self._heard.items()):
            if now - when > STALE_AFTER and not self._is_looked_after(name):
                del self._heard[name]
        names = dict.fromkeys((*self._expected, *self._heard))
        return {name: self._report(name, now) for name in sorted(names, key=self._place)}

    def summary(self, now: float) -> Report:
        """Return the worst level and the one sentence that matters most.

        A silent node comes first, since what others miss may come from it; then the worst one, and the first of those
        in the data flow.
        """
        reports = self.reports(now)
        if not reports:
            return Report(Level.STALE, "no node has said anything: start some (scripts/launch.py)")
        name, worst = max(reports.items(), key=lambda entry: entry[1].level)  # the first of the worst
        if worst.level == Level.OK:
            starting = [each for each, report in reports.items() if report.words == NOT_HEARD]
            return Report(Level.OK, f"waits for {', '.join(starting)}" if starting else "all nodes are well")
        others = sum(report.level > Level.OK for report in reports.values()) - 1
        more = f" (and {others} more)" if others else ""
        all_silent = all(report.level == Level.STALE for report in reports.values())
        level = worst.level if all_silent else min(worst.level, Level.ERROR)
        return Report(level, f"{name}: {worst.words}{more}")

    def _is_looked_after(self, name: str) -> bool:
        return name in self._expected or name.rpartition("/")[2] in self._order

    def _place(self, name: str) -> tuple[int, str]:
        return self._order.get(name.rpartition("/")[2], len(self._order)), name

    def _report(self, name: str, now: float) -> Report:
        if name not in self._heard:
            if now - self._begun < STARTING:
                return Report(Level.OK, NOT_HEARD)
            return Report(Level.STALE, "was never heard: start it, or look into its log")
        when, report = self._heard[name]
        if now - when > STALE_AFTER:
            words = f"says nothing for {now - when:.0f} s: it hangs or has ended, look into its log and start it again"
            return Report(Level.STALE, words, report.values)
        return report
