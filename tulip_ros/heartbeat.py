"""Signs of life from a node to the launcher, over a pipe: no middleware, so that they tell of the process alone.

A node beats from its executor, as its other callbacks come: one that was stopped, or that never comes back from a
callback, is silent.
"""

from __future__ import annotations

import contextlib
import os

VARIABLE = "TULIP_HEARTBEAT"
"""Environment variable with the number of the pipe's end that a node writes to."""


def beat() -> None:
    """Give a sign of life, if somebody listens."""
    end = os.environ.get(VARIABLE)
    if end is not None:
        with contextlib.suppress(OSError, ValueError):  # a full pipe or a launcher that was killed: nobody reads
            os.write(int(end), b".")


class Pulse:
    """The launcher's end.

    Attributes:
        inlet: What the node writes to, to be passed to its process.
        last: Wall-clock time of the newest sign [s], None before the first.
    """

    def __init__(self) -> None:
        self._outlet, self.inlet = os.pipe()
        os.set_blocking(self._outlet, False)
        os.set_blocking(self.inlet, False)
        self.last: float | None = None

    def feel(self, now: float) -> None:
        """Take the signs that came since the last call, at a wall-clock time [s]."""
        with contextlib.suppress(BlockingIOError):
            if os.read(self._outlet, 4096):
                self.last = now

    def close(self) -> None:
        """Free the pipe."""
        os.close(self._outlet)
        os.close(self.inlet)
