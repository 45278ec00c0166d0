"""What a process holds of the machine, as Linux tells in /proc."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Collection
from pathlib import Path

SHARED_MEMORY = Path("/dev/shm")

MEMORY, FILES, THREADS = "memory [MB]", "open files", "threads"


def resources(pid: int) -> dict[str, float]:
    """Return a process's own memory [MB], its open files and threads.

    Its own memory is what lies in the machine's memory and belongs to no file: what a leak takes. Shared memory is not
    in it, since a process that touches more and more of another one's segment, of fixed size, does not grow; that is
    counted by `shared_memory_files`.

    Args:
        pid: Its id; it must run.

    Raises:
        OSError: if it has ended, or belongs to another user.
    """
    status = Path(f"/proc/{pid}/status").read_text()
    figures = dict(re.findall(r"^(\w+):\s+(\d+)", status, re.MULTILINE))
    return {
        MEMORY: round(int(figures["RssAnon"]) / 1024.0, 3),
        FILES: float(len(list(Path(f"/proc/{pid}/fd").iterdir()))),
        THREADS: float(figures["Threads"]),
    }


def shared_memory_files(pids: Collection[int]) -> int:
    """Return how many files in shared memory belong to processes, or to nobody any more.

    What other programs of this machine have in use is not counted.

    Args:
        pids: Ids of the processes that are watched.
    """
    ours: set[str] = set()
    others: set[str] = set()
    for maps in Path("/proc").glob("[0-9]*/maps"):
        with contextlib.suppress(OSError):  # ended, or another user's
            found = set(re.findall(rf"{SHARED_MEMORY}/(\S+)", maps.read_text()))
            (ours if int(maps.parent.name) in pids else others).update(found)
    foreign = others - ours
    return sum(_segment(path.name) not in foreign for path in SHARED_MEMORY.iterdir())


def _segment(name: str) -> str:
    """Return the segment that a file belongs to: Fast DDS keeps locks and semaphores beside it, which nobody maps."""
    return re.sub(r"^sem\.|_mutex$|_[es]l$", "", name)
