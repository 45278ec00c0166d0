"""How long a process has computed."""

from __future__ import annotations

import os
from pathlib import Path


def processor_time(pid: int) -> float:
    """Return the time [s] that a process and all its threads have run so far, in user and system mode.

    Args:
        pid: Its id; it must run.
    """
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
