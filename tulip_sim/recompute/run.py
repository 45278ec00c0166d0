"""Recomputes a recording: inputs through today's cores, in the order of the run, as fast as they go."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.serialization import serialize_message

from tulip_description.frames import MAP
from tulip_ros import schemas, topics
from tulip_ros.bag import Bag
from tulip_ros.errors import BadInputError, unknown
from tulip_ros.log_edit import writing
from tulip_ros.log_file import Log, LoggedTopic, Record
from tulip_ros.serialized import after_header, time_at
from tulip_sim.recompute.decisions import HeadStage, StrategyStage
from tulip_sim.recompute.decoding import COMPRESSED, RAW, decoding_ahead
from tulip_sim.recompute.differences import Comparison, Difference
from tulip_sim.recompute.heard import UNIX_TIME, Heard, Made, Stage
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

    Raises:
        BadInputError: if a component is not known or its inputs are not recorded, if parameters cannot be used, or if
            the new recording cannot be written.
    """
    robots = _robots(log, components, parameter_files, judge)
    if folder is None:
        return _run(log, robots, None, progress)
    with writing(folder) as bag:
        bag.copy_notes(log)
        return _run(log, robots, bag, progress)


class _Robot:
    """The stages of one robot, and the comparison of what they say."""

    def __init__(self, log: Log, namespace: str, components: Sequence[str], p: RobotParameters, judge: bool) -> None:
        self.namespace, self._log = namespace, log
        self.stages: list[Stage] = []
        self.pictures = ""
        if "vision" in components:
            self.pictures = _pictures(log, namespace)
            self.stages.append(VisionStage(p.vision, self.pictures))
        if "worldmodel" in components:
            self.stages.append(WorldModelStage(p.worldmodel, p.field, p.start))
        if "strategy" in components:
            self.stages.append(StrategyStage(p.strategy, p.field, p.game_input.stale_after))
        if "head" in components:
            self.stages.append(HeadStage(p.head))
        self.writes = frozenset().union(*(stage.writes for stage in self.stages))
        self.reads = frozenset().union(*(stage.reads for stage in self.stages)) | self.writes
        # What was not recorded has nothing to be compared with; the new recording holds it all the same.
        self.comparisons = {
            name: Comparison(name) for name in sorted(self.writes) if _full(namespace, name) in log.topics
        }
        self.lossy = False
        self.forgotten = p.forgotten
        self.without_parameters = [name for name in components if name not in p.noted]
        has_truth = judge and _full(namespace, topics.GROUND_TRUTH.name) in log.topics
        self.judge = Judge(p.field, self.writes) if has_truth else None
        self.bag: Bag | None = None
        self._topics: dict[str, LoggedTopic] = {}

    def replaces(self, heard: Heard) -> bool:
        """Return whether a recorded message is replaced by a recomputed one."""
        if heard.name not in self.writes:
            return False
        # Motion control says on the same topic where the body lies in odom.
        return heard.name != topics.TF.name or _parent(heard.record.data) == MAP

    def take(self, heard: Heard) -> None:
        """Take a recorded message of one of the robot's topics."""
        name = heard.name
        if self.replaces(heard):
            stamp = time_at(heard.record.data, FIRST) if name == topics.TF.name else heard.stamp
            self.comparisons[name].add_recorded(stamp, heard.log_time, heard.record.data, lambda: heard.message)
        elif self.bag is not None:
            record = heard.record
            self.bag.write(record.topic.name, record.data, record.log_time, record.publish_time)
        if self.judge is not None:
            self.judge.take_recorded(heard)
        if name == COMPRESSED and name == self.pictures and not self.lossy:
            self.lossy = "png" not in heard.message.format
        for index, stage in enumerate(self.stages):
            if name in stage.told_by:
                self._spread(stage.answer(heard), index + 1)
            elif name in stage.reads and name not in self.writes:
                self._spread(stage.hear(heard), index + 1)

    def finish(self) -> None:
        """Take what stages still waited for."""
        for index, stage in enumerate(self.stages):
            self._spread(stage.finish(), index + 1)
        for comparison in self.comparisons.values():
            comparison.finish()

    def _spread(self, messages: Iterable[Made], first: int) -> None:
        """Write and compare recomputed messages, and let the later stages hear them."""
        for made in messages:
            data = serialize_message(made.message)
            comparison = self.comparisons.get(made.name)
            equal = comparison is not None and comparison.add_made(made.stamp, data, made.message)
            if self.bag is not None:
                self.bag.write(self._declared(made.name), data, made.log_time)
            if self.judge is not None:
                self.judge.take_made(made, equal)
            for index in range(first, len(self.stages)):
                if made.name in self.stages[index].reads:
                    self._spread(self.stages[index].hear(made), index + 1)

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
        judged = robot.judge.reads if robot.judge else frozenset()
        for name in robot.reads | judged:
            routes[_full(robot.namespace, name)] = (robot, name)
        robot.bag = bag
    begin, end = log.span
    lockstep = begin < UNIX_TIME
    copied: set[str] = set()
    records = log.records(None if bag is not None else list(routes))
    messages: Iterable[Heard] = (
        Heard(routes[name][1] if (name := each.topic.name) in routes else name, each, log) for each in records
    )
    if any(robot.pictures == COMPRESSED for robot in robots):
        messages = decoding_ahead(messages)
    for number, heard in enumerate(messages):
        record = heard.record
        _declare(bag, copied, record, routes)
        route = routes.get(record.topic.name)
        if route is not None:
            route[0].take(heard)
        elif bag is not None:
            bag.write(record.topic.name, record.data, record.log_time, record.publish_time)
        if progress is not None and number % PROGRESS == 0:
            progress((record.log_time - begin) * 1e-9)
    shortcomings = []
    for robot in robots:
        robot.finish()
        where = f"{robot.namespace}: " if robot.namespace else ""
        if robot.forgotten:
            names = ", ".join(robot.forgotten)
            shortcomings.append(f"{where}{len(robot.forgotten)} recorded parameters that no longer exist: {names}")
        if robot.without_parameters:
            names = ", ".join(robot.without_parameters)
            shortcomings.append(f"{where}no recorded parameters of {names}: today's defaults were taken")
        for stage in robot.stages:
            shortcomings += [f"{where}{count} {reason}" for reason, count in stage.shortcomings().items()]
    return Outcome(
        {
            _full(robot.namespace, name): comparison.difference
            for robot in robots
            for name, comparison in robot.comparisons.items()
        },
        {robot.namespace: robot.judge.judgements() for robot in robots if robot.judge is not None},
        shortcomings,
        lockstep,
        any(robot.lossy for robot in robots),
        (end - begin) * 1e-9,
    )


def _declare(bag: Bag | None, copied: set[str], record: Record, routes: Mapping[str, tuple[_Robot, str]]) -> None:
    """Declare a topic that is copied, before its first message."""
    name = record.topic.name
    if bag is None or name in copied:
        return
    copied.add(name)
    route = routes.get(name)
    if route is None or route[1] not in route[0].writes or route[1] == topics.TF.name:
        bag.copy_topic(record.topic)


def _robots(log: Log, components: Sequence[str], files: Sequence[Path], judge: bool) -> list[_Robot]:
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
    return [_Robot(log, space, components, parameters_of(log, space, files), judge) for space in chosen]


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
