"""Tells when a simulation began anew: stamps jump back, and messages of the time before may still be on their way."""

from __future__ import annotations

from enum import Enum

JUMP = 500_000_000
"""[ns] Stamps that go back further than this mean that time began anew. One sender's stamps go back by themselves only
where messages overtake each other on their way: a few pictures, of which 16 come in a second, are no new beginning."""


class Arrival(Enum):
    """How a message lies in time."""

    CURRENT = "current"
    ANEW = "anew"  # the first message after time began anew
    OLD = "old"  # from before, overtaken by another topic's first message after


class Timeline:
    """Follows the stamps of several topics, each of which goes forward on its own.

    Example:
        >>> times = Timeline()
        >>> [times.see("imu", second * 10**9).value for second in (0, 30, 0)]
        ['current', 'current', 'anew']
        >>> times.see("odometry", 31 * 10**9).value
        'old'
    """

    def __init__(self) -> None:
        self._last: dict[str, int] = {}
        self._newest = 0
        self._begun: set[str] | None = None  # topics heard since time began anew; None: it never did

    def see(self, name: str, stamp: int) -> Arrival:
        """Take a message's stamp.

        Args:
            name: Of its topic.
            stamp: Of the message [ns].
        """
        if self._begun is not None and name not in self._begun:
            if stamp > self._newest + JUMP:
                return Arrival.OLD
            self._begun.add(name)
        elif stamp < self._last.get(name, stamp) - JUMP:
            self._begun, self._newest = {name}, stamp
            self._last[name] = stamp
            return Arrival.ANEW
        self._last[name] = stamp
        self._newest = max(self._newest, stamp)
        return Arrival.CURRENT
