"""Starts nodes, each a process; restarts one that died or hangs; ends all of them cleanly, the robot's body first.

A node that dies is started again: at once the first time, then after pauses that double. One that dies again and again
is given up, and the robot is brought to stand still (see `tulip_ros.safe_state`). One that gives no sign of life while
others do is killed, and started again.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from threading import Thread
from time import monotonic
from types import TracebackType

from tulip_ros import transport
from tulip_ros.ending import end_in_order
from tulip_ros.errors import BadInputError
from tulip_ros.node_process import NodeProcess, ProcessState, Standby, needed
from tulip_ros.nodes import DRIVER
from tulip_ros.plan import Start

HUNG = 10.0  # [s] without a sign of life, of which one comes each second: no callback of a node takes a tenth of that
LIVELY = 3.0  # [s] since the last sign of some other node: else it is the machine that stands still, not the node
ABSENT = 2.0  # [s] between two polls after which the launcher itself was held up, and begins to watch anew
BUSY = 10.0  # [s] since the first start, in which the processor has better to do than to have a process wait
JOINING = 3.0  # [s] since the last start, in which a node and all others get to know each other
CALM = 5.0  # [s] since the last start, after which there is time to tidy up


class Launcher:
    """Runs a plan's nodes.

    Example:
        >>> with Launcher(make_plan(driver="sim")) as launcher:  # doctest: +SKIP
        ...     while not finished():
        ...         launcher.poll()
    """

    def __init__(
        self, plan: Sequence[Start], log_folder: Path | None = None, transport_name: str = "auto", hung: float = HUNG
    ) -> None:
        """Prepare; nothing is started yet.

        Args:
            plan: Nodes to start, in order.
            log_folder: Gets one log file a node; a new temporary folder by default.
            transport_name: "auto", "shared_memory" or "udp".
            hung: A node without a sign of life for so long is killed and started again [s]; 0 for never.

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
        self._transport, self._hung = transport_name, hung
        # By being imported, a node of this project does nothing; of others one cannot know.
        modules = [each.entry.module for each in reversed(plan) if needed(each.entry)]
        modules = [name for name in dict.fromkeys(modules) if name.startswith("tulip_")]
        self._standby = Standby(modules, log_folder / "standby.log") if modules else None
        self._processes = [NodeProcess(start, log_folder, self._standby) for start in plan]
        self._requests: dict[tuple[str, str], subprocess.Popen[bytes]] = {}  # by namespace and wish, see safe_state
        self._tidying: Thread | None = None
        self._untidy = False
        self._killed = ("", 0)  # name of the process that was killed last since it hung, and which of its lives
        self._first_start = self._last_start = self._last_poll = self._watching_since = 0.0

    def __enter__(self) -> Launcher:
        transport.remove_leftovers()
        transport.use_profile(self._transport)
        try:
            for process in self._processes:
                process.start()
        except BaseException:
            self.stop()
            raise
        self._first_start = self._last_start = self._last_poll = self._watching_since = monotonic()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def given_up(self) -> tuple[str, ...]:
        """Names of the nodes that died again and again, and are not started any more."""
        return tuple(process.name for process in self._processes if process.given_up)

    def poll(self) -> list[str]:
        """Look after the processes and return what happened, one line each. Call it several times a second.

        Raises:
            BadInputError: if a node refused what it was given; it would do so again.
        """
        now = monotonic()
        if now - self._last_poll > ABSENT:
            self._watching_since = now
        self._last_poll = now
        said = []
        for process in self._processes:
            gone, before = process.given_up, process.starts
            said += process.poll()
            if process.starts != before:
                self._last_start, self._untidy = now, True
            if process.given_up and not gone and process.plays:
                said += self._stand_still(process)
        said += self._kill_hung(now)
        said += self._heed_answers()
        if self._standby is not None and now - self._first_start > BUSY and now - self._last_start > JOINING:
            if all(each.last_beat for each in self._processes if each.plays):
                self._standby.start()  # not before: nodes that start, and all that get to know them, need the processor
        if self._untidy and now - self._last_start > CALM:
            self._tidy_up()
        return said

    def states(self) -> tuple[ProcessState, ...]:
        """Return how each process is, in the order of the plan."""
        return tuple(process.state() for process in self._processes)

    def stop(self) -> None:
        """End all processes: the body's driver first, the recorder last. Leave nothing of theirs behind."""
        drivers = [process for process in self._processes if process.entry.name == DRIVER]
        recorders = [process for process in self._processes if process.entry.name == "recorder"]
        others = [process for process in self._processes if process not in (*drivers, *recorders)]
        end_in_order(drivers, others, recorders)
        for request in self._requests.values():
            request.kill()
            request.wait()
        if self._standby is not None:
            self._standby.end()
        if self._tidying is not None:
            self._tidying.join()
        # Not only after a kill: now and then Fast DDS leaves a port behind of nodes that end at the same time.
        transport.remove_leftovers()

    def _kill_hung(self, now: float) -> list[str]:
        """Kill nodes that give no sign of life while others do."""
        beats = {process: beat for process in self._processes if (beat := process.last_beat) is not None}
        said = []
        for process, beat in beats.items():
            silent = now - max(beat, self._watching_since)
            others = [now - other for each, other in beats.items() if each is not process]
            life = (process.name, process.starts)
            if self._hung and silent > self._hung and life != self._killed and (not others or min(others) < LIVELY):
                process.signal(signal.SIGKILL)
                self._killed = life  # it takes a moment to die
                said.append(f"{process.name} gives no sign of life for {silent:.0f} s, and is killed")
        return said

    def _stand_still(self, process: NodeProcess) -> list[str]:
        """Bring a robot without one of its nodes to stand still."""
        said = [f"{process.name} is missing: the robot of {process.namespace or 'this graph'} must not play on"]
        if process.entry.name == "motion":
            self._tell(process.namespace, "limp")
            return [*said, "without motion control the robot is limp"]
        if not any(each.entry.name == "user_input" and not each.given_up for each in self._robot(process.namespace)):
            return said + self._end_strategy(process.namespace)
        self._tell(process.namespace, "stand")
        return said

    def _tell(self, namespace: str, wish: str) -> None:
        """Have a robot told what to do, beside the work."""
        if (namespace, wish) not in self._requests:
            command = [sys.executable, "-m", "tulip_ros.safe_state", namespace, wish]
            with open(self.log_folder / "safe_state.log", "ab") as log:
                self._requests[namespace, wish] = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
                )

    def _heed_answers(self) -> list[str]:
        """Take the answers to what `_stand_still` asked for."""
        said = []
        for (namespace, wish), request in list(self._requests.items()):
            code = request.poll()
            if code is None:
                continue
            del self._requests[namespace, wish]
            if code == 0:
                said.append("the robot was told to stand" if wish == "stand" else "the emergency stop holds")
            elif wish == "stand":
                said += self._end_strategy(namespace)
        return said

    def _end_strategy(self, namespace: str) -> list[str]:
        """End who tells motion control to walk; it stops by itself then."""
        robot = self._robot(namespace)
        strategies = [process for process in robot if process.entry.name == "strategy" and not process.has_ended()]
        end_in_order((), strategies, ())
        return [f"{process.name} was ended: motion control stops walking and stands" for process in strategies]

    def _robot(self, namespace: str) -> list[NodeProcess]:
        return [process for process in self._processes if process.namespace == namespace]

    def _tidy_up(self) -> None:
        """Remove the shared memory of nodes that were killed, beside the work."""
        if self._tidying is None or not self._tidying.is_alive():
            self._tidying = Thread(target=transport.remove_dead_segments)
            self._tidying.start()
            self._untidy = False
