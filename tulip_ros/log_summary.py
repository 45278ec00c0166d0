"""How often messages come in a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tulip_ros.log_file import Log

NANO = 1e-9


@dataclass
class Rhythm:
    """When messages of one topic came.

    Attributes:
        messages: How many.
        first, last: Log times [ns].
        largest_gap: Between two of them [s]; NaN below two.
        gap_begins: Log time at which the largest gap begins [ns].
        size: Of all of them, not compressed [B].
    """

    messages: int = 0
    first: int = 0
    last: int = 0
    largest_gap: float = float("nan")
    gap_begins: int = 0
    size: int = 0

    @property
    def rate(self) -> float:
        """Messages a second from the first to the last [1/s]; NaN below two."""
        span = (self.last - self.first) * NANO
        return (self.messages - 1) / span if self.messages > 1 and span > 0.0 else float("nan")

    def see(self, log_time: int, size: int) -> None:
        """Take a message."""
        if self.messages == 0:
            self.first = log_time
        else:
            gap = (log_time - self.last) * NANO
            if not gap <= self.largest_gap:
                self.largest_gap, self.gap_begins = gap, self.last
        self.messages += 1
        self.last = log_time
        self.size += size


def rhythms(log: Log, advance: Callable[[int], None]) -> dict[str, Rhythm]:
    """Return when messages came, by topic; reads the whole recording.

    Args:
        log: The recording.
        advance: Is told the number of messages read since the last time, for a progress bar.

    Raises:
        DamagedLogError: if it turns out to be damaged.
    """
    found = {name: Rhythm() for name in log.topics}
    for number, record in enumerate(log.records(), 1):
        found[record.topic.name].see(record.log_time, len(record.data))
        if number % 1000 == 0:
            advance(1000)
    return found
