"""A trial as a graph of processes, for tests: started as match.py does, watched, and ended without a trace."""

from __future__ import annotations

import os
import re
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray

from tulip_msgs.msg import Features, GameState, MotionState
from tulip_ros import topics
from tulip_ros.launch import Launcher
from tulip_ros.ports import GRAPH_PORTS, own_ports
from tulip_ros.run import session
from tulip_ros.transport import SHARED_MEMORY
from tulip_sim.match_graph import TrialWatcher, trial_plan

SOON = {"initial_time": 0.5, "ready_time": 0.5, "set_time": 1.0}
"""Times of the referee [s]: play begins soon."""
SILENCE = 60.0  # [s] of wall-clock time without the truth, after which a test has failed
PASSING = 5.0  # [s] in which a process has removed its files in shared memory, from when it closed them
OTHERS = 120.0  # [s] in which another test's graph has ended, and removed what its killed nodes left
SECOND = 1_000_000_000


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def shared_memory() -> set[str]:
    """Return the names of Fast DDS's files in shared memory."""
    return {path.name for path in SHARED_MEMORY.glob("*fastrtps_*")}


class Watcher(TrialWatcher):
    """Also hears motion and vision, and whether the robot ever fell."""

    def __init__(self) -> None:
        self.pictures = 0
        self.fell = False
        self.games: list[GameState] = []
        self.warnings: dict[str, set[str]] = {}
        super().__init__()
        self.reset = self.create_client(topics.RESET.type, topics.RESET.name)
        self.listen(topics.MOTION_STATE, self._on_motion)
        self.listen(topics.FEATURES, self._on_features)
        self.listen(topics.GAME_STATE, self.games.append)
        self.listen(topics.DIAGNOSTICS, self._on_diagnostics)

    def begin_anew(self) -> None:
        super().begin_anew()
        self.motion = MotionState()
        self.fell = False

    def _on_truth(self, message: Any) -> None:
        super()._on_truth(message)
        self.fell |= message.robot_fallen

    def _on_motion(self, message: MotionState) -> None:
        self.motion = message

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.warnings.setdefault(status.name, set()).add(status.message)

    def _on_features(self, message: Features) -> None:
        self.pictures += 1

    @property
    def walks(self) -> bool:
        """Whether the robot is well on its way: three steps since it last stood still for long."""
        return bool(self.motion.mode == MotionState.WALK and self.motion.step_count >= 3)


class Trial:
    """A running trial."""

    def __init__(self, launcher: Launcher, watcher: Watcher, spin: Callable[[float], None], port: int) -> None:
        self.launcher, self.watcher, self._spin, self.port = launcher, watcher, spin, port
        self.events: list[str] = []

    def until(self, condition: Callable[[], object], seconds: float) -> None:
        """Go on until something holds; it must within so many simulated seconds."""
        begin: int | None = None
        while not condition():
            self._spin(0.05)
            self.events += self.launcher.poll()
            now = self.watcher.stamp
            begin = now if begin is None or now < begin else begin
            state = f"at {now / SECOND:.2f} s, doing {self.watcher.doing!r}; {self.events}"
            assert now - begin < seconds * SECOND, f"it did not come to hold; {state}"
            assert time.monotonic() - self.watcher.heard < SILENCE, f"the simulator is silent; {state}"

    def kill(self, name: str) -> None:
        """End a node's process as a crash would."""
        os.kill(next(state.pid for state in self.launcher.states() if state.name == name), signal.SIGKILL)

    def restarts(self, name: str) -> int:
        return next(state.restarts for state in self.launcher.states() if state.name == name)

    def begin_anew(self, scenario: str, seed: int) -> None:
        """Call the simulator's reset, and wait until its time went back."""
        before = self.watcher.stamp
        answer = self.watcher.reset.call_async(topics.RESET.type.Request(scenario=scenario, seed=seed))
        self.until(answer.done, 5.0)
        assert answer.result().success, answer.result().message
        self.until(lambda: 0 < self.watcher.stamp < before, 5.0)


@contextmanager
def running_trial(
    logs: Path, scenario: str = "open", seed: int = 1, wire: bool = False, **rules: float
) -> Iterator[Trial]:
    """Run a trial, perhaps with the body behind a wire; afterwards no process and no shared memory may be left."""
    before = shared_memory()
    values: dict[str, dict[str, Any]] = {"emulator" if wire else "driver": {"rules": {**SOON, **rules}}}
    if wire:
        values["emulator"]["mode"] = "sync"  # a busy computer runs slower, not worse
    port = free_port()
    plan = trial_plan(seed, scenario, values=values, referee_port=port, wire_port=free_port() if wire else None)
    pids: set[int] = set()
    with (
        Launcher(plan, logs) as launcher,
        session(Watcher, arguments=["test"], handle_signals=False) as (watcher, spin),
    ):
        pids |= {state.pid for state in launcher.states()}
        yield Trial(launcher, watcher, spin, port)
        pids |= {state.pid for state in launcher.states()}
    assert {state.state for state in launcher.states()} == {"ended"}
    assert [pid for pid in pids if Path(f"/proc/{pid}").exists()] == []
    left = left_in_shared_memory(before)
    assert not left, left


def left_in_shared_memory(before: set[str]) -> set[str]:
    """Return the files that came since then, that nobody uses, and that stay.

    Nodes of other tests that begin, end or are killed at this moment have files that they have not opened yet, or
    closed already. Ports of other domains are theirs. Whose segments and ports of all domains are, nobody can tell:
    others' go away in the end.
    """
    begin = time.monotonic()
    left = {name for name in unused(shared_memory() - before) if not of_other_domain(name)}
    while left:
        passed = time.monotonic() - begin
        if passed > OTHERS or (passed > PASSING and any(map(of_own_domain, left))):
            break
        time.sleep(0.2)
        left = unused(left & shared_memory())
    return left


def of_own_domain(name: str) -> bool:
    """Return whether a file in shared memory is a port of the environment's domain."""
    port = re.search(r"fastrtps_port(\d+)", name)
    return port is not None and int(port[1]) in own_ports()


def of_other_domain(name: str) -> bool:
    """Return whether a file in shared memory is a port of one other domain."""
    port = re.search(r"fastrtps_port(\d+)", name)
    return port is not None and int(port[1]) not in own_ports() and int(port[1]) not in GRAPH_PORTS


def unused(names: set[str]) -> set[str]:
    """Return the files in shared memory that no living process, of another graph then, holds."""
    held: set[str] = set()
    for maps in Path("/proc").glob("[0-9]*/maps"):
        with suppress(OSError):  # it has ended
            held |= set(re.findall(rf"{SHARED_MEMORY}/(\S+)", maps.read_text()))
    return {name for name in names if re.sub(r"^sem\.|_(el|sl|mutex)$", "", name) not in held}
