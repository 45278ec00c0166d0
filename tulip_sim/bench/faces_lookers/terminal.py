"""A terminal that nobody sees, for a program that draws in one."""

from __future__ import annotations

import os
import signal
import subprocess
import termios
import threading
from collections.abc import Sequence
from contextlib import suppress
from types import TracebackType

SIZE = (40, 120)  # rows and columns
TAIL = 2000  # [B] of what was drawn last, for messages


class Terminal:
    """Runs a program in a terminal."""

    def __init__(self, command: Sequence[str]) -> None:
        """Start it.

        Args:
            command: Program and arguments.
        """
        self._own, its = os.openpty()
        termios.tcsetwinsize(its, SIZE)
        variables = {**os.environ, "TERM": "xterm-256color"}
        self._process = subprocess.Popen(
            command, stdin=its, stdout=its, stderr=its, env=variables, start_new_session=True
        )
        os.close(its)
        self.drawn = 0
        """[B] that it has drawn so far."""
        self._last = b""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Terminal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(ProcessLookupError):  # it has ended by itself
            os.killpg(self._process.pid, signal.SIGKILL)  # and what it has started
        self._process.wait()
        self._reader.join()
        os.close(self._own)

    @property
    def pid(self) -> int:
        """Id of its process."""
        return self._process.pid

    def check(self) -> None:
        """Check that it still runs.

        Raises:
            RuntimeError: if it has ended, with what it drew last.
        """
        if self._process.poll() is not None:
            raise RuntimeError(f"{self._process.args!r} has ended: {self._last.decode(errors='replace')}")

    def _read(self) -> None:
        while True:
            try:
                data = os.read(self._own, 65536)
            except OSError:  # the program has closed its side
                return
            self.drawn += len(data)
            self._last = (self._last + data)[-TAIL:]
