"""Starts nodes, each a process; restarts one that died; ends all of them cleanly, the robot's body first."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic
from types import TracebackType

from tulip_ros import transport
from tulip_ros.ending import end_in_order
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
from tulip_ros.nodes import DRIVER
from tulip_ros.plan import Start

FIRST_PAUSE, LONGEST_PAUSE = 0.2, 10.0  # [s] before a restart; doubles with each death in a row
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


class Launcher:
    """Runs a plan's nodes.

    Example:
        >>> with Launcher(make_plan(driver="sim")) as launcher:  # doctest: +SKIP
        ...     while not finished():
        ...         launcher.poll()
    """

    def __init__(self, plan: Sequence[Start], log_folder: Path | None = None, transport_name: str = "auto") -> None:
        """Prepare; nothing is started yet.

        Args:
            plan: Nodes to start, in order.
            log_folder: Gets one log file a node; a new temporary folder by default.
            transport_name: "auto", "shared_memory" or "udp".

        Raises:
            BadInputError: if the log folder cannot be written.
        """
        try:
            if log_folder is None:
                log_folder = Path(tempfile.mkdtemp(prefix="tulip_log_"))
            log_folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInputError(f"Log folder {log_folder} cannot be made: {error.strerror}.") from error
        self.log_folder = log_folder
        self._transport = transport_name
        self._processes = [_Process(start, log_folder) for start in plan]

    def __enter__(self) -> Launcher:
        transport.remove_leftovers()
        transport.use_profile(self._transport)
        try:
            for process in self._processes:
                process.start()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def poll(self) -> list[str]:
        """Look after the processes and return what happened, one line each. Call it several times a second.

        Raises:
            BadInputError: if a node refused what it was given; it would do so again.
        """
        return [line for process in self._processes for line in process.poll()]

    def states(self) -> tuple[ProcessState, ...]:
        """Return how each process is, in the order of the plan."""
        return tuple(process.state() for process in self._processes)

    def stop(self) -> None:
        """End all processes: the body's driver first, the recorder last. Leave nothing of theirs behind."""
        drivers = [process for process in self._processes if process.node == DRIVER]
        recorders = [process for process in self._processes if process.node == "recorder"]
        others = [process for process in self._processes if process not in (*drivers, *recorders)]
        end_in_order(drivers, others, recorders)
        # Not only after a kill: now and then Fast DDS leaves a port behind of nodes that end at the same time.
        transport.remove_leftovers()


class _Process:
    def __init__(self, start: Start, log_folder: Path) -> None:
        self.name, self.node, self._start = start.full_name, start.name, start
        file = self.name.replace("/", ".")
        self._log = log_folder / f"{file}.log"
        self._command = start.command(log_folder / f"{file}.yaml")
        self._process: subprocess.Popen[bytes] | None = None
        self._started = 0.0
        self._restart_at = 0.0
        self._starts = 0
        self._deaths = 0
        self._given_up = False
        self._ended = False
        self._exit_code: int | None = None

    def start(self) -> None:
        with open(self._log, "ab") as log:
            self._process = subprocess.Popen(
                self._command,
                env={
                    "ROS_LOG_DIR": str(self._log.parent),
                    **os.environ,
                    "PYTHONUNBUFFERED": "1",
                    RESTARTS_VARIABLE: str(self._starts),
                },
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C reaches the launcher alone, which ends the nodes in order
                preexec_fn=partial(_die_with_parent, os.getpid()),
            )
        self._started = monotonic()
        self._starts += 1

    def poll(self) -> list[str]:
        now = monotonic()
        if self._process is None:
            if self._given_up or now < self._restart_at:
                return []
            self.start()
            assert self._process is not None
            return [f"{self.name} started again (process {self._process.pid})"]
        code = self._process.poll()
        if code is None:
            return []
        self._process, self._exit_code = None, code
        if code == EXIT_BAD_INPUT:
            self._given_up = True
            raise BadInputError(f"Node {self.name} refused what it was given: {self._refusal()}")
        self._deaths = 1 if now - self._started > SETTLED else self._deaths + 1
        if self._deaths >= DEATHS:
            self._given_up = True
            return [
                f"{self.name} died {DEATHS} times in a row and is given up; the end of {self._log}:\n{self._tail()}"
            ]
        pause = min(FIRST_PAUSE * 2 ** (self._deaths - 1), LONGEST_PAUSE)
        self._restart_at = now + pause
        how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        return [f"{self.name} {how}; starting it again in {pause:.1f} s (log: {self._log})"]

    def state(self) -> ProcessState:
        alive = self._process is not None
        words = "running" if alive else "ended" if self._ended else "given up" if self._given_up else "waiting"
        return ProcessState(
            self._start.name,
            words,
            self._process.pid if self._process else 0,
            max(self._starts - 1, 0),
            monotonic() - self._started if alive else 0.0,
            self._exit_code,
            self._start.namespace,
        )

    def signal(self, number: signal.Signals) -> None:
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(number)

    def has_ended(self) -> bool:
        return self._process is None or self._process.poll() is not None

    def forget(self) -> None:
        if self._process is not None:
            self._exit_code = self._process.wait()
        self._process, self._ended = None, True

    def _refusal(self) -> str:
        """Return the node's own words: what follows "error: " in its log."""
        _, mark, words = self._log.read_text(errors="replace").rpartition("error: ")
        return words.strip() if mark else f"the end of its log:\n{self._tail()}"

    def _tail(self) -> str:
        lines = self._log.read_text(errors="replace").splitlines()
        return "\n".join(f"  {line}" for line in lines[-TAIL:])


def _die_with_parent(parent: int) -> None:
    """In the child: ask to be ended when the launcher is killed, so that no node stays behind."""
    ctypes.CDLL(None).prctl(DIES_WITH_PARENT, signal.SIGTERM)
    if os.getppid() != parent:  # it died before this line
        os._exit(1)
