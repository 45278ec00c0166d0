"""How often the page is drawn: as often as leaves browser and machine time for other things."""

from __future__ import annotations

from collections import deque

FASTEST, SLOWEST = 10.0, 2.0  # [1/s]
SHARE = 0.25  # of the time at most is spent on drawing here
BROWSER_SHARE = 0.4  # of the time at most the browser is to draw; without a graphics card that takes a core
KEPT = 6  # answers: some of them came while the browser drew, and waited for all of that


class Pace:
    """Finds the rate.

    A browser answers at once unless it draws. So the latest of some answers tells how long it takes over a picture.

    Example:
        >>> pace = Pace()
        >>> pace.answered(0.1)
        >>> round(pace.period, 3)
        0.25
    """

    def __init__(self) -> None:
        self._delays = deque([0.0], maxlen=KEPT)
        self._work = 0.0

    @property
    def period(self) -> float:
        """Time from one drawing to the next [s]."""
        wanted = max(1.0 / FASTEST, self._work / SHARE, max(self._delays) / BROWSER_SHARE)
        return min(wanted, 1.0 / SLOWEST)

    def answered(self, delay: float) -> None:
        """Take how long the slowest browser took to answer.

        Args:
            delay: [s]; infinite for no answer.
        """
        self._delays.append(delay)

    def worked(self, duration: float) -> None:
        """Take how long a drawing took here [s]."""
        self._work += 0.1 * (duration - self._work)
