"""A program that looks, and what started it: it says once that it sees something, and at its end how much it saw."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable
from types import TracebackType

PATIENCE = 60.0  # [s] until the other side is there
PAUSE = 0.2  # [s] between two attempts
READY = "sees something"
PAGE, BRIDGE, BROWSER = "page", "viewer", "browser"
"""Modules beside this one: by the page, by the bridge, by the page in a browser."""


class Looker:
    """One that looks, in a process of its own."""

    def __init__(self, kind: str, port: int) -> None:
        """Start it.

        Args:
            kind: `PAGE`, `BRIDGE` or `BROWSER`.
            port: TCP port of the face.
        """
        self.kind = kind
        command = [sys.executable, "-m", f"{__package__}.{kind}", str(port)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._ready = threading.Event()
        self._seen: dict[str, float] = {}
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Looker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()

    @property
    def pid(self) -> int:
        """Id of its process."""
        return self._process.pid

    def sees(self) -> bool:
        """Return whether it has seen something.

        Raises:
            RuntimeError: if it has ended.
        """
        if self._process.poll() is not None:
            raise RuntimeError(f"the program that looks ({self.kind}) has ended; its error stands above")
        return self._ready.is_set()

    def end(self) -> dict[str, float]:
        """End it; return what it saw a second, by name."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(PATIENCE)
        self._reader.join()
        return self._seen

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.strip() == READY:
                self._ready.set()
            else:
                self._seen = json.loads(line)


class Tally:
    """What a program that looks has seen, told when its standard input ends."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._begun = 0.0

    def count(self, name: str, amount: int = 1) -> None:
        """Count something; the first tells that there is something to see."""
        if not self._begun:
            self._begun = time.monotonic()
            print(READY, flush=True)
        self._counts[name] += amount

    def tell(self) -> None:
        """Print what was seen a second."""
        elapsed = max(time.monotonic() - self._begun, 1e-3)
        print(json.dumps({name: round(count / elapsed, 1) for name, count in self._counts.items()}), flush=True)


def look(see: Callable[[int, Tally], None]) -> None:
    """Run a program that looks: `see` counts for ever, until standard input ends.

    Args:
        see: Is given the port of the command line, and the tally.
    """
    tally = Tally()

    def seeing() -> None:
        try:
            see(int(sys.argv[1]), tally)
        except Exception:
            traceback.print_exc()
        os._exit(1)  # the other side has gone, and the main thread waits for standard input

    threading.Thread(target=seeing, daemon=True).start()
    sys.stdin.read()
    tally.tell()
    os._exit(0)


def wait_for(port: int) -> None:
    """Wait until somebody listens on a port of this machine.

    Raises:
        ConnectionRefusedError: if nobody does in time.
    """
    end = time.monotonic() + PATIENCE
    while True:
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            return
        except ConnectionRefusedError:
            if time.monotonic() > end:
                raise
            time.sleep(PAUSE)
