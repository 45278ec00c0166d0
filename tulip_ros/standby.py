"""A process that has imported what the robot's nodes need, and waits to become one of them.

Most of a node's start is importing: with it a killed node would be back after seconds, without it much sooner.

    python -m tulip_ros.standby MODULE...

imports the modules one after the other, and waits for a line on its standard input: what to become (see `Role`). If the
line is there before all are imported, the rest is left.
"""

from __future__ import annotations

import importlib
import json
import os
import runpy
import select
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Role:
    """What a process becomes.

    Attributes:
        module: As in `python -m MODULE`.
        arguments: That follow it.
        environment: Variables that differ from those that the process has.
        log: File for what it writes.
    """

    module: str
    arguments: Sequence[str]
    environment: Mapping[str, str]
    log: str

    def line(self) -> bytes:
        """Return the line for the waiting process."""
        return json.dumps(asdict(self)).encode() + b"\n"


def play(role: Role) -> None:
    """Be that program from now on."""
    for file, mode, numbers in ((os.devnull, os.O_RDONLY, (0,)), (role.log, os.O_WRONLY | os.O_APPEND, (1, 2))):
        opened = os.open(file, mode | os.O_CREAT, 0o644)
        for number in numbers:
            os.dup2(opened, number)
        os.close(opened)
    os.environ.update(role.environment)
    sys.argv[1:] = role.arguments
    sys.modules.pop(role.module, None)  # it is run once more, under the name __main__
    runpy.run_module(role.module, run_name="__main__", alter_sys=True)


def main() -> None:
    """Import, wait, and become what the line says; end where the launcher does without a word."""
    for name in sys.argv[1:]:
        if select.select([sys.stdin], [], [], 0.0)[0]:
            break
        importlib.import_module(name)
    line = sys.stdin.readline()
    if line:
        play(Role(**json.loads(line)))


if __name__ == "__main__":
    main()
