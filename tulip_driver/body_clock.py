"""The body's clock seen from the computer: two clocks of other origin, which also drift apart."""

from __future__ import annotations

import time

WINDOW = 1_000_000_000  # [ns] in which the fastest message is looked for; 50 ppm of drift make 0.05 ms in it


def host_clock() -> int:
    """Return the computer's time [ns since 1970]; unlike the system's clock it never jumps while a program runs."""
    return time.monotonic_ns() + _ORIGIN


_ORIGIN = time.time_ns() - time.monotonic_ns()


class BodyClock:
    """Turns stamps of the body's clock into the computer's time.

    A reading arrives some time after its stamp, never before: of all differences between arrival and stamp the
    smallest is nearest to that between the clocks. It is looked for in this window of time and the one before, so that
    it follows clocks that drift apart.

    Example:
        >>> clock = BodyClock()
        >>> clock.to_host(stamp=1000, arrival=51000), clock.to_host(stamp=2000, arrival=59000)
        (51000, 52000)
    """

    def __init__(self) -> None:
        self._begun = 0
        self._smallest: int | None = None  # of this window [ns]
        self._before: int | None = None  # of the window before
        self._last = 0

    def to_host(self, stamp: int, arrival: int) -> int:
        """Return the computer's time of a reading [ns]; it grows from one to the next.

        Args:
            stamp: Of the reading, on the body's clock [ns].
            arrival: When it came, on the computer's clock [ns].
        """
        difference = arrival - stamp
        if self._smallest is None or arrival - self._begun > WINDOW:
            self._begun, self._before, self._smallest = arrival, self._smallest, difference
        self._smallest = min(self._smallest, difference)
        offset = self._smallest if self._before is None else min(self._smallest, self._before)
        self._last = max(stamp + offset, self._last + 1)
        return self._last
