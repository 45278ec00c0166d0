"""What one robot said and saw in a recording, topic by topic, on one time axis.

The axis is that of the stamps [s]. Where stamps are times of a simulation, so is the axis; where they are dates, it
begins with the first. Messages that carry no stamp lie where the clock of the recording (`/clock`) puts them.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tulip_ros import topics
from tulip_ros.errors import BadInputError, unknown
from tulip_ros.log_file import Log, LoggedTopic, Record
from tulip_ros.timeline import Arrival, Timeline
from tulip_view.older_messages import installed, told

Array = NDArray[np.float64]
Advance = Callable[[int], None]
"""Is told how many messages were read since the last time."""

CLOCK = "/clock"
SHARED = (topics.REPORT.name,)
"""Of no robot: they stay outside all namespaces."""
STAMP = struct.Struct("<iI")
STAMP_AT = 4  # [B] behind the four bytes that tell the encoding
HEADERS = ("std_msgs/Header header", "builtin_interfaces/Time clock")
STEADY = tuple(  # topics whose stamps go forward by themselves
    topic.name
    for topic in (
        topics.JOINT_STATES,
        topics.MOTION_STATE,
        topics.WORLD_STATE,
        topics.GROUND_TRUTH,
        topics.FEATURES,
        topics.ODOMETRY,
    )
)
DATES = 10**15  # [ns] stamps beyond 12 days are dates
SAME = 10**9  # [ns] a recorder that hears stamps no later than this after they were the present has the same clock
STEP = 1000


@dataclass(frozen=True)
class Wanted:
    """How much of a topic is read.

    Attributes:
        decoded: Whether the messages themselves are wanted, and not only their times.
    """

    decoded: bool = True


ALL = Wanted()
TIMES = Wanted(decoded=False)


@dataclass
class Track:
    """Messages of one topic.

    Attributes:
        times: (n,) of the stamps, or of the arrivals where there are none [s].
        arrivals: (n,) when they came to the recorder, on the same axis [s].
        wall: (n,) when they came, by the recorder's own clock [s].
        messages: n of them; none if only times were wanted.
        logged: (n,) when they came, as the recording has it [ns].
    """

    times: Array
    arrivals: Array
    wall: Array
    messages: list[Any] = field(default_factory=list)
    logged: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.times)

    def gather(self, name: str) -> NDArray[Any]:
        """Return (n, ...) the values of one field."""
        return np.array([getattr(message, name) for message in self.messages])


@dataclass
class Recording:
    """What was read of one robot.

    Attributes:
        path: Of the recording.
        robot: Its namespace; "" for one that is alone.
        robots: Namespaces of all robots in the recording.
        tracks: By the topics' names within the namespace; only those that hold messages.
        origin: Stamp at which the axis begins [ns].
        runs: How often time began anew in it, plus one; the tracks hold the longest run alone.
        log_time_is_stamp: Whether the recorder's clock was that of the stamps, as in lockstep and on a robot.
        metadata: What the recorder noted.
        remarks: Topics that are not, or not wholly, what they should be, in sentences.
    """

    path: Path
    robot: str
    robots: tuple[str, ...]
    tracks: dict[str, Track]
    origin: int
    runs: int
    log_time_is_stamp: bool
    metadata: dict[str, dict[str, str]]
    remarks: list[str] = field(default_factory=list)

    def get(self, topic: topics.Topic) -> Track | None:
        """Return a topic's messages, or None where the recording has none."""
        return self.tracks.get(topic.name)

    @property
    def begin(self) -> float:
        """First time of all [s]."""
        return min((float(track.times[0]) for track in self._steady()), default=0.0)

    @property
    def end(self) -> float:
        """Last time of all [s]."""
        return max((float(track.times[-1]) for track in self._steady()), default=0.0)

    def _steady(self) -> list[Track]:
        found = [self.tracks[name] for name in STEADY if name in self.tracks]
        return found or list(self.tracks.values())


def robots_in(log: Log) -> tuple[str, ...]:
    """Return the namespaces of the robots that a recording holds, in the order of their messages' number; "" is one."""
    counts: dict[str, int] = {}
    for name, topic in log.topics.items():
        for known in STEADY:
            if name.endswith(f"/{known}") and topic.messages:
                namespace = name[: -len(known)].strip("/")
                counts[namespace] = counts.get(namespace, 0) + topic.messages
    return tuple(sorted(counts, key=lambda name: (-counts[name], name != "striker", name)))


def choose_robot(log: Log, wanted: str | None) -> str:
    """Return a robot's namespace.

    Args:
        log: The recording.
        wanted: As the user named it, or None for the first: the striker, where there is one.

    Raises:
        BadInputError: if there is no such robot, or none at all.
    """
    robots = robots_in(log)
    if not robots:
        raise BadInputError(
            f"Recording {log.path} holds no robot; expected at least one of the topics {', '.join(STEADY)}. "
            f"See what it holds: python3 scripts/log.py info {log.path}"
        )
    if wanted is None:
        return "striker" if "striker" in robots else robots[0]
    name = wanted.strip("/")
    if name not in robots:
        raise unknown("robot", name, (robot or "'' (the only one)" for robot in robots))
    return name


