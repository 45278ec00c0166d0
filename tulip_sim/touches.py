"""Counts touches of the ball."""

from __future__ import annotations

TOUCH_GAP = 100_000_000  # [ns] contacts closer together than this are one touch


class TouchCounter:
    """Counts touches; contacts that follow each other closely are one."""

    def __init__(self) -> None:
        self.count = 0
        self._last = -TOUCH_GAP

    def touch(self, now: int) -> None:
        """Take a contact at a time [ns]."""
        if now - self._last >= TOUCH_GAP:
            self.count += 1
        self._last = now
