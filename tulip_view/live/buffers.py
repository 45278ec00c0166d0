"""The last messages of each topic."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

from tulip_ros import topics
from tulip_ros.time import NANOSECONDS, stamp_of
from tulip_view.live.inputs import INPUTS
from tulip_view.recording import STEADY


class Buffers:
    """Keeps of each topic the newest message, and of some those of the last seconds.

    Attributes:
        stamp: Newest stamp of all [s].
        now: Newest arrival, by the clock of whoever feeds [s].
        health: What each node said last about itself, and when that came [s].
    """

    def __init__(self) -> None:
        self.stamp = 0.0
        self.now = 0.0
        self.health: dict[str, tuple[float, DiagnosticStatus]] = {}
        self._newest: dict[str, Any] = {}
        self._kept: dict[str, deque[tuple[float, Any]]] = {}

    def take(self, name: str, message: Any, arrival: float) -> None:
        """Keep a message.

        Args:
            name: Of its topic, one of `INPUTS`.
            message: The message.
            arrival: When it came, by a clock that always runs forward [s].
        """
        self.now = max(self.now, arrival)
        if name == topics.DIAGNOSTICS.name:
            for status in message.status:
                self.health[status.name] = (arrival, status)
        entry = INPUTS[name]
        stamp = stamp_of(message) / NANOSECONDS
        if name in STEADY:  # others may be of long ago, or of before time began anew
            self.stamp = max(self.stamp, stamp)
        self._newest[name] = message
        if entry.kept:
            row = self._kept.setdefault(name, deque())
            row.append((stamp, message))
            while row[0][0] < stamp - entry.kept:
                row.popleft()

    def newest(self, topic: topics.Topic) -> Any | None:
        """Return a topic's newest message, or None."""
        return self._newest.get(topic.name)

    def kept(self, topic: topics.Topic) -> list[tuple[float, Any]]:
        """Return a topic's last messages with their stamps [s], the oldest first."""
        return list(self._kept.get(topic.name, ()))

    def nearest(self, topic: topics.Topic, stamp: float, within: float) -> Any | None:
        """Return the kept message whose stamp lies nearest to one [s], and no further from it than `within` [s]."""
        row = self.kept(topic)
        place = bisect_left(row, stamp, key=lambda each: each[0])
        near = min(row[max(place - 1, 0) : place + 1], key=lambda each: abs(each[0] - stamp), default=None)
        return near[1] if near is not None and abs(near[0] - stamp) <= within else None

    def forget(self, topic: topics.Topic) -> None:
        """Forget all that came of a topic."""
        self._newest.pop(topic.name, None)
        self._kept.pop(topic.name, None)

    def has(self, name: str) -> bool:
        """Return whether anything came of a topic."""
        return name in self._newest
