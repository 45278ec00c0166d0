"""Makes faults happen in a running graph while the robot walks, and tells what the robot then does."""

from __future__ import annotations

import os
import resource
import signal
import time
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState

from tulip_description.robot import LEG_PARTS, SIDES
from tulip_driver.guard import GuardParameters
from tulip_motion.parameters import MotionParameters
from tulip_msgs.msg import Decision, MotionState, WalkCommand
from tulip_ros import topics
from tulip_ros.launch import HUNG, Launcher
from tulip_ros.node_process import ProcessState
from tulip_ros.plan import Start, make_plan
from tulip_ros.run import session
from tulip_ros.time import stamp_of
from tulip_sim.bench.free_port import free_port
from tulip_sim.disturber_node import disturbed
from tulip_sim.fault_table import BREAKS, Reaction, Row, Way
from tulip_sim.match_graph import TrialWatcher, trial_plan
from tulip_sim.perception import PerceptionParameters

SCENARIO = "open"
RULES = {
    "initial_time": 0.5,
    "ready_time": 0.5,
    "set_time": 1.0,
    "playing_time": 3000.0,
    "ends_when_ball_is_out": False,
}
"""Play begins soon, and goes on and on."""
SLOW = 0.25  # times real time, where the simulation does not wait: no message is late by the machine's fault
END = 2.0  # [s] at the end of what is watched, in which a robot that stands or is limp does nothing else
SOFT = 2.0  # [N m] least torque in a leg that is not damping: of what still rolls, 0.4 were seen
MOST_DAMPING = {  # [N m s/rad] of a limp leg, by motion control, or by the driver while motion control is silent
    f"{side}_{part}": max(of_motion, of_driver)
    for side in SIDES
    for part, of_motion, of_driver in zip(
        LEG_PARTS, MotionParameters().limp_damping, GuardParameters().damping, strict=True
    )
}
SILENT = 0.3  # [s] without news of motion control, after which it is not known to do anything
SILENCE = 90.0  # [s] of wall-clock time without the simulator, after which the trial is given up
STOPPED, RUNNING = 0.06, 0.04  # [s] of wall-clock time that a slow node is stopped, and runs, in turn
SETTLING = 3.0  # [s] after a kill in which the robot may still fall
HELPED = 60.0  # [s] in which a node that hangs is started again
STALL = 3.0  # [s] of wall-clock time
PLAYING = ("robot > playing", "robot > kick under way")
"""Beginnings of what strategy says that it does."""
MOVING = (MotionState.WALK, MotionState.KICK)
SECOND = 1_000_000_000
RATE = 60  # samples that a second has at most


class Sample(NamedTuple):
    """The robot at one instant.

    Attributes:
        stamp: [ns].
        mode: Of motion control, None while it says nothing.
        torque: Greatest of a leg's joints since the sample before, less what may be damping [N m].
        fallen: Whether it lies, in truth.
        plays: Whether strategy has decided lately, and not only to stand.
    """

    stamp: int
    mode: int | None
    torque: float
    fallen: bool
    plays: bool


