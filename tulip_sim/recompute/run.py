"""Recomputes a recording: inputs through today's cores, in the order of the run, as fast as they go."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tulip_description.frames import MAP
from tulip_ros import schemas, topics
from tulip_ros.bag import Bag
from tulip_ros.errors import BadInputError, unknown
from tulip_ros.log_edit import writing
from tulip_ros.log_file import Log, LoggedTopic
from tulip_ros.serialized import after_header, time_at
from tulip_sim.recompute.decisions import HeadStage, StrategyStage
from tulip_sim.recompute.decoding import COMPRESSED, RAW
from tulip_sim.recompute.differences import Comparison, Difference
from tulip_sim.recompute.heard import UNIX_TIME, Heard, Made, Stage
from tulip_sim.recompute.line import Line
from tulip_sim.recompute.settings import RobotParameters, parameters_of
from tulip_sim.recompute.truth import Judge, Judgement
from tulip_sim.recompute.vision import VisionStage
from tulip_sim.recompute.world_model import WorldModelStage

COMPONENTS = ("vision", "worldmodel", "strategy", "head")
"""What can be computed anew, in the order of the data flow."""
NEEDED: dict[str, tuple[str, ...]] = {
    "vision": (topics.ODOMETRY.name, topics.JOINT_STATES.name, topics.FEATURES.name),
    "worldmodel": (topics.ODOMETRY.name, topics.FEATURES.name, topics.WORLD_STATE.name),
    "strategy": (topics.WORLD_STATE.name, topics.MOTION_STATE.name, topics.DECISION.name),
    "head": (topics.HEAD_COMMAND.name, topics.JOINT_STATES.name, topics.HEAD_JOINT_COMMAND.name),
}
"""Topics without which a component cannot be computed anew: its inputs, and what tells when it spoke."""
FIRST = 8  # [B] place of the first transform in a serialized /tf message, after their number
PROGRESS = 500  # messages between two reports


@dataclass(frozen=True)
class Outcome:
    """What came out.

    Attributes:
        differences: By full topic name.
        judgements: Against the truth, by the robot's namespace; recorded and recomputed.
        shortcomings: What could not be computed as it was, in words with a number.
        lockstep: Whether the recording is one of a lockstep, whose order of inputs is exact.
        lossy: Whether vision worked on pictures that the recording compressed with losses.
        seconds: Length of the recording [s].
    """

    differences: Mapping[str, Difference]
    judgements: Mapping[str, tuple[Judgement, Judgement]]
    shortcomings: Sequence[str]
    lockstep: bool
    lossy: bool
    seconds: float


def recompute(
    log: Log,
    components: Sequence[str],
    folder: Path | None = None,
    parameter_files: Sequence[Path] = (),
    progress: Callable[[float], None] | None = None,
    judge: bool = True,
    beside: bool = True,
) -> Outcome:
    """Compute components anew.

    Args:
        log: The recording.
        components: Some of `COMPONENTS`.
        folder: For a new recording with the recomputed topics in place of the recorded ones, all others copied; None
            for none.
        parameter_files: YAML files that win over the parameters that the recording notes.
        progress: Told the recorded time passed [s].
        judge: Compare with the ground truth, where it is recorded.
        beside: Compute in processes of their own, where there are cores for them.

    Raises:
        BadInputError: if a component is not known or its inputs are not recorded, if parameters cannot be used, or if
            the new recording cannot be written.
    """
    robots = _robots(log, components, parameter_files, judge, beside)
    try:
        if folder is None:
            return _run(log, robots, None, progress)
        with writing(folder) as bag:
            bag.copy_notes(log)
            return _run(log, robots, bag, progress)
    finally:
        for robot in robots:
            robot.line.close()


class _Robot:
    """The line of one robot, and the comparison of what it says."""

    def __init__(
        self, log: Log, namespace: str, components: Sequence[str], p: RobotParameters, judge: bool, beside: bool
    ) -> None:
        self.namespace, self._log = namespace, log
        stages: list[Stage] = []
        self.pictures = ""
        if "vision" in components:
            self.pictures = _pictures(log, namespace)
            stages.append(VisionStage(p.vision, self.pictures))
        if "worldmodel" in components:
            stages.append(WorldModelStage(p.worldmodel, p.field, p.start))
        if "strategy" in components:
            stages.append(StrategyStage(p.strategy, p.field, p.game_input.stale_after))
        if "head" in components:
            stages.append(HeadStage(p.head))
        self._writes = frozenset().union(*(stage.writes for stage in stages))
        self._flow = frozenset().union(*(stage.reads for stage in stages)) | self._writes
        # What was not recorded has nothing to be compared with; the new recording holds it all the same.
        self.comparisons = {
            name: Comparison(name) for name in sorted(self._writes) if _full(namespace, name) in log.topics
        }
        self.lossy = False
        self._forgotten = p.forgotten
        self._without_parameters = [name for name in components if name not in p.noted]
        has_truth = judge and _full(namespace, topics.GROUND_TRUTH.name) in log.topics
        self.judge = Judge(p.field, self._writes) if has_truth else None
        self.reads = self._flow | (self.judge.reads if self.judge else frozenset())
        self.bag: Bag | None = None
        self._topics: dict[str, LoggedTopic] = {}
        self.line = Line(log.path, {_full(namespace, name): name for name in self._flow}, stages, beside)

    def replaces(self, name: str, data: bytes) -> bool:
        """Return whether a recorded message is replaced by a recomputed one."""
        # Motion control says on the same topic where the body lies in odom.
        return name in self._writes and (name != topics.TF.name or _parent(data) == MAP)

    def take(self, heard: Heard) -> None:
        """Take a recorded message of one of the robot's topics, and what the components say to it."""
        name, record = heard.name, heard.record
        if self.replaces(name, record.data):
            stamp = time_at(record.data, FIRST) if name == topics.TF.name else heard.stamp
            self.comparisons[name].add_recorded(stamp, record.log_time, record.data, lambda: heard.message)
        elif self.bag is not None:
            self.bag.copy(record)
        if self.judge is not None:
            self.judge.take_recorded(heard)
        if name == COMPRESSED and name == self.pictures and not self.lossy:
            self.lossy = "png" not in heard.message.format
        if name in self._flow:
            self._spread(self.line.take())

    def finish(self) -> None:
        """Take what the components still waited for."""
        self._spread(self.line.take())
        for comparison in self.comparisons.values():
            comparison.finish()

    def shortcomings(self) -> list[str]:
        """Return what could not be computed as it was, in words; call it last."""
        found = []
        if self._forgotten:
            names = ", ".join(self._forgotten)
            found.append(f"{len(self._forgotten)} recorded parameters that no longer exist: {names}")
        if self._without_parameters:
            names = ", ".join(self._without_parameters)
            found.append(f"no recorded parameters of {names}: today's defaults were taken")
        found += [f"{count} {reason}" for reason, count in self.line.shortcomings().items()]
        return [f"{self.namespace}: {line}" if self.namespace else line for line in found]

    def _spread(self, messages: Iterable[Made]) -> None:
        """Write, compare and judge recomputed messages."""
        for made in messages:
            comparison = self.comparisons.get(made.name)
            equal = comparison is not None and comparison.add_made(made)
            if self.bag is not None:
                self.bag.write(self._declared(made.name), made.data, made.log_time)
            if self.judge is not None:
                self.judge.take_made(made, equal)

    def _declared(self, name: str) -> str:
        """Return the full name of a topic of the new recording; its messages are of today's type."""
        full = _full(self.namespace, name)
        if name not in self._topics and self.bag is not None:
            topic = next(each for each in topics.TOPICS if each.name == name)
            old = self._log.topics.get(full)
            if old is None or schemas.definition(topic.type_name) != old.definition:
                self.bag.add_topic(full, topic.type_name, topic.quality)
                old = LoggedTopic(full, topic.type_name, schemas.definition(topic.type_name), 0)
            else:
                self.bag.copy_topic(old)
            self._topics[name] = old
        return full


