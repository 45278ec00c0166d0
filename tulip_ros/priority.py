"""Programs that only look give way to the nodes that play: they compute where those leave time."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

NICE = 10  # a tenth of the weight of a process that does not give way: still enough to go on beside two that never rest
GROUP = Path("/proc/self/autogroup")


def give_way() -> None:
    """Lower the priority of this process. Call it before others of its threads begin: they inherit it.

    Linux weighs sessions against each other first, and processes within one session after that. The launcher gives each
    node a session of its own; this process's is lowered only where it leads it, not the one of a user's terminal.
    """
    os.setpriority(os.PRIO_PROCESS, 0, max(NICE, os.getpriority(os.PRIO_PROCESS, 0)))
    if os.getsid(0) == os.getpid():
        with contextlib.suppress(OSError):  # a system without such groups
            GROUP.write_text(str(NICE))