class FaultWatcher(TrialWatcher):
    """Follows what the robot does, and what its nodes say."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__()
        self.reset = self.create_client(topics.RESET.type, topics.RESET.name)
        self.listen(topics.MOTION_STATE, self._on_motion)
        self.listen(topics.JOINT_STATES, self._on_joints)
        topics.DIAGNOSTICS.subscribe_from(self, self._on_diagnostics)
        self.said: list[tuple[str, str]] = []
        """Names of nodes and what they said, with what they count."""

    def begin_anew(self) -> None:
        """Forget the trial before."""
        super().begin_anew()
        self.samples: list[Sample] = []
        self.motion: MotionState | None = None
        self._ahead: deque[tuple[int, float]] = deque()  # stamps [ns] after the last sample's, and torques [N m]
        self._speeds: dict[str, float] = {}
        self._decided = -SECOND
        self._wish: int | None = None  # of strategy for the legs

    @property
    def walks(self) -> bool:
        """Whether the robot is under way, was all through the last second, and strategy wishes it to go on.

        Without the last of these it may be about to stop by itself: a fault would then have nothing to do.
        """
        last = [sample for sample in self.samples[-RATE:] if sample.stamp > self.stamp - SECOND]
        steady = all(sample.mode == MotionState.WALK and not sample.fallen for sample in last)
        return steady and self._wish == WalkCommand.WALK and self.stamp > 3 * SECOND

    @property
    def over(self) -> bool:
        """Whether the trial has ended, by a goal."""
        return self.truth is not None and bool(self.truth.outcome)

    def _on_decision(self, message: Decision) -> None:
        super()._on_decision(message)
        self._decided, self._wish = stamp_of(message), int(message.walk.mode)

    def _on_motion(self, message: MotionState) -> None:
        self.motion = message

    def _on_joints(self, message: JointState) -> None:
        stamp, torque = stamp_of(message), 0.0
        before, self._speeds = self._speeds, {}
        for name, speed, effort in zip(message.name, message.velocity, message.effort, strict=True):
            if name in MOST_DAMPING:
                self._speeds[name] = abs(speed)
                most = max(abs(speed), before.get(name, 0.0))  # the effort is a mean since the message before
                torque = max(torque, abs(effort) - MOST_DAMPING[name] * most)
        # Topics overtake each other where the processor is short: each torque goes to the sample of its own time.
        place = bisect_left(self.samples, stamp, key=lambda sample: sample.stamp)
        if place == len(self.samples):
            self._ahead.append((stamp, torque))
        elif torque > self.samples[place].torque:
            self.samples[place] = self.samples[place]._replace(torque=torque)

    def _on_truth(self, message: Any) -> None:
        super()._on_truth(message)
        motion, now = self.motion, self.stamp
        silent = motion is None or now - stamp_of(motion) > SILENT * SECOND
        mode = None if silent or motion is None else int(motion.mode)
        plays = now - self._decided < SECOND and self.doing.startswith(PLAYING)
        torque = 0.0
        while self._ahead and self._ahead[0][0] <= now:
            torque = max(torque, self._ahead.popleft()[1])
        self.samples.append(Sample(now, mode, torque, bool(message.robot_fallen), plays))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.said += [(status.name, status.message)] + [(status.name, pair.key) for pair in status.values]


def reaction_of(samples: Sequence[Sample]) -> Reaction | None:
    """Return what a robot does by how it was from a fault on; None for none of what it may do."""
    if not samples:
        return None
    end = [sample for sample in samples if sample.stamp > samples[-1].stamp - END * SECOND]
    if all(sample.torque < SOFT and sample.mode not in (MotionState.STAND, *MOVING) for sample in end):
        return Reaction.LIMP
    if any(sample.fallen for sample in samples):
        return None
    if any(sample.plays for sample in end):  # who plays may stand for a while, and look for the ball
        moves = any(sample.mode in MOVING for sample in samples if sample.stamp > samples[0].stamp + SECOND)
        return Reaction.GOES_ON if moves else None
    return Reaction.STANDS if all(sample.mode == MotionState.STAND for sample in end) else None


def lies_softly(samples: Sequence[Sample]) -> bool:
    """Return whether the legs of a robot that lies only damp, from a second after its fall on."""
    since: int | None = None
    for sample in samples:
        since = None if not sample.fallen else sample.stamp if since is None else since
        if since is not None and sample.stamp > since + SECOND and sample.torque > SOFT:
            return False
    return True


class FaultTrial:
    """A running graph whose robot plays on and on."""

    def __init__(self, launcher: Launcher, watcher: FaultWatcher, spin: Callable[[float], None]) -> None:
        self.launcher, self.watcher, self._spin = launcher, watcher, spin
        self.events: list[str] = []
        self._seed = 1

    def go_on(self, until: Callable[[], object], seconds: float) -> bool:
        """Go on until something holds; return whether it did within so many simulated seconds.

        Raises:
            RuntimeError: if the simulator is silent for long.
        """
        begin: int | None = None
        while not until():
            self._spin(0.02)
            self.events += self.launcher.poll()
            now = self.watcher.stamp
            begin = now if begin is None or now < begin else begin
            if now - begin > seconds * SECOND:
                return False
            if time.monotonic() - self.watcher.heard > SILENCE:
                raise RuntimeError(f"the simulator is silent; see {self.launcher.log_folder}; {self.events[-5:]}")
        return True

    def walk(self) -> None:
        """Go on until the robot walks, in a new trial if this one has ended or it does not come to walk.

        Raises:
            RuntimeError: if it never walks.
        """
        for _ in range(4):
            if not self.watcher.over and self.go_on(lambda: self.watcher.walks or self.watcher.over, 60.0):
                if not self.watcher.over:
                    return
            self._begin_anew()
        raise RuntimeError(f"the robot does not come to walk; see {self.launcher.log_folder}; {self.events[-5:]}")

    def _begin_anew(self) -> None:
        """Begin another trial."""
        self._seed += 1
        before = self.watcher.stamp
        request = topics.RESET.type.Request(scenario=SCENARIO, seed=self._seed)
        answer = self.watcher.reset.call_async(request)
        self.go_on(lambda: answer.done() and 0 < self.watcher.stamp < before, 30.0)

    def process(self, name: str) -> ProcessState:
        """Return a node's process."""
        return next(state for state in self.launcher.states() if state.name == name)

    def send(self, name: str, number: signal.Signals) -> None:
        """Send a node's process a signal."""
        os.kill(self.process(name).pid, number)

    def react(self, row: Row) -> dict[str, Any]:
        """Make a row's fault happen, unless it begins by itself; return what the robot does, and whether it is told."""
        watcher = self.watcher
        if row.at_any_time:
            self.walk()
        else:
            self.go_on(lambda: watcher.stamp >= BREAKS * SECOND, 60.0)
        begin, watcher.said = watcher.stamp, []
        wall = time.monotonic()
        with self._ill(row):
            if row.way is Way.HUNG:
                restarts = self.process(row.node).restarts
                self.go_on(lambda: self.process(row.node).restarts > restarts, HELPED)
                begin = watcher.stamp
            # A goal ends the play, and says that the robot went on.
            self.go_on(lambda: watcher.over or watcher.stamp >= begin + row.seconds * SECOND, row.seconds + 5.0)
            wall = time.monotonic() - wall
            samples = [sample for sample in watcher.samples if sample.stamp >= begin]
        node, words = row.tells
        told = not node or any(name == node and words in said for name, said in watcher.said)
        found = reaction_of(samples)
        return {
            "fault": row.name,
            "stated": row.reaction.value,
            "observed": "something else" if found is None else found.value,
            "told": told,
            "fell": any(sample.fallen for sample in samples),
            "watched [s]": round((watcher.stamp - begin) / SECOND, 1),
            "wall clock [s]": round(wall, 1),
        }

    def kill(self, name: str, after: float) -> dict[str, Any]:
        """Kill a node while the robot walks; return when it is back, and what becomes of the robot.

        Args:
            name: Of the node.
            after: Simulated time that the robot goes on before [s].
        """
        watcher = self.watcher
        self.walk()
        begin = watcher.stamp
        self.go_on(lambda: watcher.stamp > begin + after * SECOND, after + 1.0)
        self.walk()
        known, begin, wall = self._in_graph(name), watcher.stamp, time.monotonic()
        self.send(name, signal.SIGKILL)
        watcher.motion = None
        came = self.go_on(lambda: self._in_graph(name) - known, 60.0)
        back = time.monotonic() - wall
        moves = self.go_on(lambda: watcher.over or self._moves_again(begin, name), 60.0)
        stamp, scored = watcher.stamp, watcher.over
        samples = [sample for sample in watcher.samples if sample.stamp >= begin or stamp < begin]
        if scored:  # the ball may have rolled on by itself: it is the next trial that tells
            self._begin_anew()
            moves = self.go_on(lambda: watcher.walks, 60.0)
        return {
            "node": name,
            "back [s]": round(back, 2) if came else None,
            "safe": lies_softly(samples),
            "upright": not any(sample.fallen for sample in samples),
            "plays on": moves,
            "plays on after [s]": (
                round((stamp - (begin if stamp > begin else 0)) / SECOND, 1) if moves and not scored else None
            ),
        }

    def _moves_again(self, killed: int, name: str) -> bool:
        """Return whether the robot walks, some time after a node was killed at a stamp [ns]."""
        watcher = self.watcher
        if name == "driver":  # another world, whose time began anew
            return 0 < watcher.stamp < killed and watcher.walks
        return watcher.walks and watcher.stamp > killed + SETTLING * SECOND

    def _in_graph(self, name: str) -> set[bytes]:
        """Return the graph's names for the node's sender of diagnostics, each process's another."""
        found = self.watcher.get_publishers_info_by_topic(self.watcher.resolve_topic_name(topics.DIAGNOSTICS.name))
        return {bytes(each.endpoint_gid) for each in found if each.node_name == name}

    @contextmanager
    def _ill(self, row: Row) -> Iterator[None]:
        """Have a process be ill, in the way that a row says."""
        if row.no_room:
            pid = self.process(row.no_room).pid
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (1, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
        if row.way is None:
            yield
            return
        pid = self.process(row.node).pid
        if row.way is Way.SLOW:
            with _slowed(pid):
                yield
            return
        os.kill(pid, signal.SIGSTOP)
        try:
            if row.way is Way.STALLED:
                end = time.monotonic() + STALL
                while time.monotonic() < end:
                    self._spin(0.02)
                    self.events += self.launcher.poll()
                os.kill(pid, signal.SIGCONT)
            yield
        finally:
            if self.process(row.node).pid == pid:  # else the launcher has started it again
                os.kill(pid, signal.SIGCONT)


@contextmanager
def _slowed(pid: int) -> Iterator[None]:
    """Have a process run two fifths of the time."""
    child = os.fork()
    if child == 0:  # a process of its own: this one has to watch
        try:
            while os.getppid() != 1:
                os.kill(pid, signal.SIGSTOP)
                time.sleep(STOPPED)
                os.kill(pid, signal.SIGCONT)
                time.sleep(RUNNING)
        finally:
            os._exit(0)
    try:
        yield
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.kill(pid, signal.SIGCONT)


def plan_of(row: Row | None, seed: int, folder: Path) -> tuple[Start, ...]:
    """Return the graph for a row, or for all those that need none of their own."""
    driver: dict[str, Any] = {"rules": RULES, "hands": row is None}
    values: dict[str, dict[str, Any]] = {"driver": driver}
    if row is None:
        return trial_plan(seed, SCENARIO, folder / "recording", values=values, referee_port=free_port())
    if row.sensor:
        driver["world"] = {"faults": [f"{row.sensor} {BREAKS}"]}
    if row.free:
        driver.update(mode="free", speed=SLOW)
    # Pictures would be the machine's whole work, where they are not what breaks.
    perception = None if row.sensor == "camera" else PerceptionParameters()
    plan = trial_plan(seed, SCENARIO, values=values, referee_port=free_port(), perception=perception)
    if not row.disturbed:
        return plan
    own = {"topics": list(row.disturbed), "begin": BREAKS, **row.disturbance}
    return (*disturbed(plan, row.disturbed), *make_plan(["disturber"], None, values={"disturber": own}, simulated=True))


@contextmanager
def running(plan: Sequence[Start], logs: Path, hung: float = HUNG) -> Iterator[FaultTrial]:
    """Run a graph, whose launcher kills nodes without a sign of life for some time [s]; 0 for never."""
    with (
        Launcher(plan, logs, hung=hung) as launcher,
        session(FaultWatcher, [], handle_signals=False) as (watcher, spin),
    ):
        yield FaultTrial(launcher, watcher, spin)
