"""One node's process: started, watched, restarted with growing pauses, ended."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic

from tulip_ros import heartbeat, keepsake
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
from tulip_ros.heartbeat import Pulse
from tulip_ros.keepsake import Memory
from tulip_ros.nodes import DRIVER, NodeEntry
from tulip_ros.plan import Start
from tulip_ros.standby import Role

FIRST_PAUSE, LONGEST_PAUSE = 0.2, 10.0  # [s] before a second restart in a row; doubles with each. The first is at once
SETTLED = 20.0  # [s] of life after which earlier deaths are forgotten
DEATHS = 6  # in a row, after which a node is given up
RESTARTS_VARIABLE = "TULIP_RESTARTS"
"""Environment variable that tells a node how many times it was started again."""
DIES_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)
TAIL = 15  # lines of a dead node's log in messages


@dataclass(frozen=True)
class ProcessState:
    """How one node's process is.

    Attributes:
        name: Name of the node.
        state: "running", "waiting" (for its restart), "given up" or "ended".
        pid: Process id, or 0.
        restarts: How many times it was started again.
        uptime: Since its last start [s], or 0.
        exit_code: Of its last end (minus the signal's number), or None.
        namespace: As in "striker", or "".
    """

    name: str
    state: str
    pid: int
    restarts: int
    uptime: float
    exit_code: int | None
    namespace: str = ""


class Child:
    """A process, with its signs of life.

    Args:
        command: Command line.
        log: File that what it writes is added to.
        environment: Variables that differ from those of this process.
        reads: Whether it is written to.
    """

    def __init__(self, command: Sequence[str], log: Path, environment: Mapping[str, str], reads: bool = False) -> None:
        self.pulse = Pulse()
        with open(log, "ab") as file:
            self.process = subprocess.Popen(
                command,
                env={
                    "ROS_LOG_DIR": str(log.parent),
                    **os.environ,
                    "PYTHONUNBUFFERED": "1",
                    heartbeat.VARIABLE: str(self.pulse.inlet),
                    **environment,
                },
                stdin=subprocess.PIPE if reads else subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                pass_fds=(self.pulse.inlet,),
                start_new_session=True,  # Ctrl-C reaches the launcher alone, which ends the nodes in order
                preexec_fn=partial(_die_with_parent, os.getpid()),
            )

    def become(self, role: Role) -> None:
        """Have a process that waits become a node.

        Raises:
            OSError: if it has died meanwhile.
        """
        assert self.process.stdin is not None
        with self.process.stdin as line:
            line.write(role.line())

    def end(self) -> int:
        """Kill it if it lives; return its exit code."""
        self.process.kill()
        self.pulse.close()
        return self.process.wait()


class Standby:
    """A process that imports what nodes need, and then waits; whoever needs one takes it.

    Args:
        modules: To be imported.
        log: File for what it writes while it waits.
    """

    def __init__(self, modules: Sequence[str], log: Path) -> None:
        self._command, self._log = [sys.executable, "-m", "tulip_ros.standby", *modules], log
        self._child: Child | None = None

    def start(self) -> None:
        """Have one wait, if none does."""
        if self._child is None:
            self._child = Child(self._command, self._log, {}, reads=True)

    def take(self, role: Role) -> Child | None:
        """Have the one that waits become a node, and return it; None if there is none."""
        child, self._child = self._child, None
        if child is None:
            return None
        try:
            child.become(role)
        except OSError:  # it has died meanwhile
            child.end()
            return None
        return child

    def end(self) -> None:
        """End the one that waits."""
        if self._child is not None:
            self._child.end()
            self._child = None


class NodeProcess:
    """A node of a plan, and the process that it has at present.

    Args:
        start: What to run.
        log_folder: Of its log and parameters.
        standby: Whose process is taken for a restart; None for none.
    """

    def __init__(self, start: Start, log_folder: Path, standby: Standby | None = None) -> None:
        self.name, self.entry, self.namespace = start.full_name, start.entry, start.namespace
        file = self.name.replace("/", ".")
        self._log = log_folder / f"{file}.log"
        self._command = start.command(log_folder / f"{file}.yaml")
        self._standby = standby
        self._memory = Memory(file)
        self._child: Child | None = None
        self._started = 0.0
        self._restart_at = 0.0
        self.starts = 0
        """How often it was started."""
        self._deaths = 0
        self._exit_code: int | None = None
        self.given_up = self._ended = False
        """Given up: it died too often, and is not started again."""

    @property
    def plays(self) -> bool:
        """Whether the robot needs it to play."""
        return needed(self.entry)

    def start(self) -> None:
        """Start it, from a process that waits if there is one."""
        environment = {RESTARTS_VARIABLE: str(self.starts), keepsake.VARIABLE: self._memory.path}
        self._child = self._from_standby(environment) or Child(self._command, self._log, environment)
        self._started = monotonic()
        self.starts += 1

    def _from_standby(self, environment: Mapping[str, str]) -> Child | None:
        if self._standby is None or not self.starts or not self.plays:
            return None
        _, _, module, *arguments = self._command  # python -m MODULE ...
        return self._standby.take(Role(module, arguments, environment, str(self._log)))

    def poll(self) -> list[str]:
        """Look after the process, restart it if it died; return what happened, one line each.

        Raises:
            BadInputError: if the node refused what it was given; it would do so again.
        """
        now = monotonic()
        if self._child is None:
            if self.given_up or self._ended or now < self._restart_at:
                return []
            return [self._start_again()]
        code = self._child.process.poll()
        if code is None:
            self._child.pulse.feel(now)
            return []
        self._child.end()
        self._child, self._exit_code = None, code
        if code == EXIT_BAD_INPUT:
            self.given_up = True
            raise BadInputError(f"Node {self.name} refused what it was given: {self._refusal()}")
        self._deaths = 1 if now - self._started > SETTLED else self._deaths + 1
        if self._deaths >= DEATHS:
            self.given_up = True
            return [
                f"{self.name} died {DEATHS} times in a row and is given up; the end of {self._log}:\n{self._tail()}"
            ]
        how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        if self._deaths == 1:
            return [f"{self.name} {how}; starting it again (log: {self._log})", self._start_again()]
        pause = min(FIRST_PAUSE * 2 ** (self._deaths - 2), LONGEST_PAUSE)
        self._restart_at = now + pause
        return [f"{self.name} {how}; starting it again in {pause:.1f} s (log: {self._log})"]

    def _start_again(self) -> str:
        self.start()
        assert self._child is not None
        return f"{self.name} started again (process {self._child.process.pid})"

    @property
    def last_beat(self) -> float | None:
        """When it gave its last sign of life, on the wall clock [s]; None if it never did since its start."""
        return None if self._child is None else self._child.pulse.last

    def state(self) -> ProcessState:
        """Return how it is."""
        child = self._child
        words = "running" if child else "ended" if self._ended else "given up" if self.given_up else "waiting"
        return ProcessState(
            self.entry.name,
            words,
            child.process.pid if child else 0,
            max(self.starts - 1, 0),
            monotonic() - self._started if child else 0.0,
            self._exit_code,
            self.namespace,
        )

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal, if it lives."""
        if self._child is not None and self._child.process.poll() is None:
            self._child.process.send_signal(number)

    def has_ended(self) -> bool:
        """Return whether no process of it lives."""
        return self._child is None or self._child.process.poll() is not None

    def forget(self) -> None:
        """Wait for its end, which is near, and do not start it again."""
        if self._child is not None:
            self._exit_code = self._child.end()
        if not self._ended:
            self._memory.close()
        self._child, self._ended = None, True

    def _refusal(self) -> str:
        """Return the node's own words: what follows "error: " in its log."""
        _, mark, words = self._log.read_text(errors="replace").rpartition("error: ")
        return words.strip() if mark else f"the end of its log:\n{self._tail()}"

    def _tail(self) -> str:
        lines = self._log.read_text(errors="replace").splitlines()
        return "\n".join(f"  {line}" for line in lines[-TAIL:])


def needed(entry: NodeEntry) -> bool:
    """Return whether a robot needs a node to play."""
    return entry.playing or entry.name == DRIVER


def _die_with_parent(parent: int) -> None:
    """In the child: ask to be ended when the launcher is killed, so that no node stays behind."""
    ctypes.CDLL(None).prctl(DIES_WITH_PARENT, signal.SIGTERM)
    if os.getppid() != parent:  # it died before this line
        os._exit(1)
