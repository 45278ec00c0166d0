"""Reads many inputs of a kind in a process of its own, which may die, hang or ask for too much memory."""

from __future__ import annotations

import multiprocessing
import os
import random
import resource
import shutil
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Set
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType
from typing import NoReturn

from tulip_view.fuzz.inputs import KINDS, Kind
from tulip_view.fuzz.samples import SCRATCH

LONGEST = 10.0  # [s] of processor time for one input; more is a hang
DEAD = 300.0  # [s] of wall-clock time without any news; then it hangs where no signal reaches it
MEMORY = 2**31  # [B] that the process may ask for beyond what it has when it begins
STEP = 200  # inputs between two reports
SHOWN = 5  # defects that are told


class HangError(BaseException):
    """An input takes too long. No reader catches it by mistake."""


@dataclass
class Result:
    """What came of many inputs.

    Attributes:
        accepted: How many were taken.
        refused: How many were refused, by the reason's name.
        defects: How many did something else, by what.
        examples: Number of the input, and what it did, of the first ones.
        longest: Processor time of the slowest input [s].
        slowest: Number of that input.
        memory: By how much the process grew [MB].
    """

    accepted: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    defects: Counter[str] = field(default_factory=Counter)
    examples: list[tuple[int, str]] = field(default_factory=list)
    longest: float = 0.0
    slowest: int = 0
    memory: float = 0.0

    def see(self, other: Result) -> None:
        """Add what came of further inputs."""
        self.accepted += other.accepted
        self.refused += other.refused
        self.defects += other.defects
        self.examples = (self.examples + other.examples)[:SHOWN]
        if other.longest > self.longest:
            self.longest, self.slowest = other.longest, other.slowest
        self.memory = max(self.memory, other.memory)

    def fail(self, number: int, what: str, words: str = "") -> None:
        """Note a defect."""
        self.defects[what] += 1
        self.examples.append((number, f"{what}: {words}"[:300]))


def made(kind: Kind, number: int) -> bytes:
    """Return an input by its number."""
    return kind.make(random.Random(number))


def read(kind: Kind, number: int, data: bytes, folder: Path, result: Result) -> None:
    """Read one input and note what came of it.

    Args:
        kind: Of input.
        number: Of the input.
        data: The input itself.
        folder: An empty one; what is left in it is removed.
        result: Where it is noted.
    """
    begin = time.process_time()
    try:
        reason = kind.read(data, folder)
    except kind.refusals as error:
        result.refused[type(error).__name__] += 1
    except HangError:
        result.fail(number, "hang")
    except Exception as error:
        result.fail(number, type(error).__name__, str(error))
    else:
        if reason:
            result.refused[reason] += 1
        else:
            result.accepted += 1
    took = time.process_time() - begin
    if took > result.longest:
        result.longest, result.slowest = took, number
    for each in os.scandir(folder):
        if each.is_dir():
            shutil.rmtree(each)
        else:
            os.unlink(each)


def run(kind: Kind, count: int) -> Result:
    """Read so many inputs, whatever they do to the process that reads them."""
    whole, first = Result(), 0
    fatal: set[int] = set()
    context = multiprocessing.get_context("fork")
    current = context.Value("q", 0, lock=False)
    with tempfile.TemporaryDirectory(dir=SCRATCH) as name:
        folder = Path(name)
        while first < count:
            ours, theirs = context.Pipe(duplex=False)
            child = context.Process(target=_child, args=(kind, range(first, count), fatal, folder, theirs, current))
            child.start()
            theirs.close()
            try:
                while first < count and ours.poll(DEAD):
                    result, first = ours.recv()
                    whole.see(result)
            except EOFError:  # it died
                child.join()
            hangs = first < count and child.is_alive()
            if hangs:
                child.kill()
            child.join()
            if first < count:  # what it read since its last report is read anew, but for what ended it
                whole.fail(current.value, "hang beyond signals" if hangs else f"process ended ({child.exitcode})")
                fatal.add(current.value)
    return whole


def _child(
    kind: Kind, numbers: range, fatal: Set[int], folder: Path, connection: Connection, current: object
) -> NoReturn:
    """Read inputs and report on them; never returns."""
    signal.signal(signal.SIGPROF, _too_long)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)  # libraries complain there of what they meet
    begin = _memory()
    result = Result()
    for number in numbers:
        current.value = number  # type: ignore[attr-defined]  # a shared number, of no class that can be named
        if number not in fatal:
            data = made(kind, number)
            try:
                signal.setitimer(signal.ITIMER_PROF, LONGEST)
                read(kind, number, data, _place(folder), result)
                signal.setitimer(signal.ITIMER_PROF, 0.0)
            except HangError:  # just when it was read
                pass
        if (number + 1) % STEP == 0 or number + 1 == numbers.stop:
            result.memory = max(0.0, _memory() - begin)
            connection.send((result, number + 1))
            result = Result()
    os._exit(0)


def _place(folder: Path) -> Path:
    path = folder / "input"
    path.mkdir(exist_ok=True)
    return path


def _too_long(number: int, frame: FrameType | None) -> None:
    raise HangError


def _memory() -> float:
    """Return the largest resident memory so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def kind_of(name: str) -> Kind:
    """Return the kind of a name."""
    return next(kind for kind in KINDS if kind.name == name)
