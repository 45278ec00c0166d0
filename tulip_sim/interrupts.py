"""Processes that Ctrl-C does not reach: a terminal sends it to all of a program's, and one of them ends the others."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker


@contextmanager
def left_to_this_process() -> Iterator[None]:
    """Begin processes within: they never see SIGINT, not while they load their modules either.

    They take over which signals are blocked. One that comes meanwhile reaches this process at the end.
    """
    resource_tracker.ensure_running()  # its own start, with the first spawned process, would unblock SIGINT again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
