"""Two computers on one cable, for tests: namespaces with networks, processes, mounts and shared memory of their own.

They have no names on this machine. The system ends whatever runs in one, and takes back its side of the cable, when the
first process of it ends, which ends with this process, however that ends.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO

ADDRESSES = ("10.217.64.1", "10.217.64.2")
PATIENCE = 30.0  # [s] of wall-clock time for what takes a fraction of a second
DIES_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)
SET_UP = "mount -t tmpfs -o size=1g tmpfs /dev/shm && ip link set lo up && echo ready && exec sleep infinity"


class NotAllowedError(Exception):
    """This process may not make such computers, or a tool for it is missing; the message says which."""


class Machine:
    """One of them."""

    def __init__(self, address: str) -> None:
        """Make it, with no cable in it.

        Raises:
            NotAllowedError: if the system does not let this process.
        """
        self.address = address
        command = ["unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]
        self._first = subprocess.Popen(
            [*command, "sh", "-c", SET_UP],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=_die_with_parent,
        )
        assert self._first.stdout is not None and self._first.stderr is not None
        if self._first.stdout.readline() != "ready\n":
            words = self._first.stderr.read().strip()
            self.end()
            raise NotAllowedError(words or "unshare ended without a word")
        self.pid = _child_of(self._first.pid)

    def start(self, *command: str, log: Path | None = None) -> Program:
        """Start a program in it.

        Args:
            command: Program and arguments.
            log: Gets what it says on standard error.
        """
        return Program(["nsenter", "--target", str(self.pid), "--net", "--mount", "--pid", "--", *command], log)

    def ip(self, *arguments: str) -> None:
        """Run ip(8) in it."""
        command = ["nsenter", "--target", str(self.pid), "--net", "--", "ip", *arguments]
        subprocess.run(command, check=True, capture_output=True)

    def shared_memory(self) -> set[str]:
        """Return the names of Fast DDS's files in its shared memory."""
        return {path.name for path in Path(f"/proc/{self.pid}/root/dev/shm").glob("*fastrtps_*")}

    def end(self) -> None:
        """End it and all that runs in it."""
        self._first.kill()
        self._first.wait()
        for pipe in (self._first.stdout, self._first.stderr):
            if pipe is not None:
                pipe.close()


class Program:
    """A program in a machine, spoken to by lines."""

    def __init__(self, command: Sequence[str], log: Path | None) -> None:
        errors: IO[bytes] | int = open(log, "wb") if log is not None else subprocess.DEVNULL
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True
        )
        if not isinstance(errors, int):
            errors.close()

    def ask(self, line: str = "") -> str:
        """Say a line, unless it is empty, and return the line that it answers; "" when it has ended."""
        assert self._process.stdin is not None and self._process.stdout is not None
        if line:
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()
        return self._process.stdout.readline().strip()

    def end(self) -> int:
        """Ask it to end, wait until it has, and return its exit code."""
        os.kill(_child_of(self._process.pid), signal.SIGTERM)  # nsenter, which waits for it, does not pass it on
        code = self._process.wait(PATIENCE)
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        return code


class Cable:
    """Two machines and what is between them."""

    def __init__(self, robot: Machine, operator: Machine) -> None:
        self.robot, self.operator = robot, operator
        pair = ("eth0", "netns", str(robot.pid), "type", "veth", "peer", "name", "eth0", "netns", str(operator.pid))
        subprocess.run(["ip", "link", "add", *pair], check=True, capture_output=True)
        for machine in (robot, operator):
            machine.ip("address", "add", f"{machine.address}/24", "dev", "eth0")
            machine.ip("link", "set", "eth0", "up")

    def cut(self) -> None:
        """Let nothing through: the operator's end goes down, the robot's end has no carrier."""
        self.operator.ip("link", "set", "eth0", "down")

    def mend(self) -> None:
        self.operator.ip("link", "set", "eth0", "up")


@contextmanager
def two_machines() -> Iterator[Cable]:
    """Yield a robot's and an operator's computer on a cable, and end them.

    Raises:
        NotAllowedError: if that is not possible here.
    """
    missing = [tool for tool in ("ip", "unshare", "nsenter") if shutil.which(tool) is None]
    if missing:
        raise NotAllowedError(f"there is no {', '.join(missing)} here")
    if os.geteuid() != 0:
        raise NotAllowedError("only root may make network namespaces")
    machines: list[Machine] = []
    try:
        for address in ADDRESSES:
            machines.append(Machine(address))
        try:
            cable = Cable(*machines)
        except subprocess.CalledProcessError as error:
            raise NotAllowedError(error.stderr.decode().strip()) from error
        yield cable
    finally:
        for machine in machines:
            machine.end()


def _child_of(pid: int) -> int:
    """Return the process that a process has started, as soon as it has."""
    end = time.monotonic() + PATIENCE
    while True:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        if children:
            return int(children[0])
        assert time.monotonic() < end, f"process {pid} has started nothing"
        time.sleep(0.01)


def _die_with_parent() -> None:
    ctypes.CDLL(None).prctl(DIES_WITH_PARENT, signal.SIGKILL)