def _run(log: Log, robots: Sequence[_Robot], bag: Bag | None, progress: Callable[[float], None] | None) -> Outcome:
    routes: dict[str, tuple[_Robot, str]] = {}
    for robot in robots:
        for name in robot.reads:
            routes[_full(robot.namespace, name)] = (robot, name)
        robot.bag = bag
    begin, end = log.span
    for number, record in enumerate(log.records(None if bag is not None else list(routes))):
        route = routes.get(record.topic.name)
        if route is not None:
            route[0].take(Heard(route[1], record, log))
        elif bag is not None:
            bag.copy(record)
        if progress is not None and number % PROGRESS == 0:
            progress((record.log_time - begin) * 1e-9)
    for robot in robots:
        robot.finish()
    return Outcome(
        {
            _full(robot.namespace, name): comparison.difference
            for robot in robots
            for name, comparison in robot.comparisons.items()
        },
        {robot.namespace: robot.judge.judgements() for robot in robots if robot.judge is not None},
        [line for robot in robots for line in robot.shortcomings()],
        begin < UNIX_TIME,
        any(robot.lossy for robot in robots),
        (end - begin) * 1e-9,
    )


def _robots(log: Log, components: Sequence[str], files: Sequence[Path], judge: bool, beside: bool) -> list[_Robot]:
    for component in components:
        if component not in COMPONENTS:
            raise unknown("component to recompute", component, COMPONENTS)
    if not components:
        raise BadInputError(f"Nothing to recompute is named; expected some of {', '.join(COMPONENTS)}.")
    suffix = f"/{topics.ODOMETRY.name}"
    spaces = [name[: -len(suffix)].lstrip("/") for name in log.topics if name.endswith(suffix)]
    missing: list[str] = []
    chosen = []
    for namespace in spaces or [""]:
        lacking = _lacking(log, namespace, components)
        if lacking:
            missing += lacking
        else:
            chosen.append(namespace)
    if not chosen:
        raise BadInputError(
            f"Recording {log.path} lacks {', '.join(dict.fromkeys(missing))}, which {', '.join(components)} need;"
            " recompute other components, or record all topics."
        )
    return [_Robot(log, space, components, parameters_of(log, space, files), judge, beside) for space in chosen]


