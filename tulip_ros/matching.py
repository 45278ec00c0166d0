"""Messages of several topics that belong to one instant."""

from __future__ import annotations

from typing import Any

KEEP = 8  # incomplete instants kept: 32 ms at 250 Hz, beyond which a missing message will not come any more


class SameStamp:
    """Collects one message of each of several topics with the same stamp.

    Example:
        >>> sensors = SameStamp("joint_states", "imu")
        >>> sensors.add("imu", 4, "imu at 4")
        >>> sensors.add("joint_states", 4, "joints at 4")
        ('joints at 4', 'imu at 4')
    """

    def __init__(self, *names: str) -> None:
        if len(set(names)) != len(names) or not names:
            raise ValueError(f"names are {names}; expected one or more different names")
        self._names = names
        self._waiting: dict[int, dict[str, Any]] = {}
        self._last = -1
        self.dropped = 0
        """Instants given up because one of their messages never came."""

    def add(self, name: str, stamp: int, message: Any) -> tuple[Any, ...] | None:
        """Add a message; return all messages of its instant, in the order of the names, once they are complete.

        Args:
            name: One of the names given at the start.
            stamp: Of the message [ns].
            message: Anything.
        """
        if name not in self._names:
            raise ValueError(f"name is {name!r}; expected one of {', '.join(self._names)}")
        if stamp <= self._last:
            return None  # late: its instant was given up, or it came twice
        instant = self._waiting.setdefault(stamp, {})
        instant[name] = message
        if len(instant) < len(self._names):
            if len(self._waiting) > KEEP:
                del self._waiting[min(self._waiting)]
                self.dropped += 1
            return None
        older = [other for other in self._waiting if other < stamp]
        self.dropped += len(older)
        for other in (*older, stamp):
            del self._waiting[other]
        self._last = stamp
        return tuple(instant[each] for each in self._names)
