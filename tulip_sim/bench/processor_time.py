"""How long a process has computed."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path


def family_time(pid: int) -> float:
    """Return the time [s] that a process and all that it has started, and they, have run so far; 0 if it has ended."""
    children: dict[int, list[int]] = {}
    for path in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(path.name))
    total, waiting = 0.0, [pid]
    while waiting:
        one = waiting.pop()
        with contextlib.suppress(OSError):
            total += processor_time(one)
        waiting += children.get(one, [])
    return total


def processor_time(pid: int) -> float:
    """Return the time [s] that a process and all its threads have run so far, in user and system mode.

    Args:
        pid: Its id; it must run.
    """
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