def read(log: Log, robot: str, wanted: Mapping[str, Wanted], advance: Advance = lambda number: None) -> Recording:
    """Read topics of one robot.

    Args:
        log: The recording.
        robot: Its namespace.
        wanted: How much, by the topics' names within the namespace.
        advance: For a progress bar; the total is `expected_messages`.

    Raises:
        BadInputError: if the recording is damaged, or a message does not fit its type.
    """
    names, remarks = full_names(log, robot, wanted)
    kinds = {topic.name: topic.message for topic in topics.TOPICS}
    lacking: dict[str, set[str]] = {name: set() for name in names.values()}
    runs: list[dict[str, list[tuple[int | None, int, Any]]]] = [{}]
    timeline = Timeline()
    stamped = {full: _begins_with_stamp(log.topics[full]) for full in names}
    for number, record in enumerate(log.records(list(names)), 1):
        if number % STEP == 0:
            advance(STEP)
        full, name = record.topic.name, names[record.topic.name]
        stamp = _stamp(record) if stamped[full] else None
        if stamp is not None and name in (*STEADY, CLOCK):
            arrival = timeline.see(name, stamp)
            if arrival is Arrival.OLD:
                continue
            if arrival is Arrival.ANEW:
                runs.append({})
        how = wanted.get(name, ALL)
        message = installed(log.decode(record), kinds[name], lacking[name]) if how.decoded else None
        runs[-1].setdefault(name, []).append((stamp, record.log_time, message))
    longest = max(runs, key=lambda run: sum(map(len, run.values())))
    remarks += [
        f"{name} was recorded with another definition of its type; told as 0 or empty: {told(fields)}."
        for name, fields in lacking.items()
        if fields
    ]
    return _assemble(log, robot, longest, len(runs), remarks)


def message_at(log: Log, recording: Recording, topic: topics.Topic, index: int) -> Any:
    """Return one message of a topic whose times alone were read.

    Raises:
        BadInputError: if the recording is damaged, or the message does not fit its type.
    """
    full = _full_name(topic.name, recording.robot)
    logged = int(recording.tracks[topic.name].logged[index])
    record = next(log.records([full], logged, logged + 1))
    return installed(log.decode(record), topic.message, set())


def expected_messages(log: Log, robot: str, wanted: Mapping[str, Wanted]) -> int:
    """Return how many messages `read` will look at."""
    return sum(log.topics[name].messages for name in full_names(log, robot, wanted)[0])


def full_names(log: Log, robot: str, wanted: Collection[str]) -> tuple[dict[str, str], list[str]]:
    """Return the names that the recording has of what is wanted, and the clock, by their full names; and remarks.

    Args:
        log: The recording.
        robot: Namespace of the robot.
        wanted: Names within the namespace.
    """
    names, remarks = {}, []
    types = {topic.name: topic.type_name for topic in topics.TOPICS}
    for name in (*wanted, CLOCK):
        full = _full_name(name, robot)
        if full not in log.topics:
            continue
        found = log.topics[full].type_name
        if found == types.get(name, found):
            names[full] = name
        else:
            remarks.append(f"{full} is {found}, where {types[name]} was expected; it was not read.")
    return names, remarks


def _full_name(name: str, robot: str) -> str:
    if name.startswith("/"):
        return name
    return f"/{robot}/{name}" if robot and name not in SHARED else f"/{name}"


def _begins_with_stamp(topic: LoggedTopic) -> bool:
    for line in topic.definition.splitlines():
        words = line.split("#")[0].split()
        if len(words) >= 2 and "=" not in line.split("#")[0]:
            return f"{words[0]} {words[1]}" in HEADERS
    return False


def _stamp(record: Record) -> int | None:
    """Return the stamp [ns] that stands first in a serialized message; None where there is none, or it is 0."""
    if len(record.data) < STAMP_AT + STAMP.size or record.data[1] & 1 == 0:
        return None
    seconds, nanoseconds = STAMP.unpack_from(record.data, STAMP_AT)
    return (seconds * 10**9 + nanoseconds) or None


def _assemble(
    log: Log, robot: str, run: dict[str, list[tuple[int | None, int, Any]]], runs: int, remarks: list[str]
) -> Recording:
    known = _clock(run)
    run.pop(CLOCK, None)
    stamps = [stamp for name in STEADY for stamp, _, _ in run.get(name, ()) if stamp is not None]
    first = min(stamps, default=log.span[0])
    origin = first if first > DATES else 0
    clock_logged = np.array([log_time - log.span[0] for log_time, _ in known], dtype=float) * 1e-9
    clock_stamps = np.array([stamp - origin for _, stamp in known], dtype=float) * 1e-9
    tracks = {}
    for name, entries in run.items():
        logged = np.array([log_time - log.span[0] for _, log_time, _ in entries], dtype=float) * 1e-9
        arrivals = np.interp(logged, clock_logged, clock_stamps) if known else logged
        own = [math.nan if stamp is None else (stamp - origin) / 1e9 for stamp, _, _ in entries]
        times = np.where(np.isnan(own), arrivals, own)
        # Latched messages may carry stamps of long ago.
        order = np.argsort(times, kind="stable")
        messages = [entries[index][2] for index in order if entries[index][2] is not None]
        stored = np.array([log_time for _, log_time, _ in entries], dtype=np.int64)[order]
        tracks[name] = Track(times[order], arrivals[order], logged[order], messages, stored)
    robots = robots_in(log)
    same = all(abs(log_time - stamp) < SAME for log_time, stamp in known)
    return Recording(log.path, robot, robots, tracks, origin, runs, same, log.metadata, remarks)


def _clock(run: dict[str, list[tuple[int | None, int, Any]]]) -> list[tuple[int, int]]:
    """Return log times and stamps that belong together [ns]: of the clock, or of what comes most often without one."""
    best: list[tuple[int, int]] = []
    for name in (CLOCK, *STEADY):
        pairs = [(log_time, stamp) for stamp, log_time, _ in run.get(name, ()) if stamp is not None]
        if name == CLOCK and pairs:
            return pairs
        best = max(best, pairs, key=len)
    return best
