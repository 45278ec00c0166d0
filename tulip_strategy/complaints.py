"""Names each reason for a complaint once, however often it comes."""

from __future__ import annotations

FORGET = 60_000_000_000  # [ns] a reason that has not come for so long is new when it comes again
MOST = 32  # reasons remembered; while there are more, further ones are counted but not named: a flood of all kinds


class Complaints:
    """Remembers which reasons were named."""

    def __init__(self) -> None:
        self._last: dict[str, int] = {}

    def is_new(self, reason: str, stamp: int) -> bool:
        """Tell whether a reason should be named now, and remember that it came.

        Args:
            reason: In words.
            stamp: When it came [ns]; may be earlier than the last one's, if time began anew.
        """
        self._last = {old: at for old, at in self._last.items() if abs(stamp - at) < FORGET}
        known = reason in self._last
        if not known and len(self._last) >= MOST:
            return False
        self._last[reason] = stamp
        return not known