def _lacking(log: Log, namespace: str, components: Sequence[str]) -> list[str]:
    """Return the topics that are missing or empty."""

    def has(name: str) -> bool:
        return _full(namespace, name) in log.topics and log.topics[_full(namespace, name)].messages > 0

    names = [_full(namespace, name) for component in components for name in NEEDED[component] if not has(name)]
    if "vision" in components and not (has(RAW) or has(COMPRESSED)):
        names.append(f"pictures on {_full(namespace, RAW)} or {_full(namespace, COMPRESSED)}")
    return names


def _pictures(log: Log, namespace: str) -> str:
    """Return the topic of the pictures: those that are not compressed if there are any."""
    raw = log.topics.get(_full(namespace, RAW))
    return RAW if raw is not None and raw.messages else COMPRESSED


def _parent(data: bytes) -> str:
    """Return the parent frame of the first transform of a serialized /tf message, "" without any."""
    if not any(data[4:FIRST]):
        return ""
    text = data[FIRST + 12 : after_header(data[FIRST - 4 :]) + FIRST - 4]
    return text.split(b"\0")[0].decode()


def _full(namespace: str, name: str) -> str:
    return f"/{namespace}/{name}" if namespace else f"/{name}"


def plain(outcome: Outcome) -> dict[str, Any]:
    """Return everything for JSON."""
    return {
        "lockstep": outcome.lockstep,
        "lossy_pictures": outcome.lossy,
        "seconds": outcome.seconds,
        "topics": {
            name: {
                "recorded": each.recorded,
                "recomputed": each.recomputed,
                "equal": each.equal,
                "unmatched": each.unmatched,
                "largest": dict(each.largest),
                "rms": {quantity: each.rms(quantity) for quantity in each.largest},
            }
            for name, each in outcome.differences.items()
        },
        "truth": {
            name: {"recorded": recorded.as_dict(), "recomputed": recomputed.as_dict()}
            for name, (recorded, recomputed) in outcome.judgements.items()
        },
        "shortcomings": list(outcome.shortcomings),
    }
