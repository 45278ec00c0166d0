"""The end of a launch: groups of processes, one after the other, however often somebody presses Ctrl-C meanwhile."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import monotonic, sleep
from typing import Protocol

PATIENCE = 5.0  # [s] to end by itself after SIGTERM, before SIGKILL
IMPATIENCE = 0.5  # [s] of that after a second Ctrl-C: a driver still has the time to leave its body without torque
ALONE = 1.0  # [s] that a driver has to end before the nodes that command it


class Process(Protocol):
    """What is to be ended."""

    def signal(self, number: signal.Signals) -> None:
        """Send a signal, unless it has ended."""

    def has_ended(self) -> bool:
        """Return whether it has."""

    def forget(self) -> None:
        """Wait for its end, which is near."""


def end_in_order(drivers: Sequence[Process], others: Sequence[Process], recorders: Sequence[Process]) -> None:
    """End all processes.

    Args:
        drivers: End first, so that the body is without torque before the nodes that balance it end.
        others: End next, a second later at the latest.
        recorders: End last, so that they see the others end.
    """
    with _counted_interrupts() as interrupts:
        _ask(drivers)
        _wait_for(drivers, ALONE, interrupts)
        _ask(others)
        _await_or_kill([*drivers, *others], interrupts)
        _ask(recorders)
        _await_or_kill(recorders, interrupts)


@contextmanager
def _counted_interrupts() -> Iterator[list[int]]:
    """Yield the signals that ask this program to end and come meanwhile: they hurry the end and do not break it off."""
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came  # only the main thread gets signals
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda it, _: came.append(it)) for number in numbers]
    try:
        yield came
    finally:
        for number, handler in zip(numbers, before, strict=True):
            if handler is not None:  # else it is none of Python's
                signal.signal(number, handler)


def _ask(processes: Sequence[Process]) -> None:
    for process in processes:
        process.signal(signal.SIGTERM)


def _wait_for(processes: Sequence[Process], seconds: float, interrupts: Sequence[int]) -> None:
    """Wait until processes have ended, so long [s] at most, and less if somebody is impatient."""
    begin = monotonic()
    while not all(process.has_ended() for process in processes):
        if monotonic() - begin > (min(seconds, IMPATIENCE) if interrupts else seconds):
            return
        sleep(0.01)


def _await_or_kill(processes: Sequence[Process], interrupts: Sequence[int]) -> None:
    _wait_for(processes, PATIENCE, interrupts)
    for process in processes:
        process.signal(signal.SIGKILL)
        process.forget()
