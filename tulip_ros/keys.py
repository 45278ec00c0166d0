"""Single keys from a terminal, without waiting."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from types import TracebackType


class Keys:
    """Reads keys as they are pressed; from anything but a terminal there come none.

    Example:
        >>> with Keys() as keys:  # doctest: +SKIP
        ...     if keys.pressed() == "q":
        ...         print("quit")
    """

    def __enter__(self) -> Keys:
        """Take keys one by one, unseen."""
        self._stream = sys.stdin.fileno() if sys.stdin is not None and sys.stdin.isatty() else None
        if self._stream is not None:
            self._before = termios.tcgetattr(self._stream)
            tty.setcbreak(self._stream)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was."""
        if self._stream is not None:
            termios.tcsetattr(self._stream, termios.TCSADRAIN, self._before)

    def pressed(self) -> str:
        """Return a key that was pressed, or ""."""
        if self._stream is None or not select.select([self._stream], [], [], 0.0)[0]:
            return ""
        return os.read(self._stream, 1).decode(errors="ignore")
