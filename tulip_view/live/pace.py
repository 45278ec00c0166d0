"""How often the page is drawn: as often as browser and machine keep up with."""

from __future__ import annotations

FASTEST, SLOWEST = 12.0, 2.0  # [1/s]
QUICK, SLOW = 0.12, 0.3  # [s] answers of a browser that could be sent more, and of one that is sent too much
FASTER, SLOWER = 1.25, 0.6
SHARE = 0.25  # of the time at most is spent on drawing


class Pace:
    """Finds the rate.

    Example:
        >>> pace = Pace()
        >>> pace.answered(1.0)
        >>> round(pace.period, 3)
        0.139
    """

    def __init__(self) -> None:
        self._rate = FASTEST
        self._work = 0.0

    @property
    def period(self) -> float:
        """Time from one drawing to the next [s]."""
        return min(max(1.0 / self._rate, self._work / SHARE), 1.0 / SLOWEST)

    def answered(self, delay: float) -> None:
        """Take how long the slowest browser took to answer.

        Args:
            delay: [s]; infinite for no answer.
        """
        if delay > SLOW:
            self._rate = max(self._rate * SLOWER, SLOWEST)
        elif delay < QUICK:
            self._rate = min(self._rate * FASTER, FASTEST)

    def worked(self, duration: float) -> None:
        """Take how long a drawing took here [s]."""
        self._work += 0.1 * (duration - self._work)
