"""Work in a process of its own, for what takes long and needs nothing of this one."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Iterator
from itertools import islice
from multiprocessing.connection import Connection
from typing import TypeVar

from tulip_sim.interrupts import left_to_this_process

T = TypeVar("T")

BATCH = 200
"""Items that go through the pipe together: to send one costs more than most of them take."""


def may_fork() -> bool:
    """Return whether a forked process would find a second core, and no locks of other threads."""
    return len(os.sched_getaffinity(0)) > 1 and threading.active_count() == 1


class Beside(Iterator[T]):
    """What an iterator yields, in the same order, computed in a forked process as far ahead as a pipe holds.

    A forked process has at once what this one has loaded; a new one would spend a second on imports.
    """

    def __init__(self, items: Iterator[T]) -> None:
        """Start the process.

        Args:
            items: Not begun yet; they can be pickled.
        """
        context = multiprocessing.get_context("fork")
        self._pipe, theirs = context.Pipe(duplex=False)
        self._process = context.Process(target=_send, args=(items, theirs), daemon=True)
        with left_to_this_process():
            self._process.start()
        theirs.close()
        self._batch: Iterator[T] = iter(())

    def __next__(self) -> T:
        """Return the next item.

        Raises:
            EOFError: if the process was killed.
        """
        for item in self._batch:
            return item
        received = self._pipe.recv()
        if isinstance(received, BaseException):
            raise received
        if not received:
            raise StopIteration
        self._batch = iter(received)
        return next(self._batch)

    def close(self) -> None:
        """End the process, whether or not all was taken."""
        self._pipe.close()
        self._process.kill()
        self._process.join()


def _send(items: Iterator[T], pipe: Connection) -> None:
    try:
        batch = list(islice(items, BATCH))
        while batch:
            pipe.send(batch)
            batch = list(islice(items, BATCH))
        pipe.send(batch)
    except BrokenPipeError:
        pass  # nobody reads any more
    except Exception as error:
        pipe.send(error)
