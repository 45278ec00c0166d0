"""Plays a recording: what comes when, by a steady clock, with pauses and steps. Without ROS."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from tulip_ros import schemas, topics
from tulip_ros.errors import BadInputError
from tulip_ros.latched import latched_before
from tulip_ros.log_file import Log, Record

CLOCK_PERIOD = 20_000_000  # [ns] of recorded time between two messages on /clock: 50 Hz, as simulators have it


@dataclass(frozen=True)
class ReplayParameters:
    """What is played, and how.

    Attributes:
        file: The recording: its folder, or an MCAP file.
        rate: Times the speed at which it was recorded.
        loop: Begin again at the end.
        start: From the beginning of the recording [s].
        duration: Of what is played [s]; 0 for the rest.
        include: Regular expressions; a topic must match one of them (whole name). None: every topic.
        exclude: Regular expressions; a topic must match none of them.
        paused: Wait for a step or for being resumed.
        step: Recorded time of one step [s].
        delay: Before the first message, so that listeners find the topics [s].
    """

    file: str = ""
    rate: float = 1.0
    loop: bool = False
    start: float = 0.0
    duration: float = 0.0
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    paused: bool = False
    step: float = 0.02
    delay: float = 1.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not usable.
        """
        for name in ("rate", "step"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; expected a finite number > 0")
        for name in ("start", "duration", "delay"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} is {getattr(self, name)} s; expected a finite number >= 0")
        for expression in (*self.include, *self.exclude):
            try:
                re.compile(expression)
            except re.error as error:
                raise ValueError(f"{expression!r} is no regular expression: {error}") from error

    def wants(self, name: str) -> bool:
        """Return whether a topic, by its full name, is to be played."""
        included = not self.include or any(re.fullmatch(each, name) for each in self.include)
        return included and not any(re.fullmatch(each, name) for each in self.exclude)


class Schedule:
    """When recorded messages are due, by a steady clock.

    Due times follow from the first one alone, so lateness does not add up. While paused, the recorded time stands still
    but for steps.

    Example:
        >>> schedule = Schedule(first=0, rate=2.0, now=1_000)
        >>> schedule.due(100)
        1050
        >>> schedule.pause(1_040)
        >>> schedule.position(9_999), schedule.due(100)
        (80, None)
        >>> schedule.step(20)
        >>> schedule.due(100)
        1040
    """

    def __init__(self, first: int, rate: float, now: int) -> None:
        """Begin now.

        Args:
            first: Log time that is due now [ns].
            rate: Times the recorded speed.
            now: Of the steady clock [ns].
        """
        self._anchor, self._at = first, now
        self.rate = rate
        self.paused = False

    def due(self, log_time: int) -> int | None:
        """Return when a log time [ns] is due by the steady clock [ns]; None while a pause holds it back."""
        if self.paused:
            return self._at if log_time <= self._anchor else None
        return self._at + round((log_time - self._anchor) / self.rate)

    def position(self, now: int) -> int:
        """Return the log time [ns] that is reached now."""
        return self._anchor if self.paused else self._anchor + round((now - self._at) * self.rate)

    def pause(self, now: int) -> None:
        """Stand still."""
        self._anchor, self._at, self.paused = self.position(now), now, True

    def resume(self, now: int) -> None:
        """Go on."""
        self._anchor, self._at, self.paused = self.position(now), now, False

    def step(self, duration: int) -> None:
        """Let some recorded time [ns] pass at once, in a pause."""
        self._anchor += duration

    def change_rate(self, rate: float, now: int) -> None:
        """Go on at another speed."""
        self._anchor, self._at = self.position(now), now
        self.rate = rate


class Passage:
    """The part of a recording that is played: its messages, and the time of /clock between them."""

    def __init__(self, log: Log, names: Collection[str], start: float, duration: float) -> None:
        """Choose it.

        Args:
            log: The recording.
            names: Topics to be played.
            start: From the recording's beginning [s].
            duration: [s]; 0 for the rest.

        Raises:
            BadInputError: if no message would be played.
        """
        first, last = log.span
        if not any(log.topics[name].messages for name in names):
            raise BadInputError(
                f"Nothing of {log.path} would be played; its topics are {', '.join(log.topics) or 'none'}."
            )
        if start * 1e9 > last - first:
            raise BadInputError(
                f"Start is {start} s; recording {log.path} is {(last - first) * 1e-9:.1f} s long. Expected less."
            )
        self._log, self.names = log, tuple(names)
        self.first = first + round(start * 1e9)
        self.end = last + 1 if duration == 0.0 else min(last + 1, self.first + round(duration * 1e9))
        self._with_clock = topics.CLOCK.name not in log.topics

    def __iter__(self) -> Iterator[tuple[int, Record | None]]:
        """Yield log times [ns] with messages, or with None for the time itself."""
        tick = self.first
        for record in self._log.records(self.names, self.first, self.end):
            while self._with_clock and tick <= record.log_time:
                yield tick, None
                tick += CLOCK_PERIOD
            yield record.log_time, record

    def before(self) -> list[Record]:
        """Return the last message before the beginning of each topic that keeps its last one for late listeners."""
        return latched_before(self._log, self.names, self.first)


def playable(log: Log) -> tuple[list[str], dict[str, str]]:
    """Return the topics that can be published here, and of the others why not."""
    names, refused = [], {}
    for name, topic in log.topics.items():
        try:
            installed = schemas.definition(topic.type_name)
            schemas.message_class(topic.type_name)
        except LookupError:
            refused[name] = f"type {topic.type_name} is not installed"
            continue
        if installed.split() != topic.definition.split():
            refused[name] = f"type {topic.type_name} was another one when this was recorded"
        else:
            names.append(name)
    return names, refused
