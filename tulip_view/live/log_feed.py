"""Feeds a scene from a recording: at any instant, or running at any speed."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log, Record
from tulip_view.live.inputs import INPUTS, WINDOW, not_shown
from tulip_view.live.intake import Intake
from tulip_view.live.scene import Scene
from tulip_view.older_messages import installed, told
from tulip_view.recording import choose_robot, full_names, robots_in

SECOND = 1_000_000_000  # [ns]
RARE = 2000
"""Messages of latched topics, up to so many of each, are kept in memory: the newest may lie long before an instant."""


class LogFeed:
    """A recording with a position in it.

    Attributes:
        duration: Of the recording [s].
        position: Where it is [s from its beginning].
        robots: Namespaces of the robots in it.
        robot: The one that is shown.
    """

    def __init__(self, log: Log, scene: Scene, robot: str | None = None) -> None:
        """Begin at the beginning.

        Args:
            log: The recording.
            scene: Is fed.
            robot: Namespace of the robot; None for the striker or the only one.

        Raises:
            BadInputError: if there is no such robot.
        """
        self._log = log
        self._intake = Intake(scene)
        self._first = log.span[0]
        self.duration = (log.span[1] - log.span[0]) / SECOND
        self.robots = robots_in(log)
        self._lacking: dict[str, set[str]] = {}
        self.position = 0.0
        self.choose(choose_robot(log, robot))

    def choose(self, robot: str) -> None:
        """Show another robot, at the same instant."""
        self.robot = robot
        self._names, self._remarks = full_names(self._log, robot, INPUTS)
        self._names = {full: name for full, name in self._names.items() if name in INPUTS}
        shared = f"/{topics.DIAGNOSTICS.name}"  # of nodes that are of no robot, as the simulator of a match
        if shared in self._log.topics:
            self._names.setdefault(shared, topics.DIAGNOSTICS.name)
        latched = [
            full
            for full, name in self._names.items()
            if INPUTS[name].topic.quality.latched and self._log.topics[full].messages <= RARE
        ]
        self._latched: dict[str, list[Record]] = {full: [] for full in latched}
        try:
            for record in self._log.records(latched):
                self._latched[record.topic.name].append(record)
        except BadInputError as error:  # the parts that are whole can be looked at all the same
            self._remarks.append(str(error))
        self.seek(self.position)

    def remarks(self) -> list[str]:
        """Return what the recording lacks, and what in it is not, or not wholly, what it should be, in sentences."""
        older = [
            f"{name} was recorded with another definition of its type; told as 0 or empty: {told(fields)}."
            for name, fields in self._lacking.items()
            if fields
        ]
        return [*not_shown(self._names.values()), *self._remarks, *older]

    def seek(self, position: float) -> None:
        """Go to an instant.

        Args:
            position: From the beginning of the recording [s]; brought into it.
        """
        self.position = min(max(position, 0.0), self.duration)
        now = self._log_time()
        self._intake.begin_anew()
        for records in self._latched.values():
            before = bisect_right(records, now, key=lambda record: record.log_time)
            if before:
                self._take(records[before - 1])
        self._records = self._log.records(list(self._names), now - round(WINDOW * SECOND))
        self._ahead: Record | None = next(self._records, None)
        self._run()

    def advance(self, seconds: float) -> None:
        """Go on by so much recorded time; up to the end.

        Args:
            seconds: [s] >= 0.
        """
        self.position = min(self.position + seconds, self.duration)
        self._run()

    @property
    def ended(self) -> bool:
        """Whether it is at its end."""
        return self.position >= self.duration

    def _log_time(self) -> int:
        return self._first + round(self.position * SECOND)

    def _run(self) -> None:
        """Take all that was recorded up to the position."""
        now = self._log_time()
        while self._ahead is not None and self._ahead.log_time <= now:
            self._take(self._ahead)
            self._ahead = next(self._records, None)

    def _take(self, record: Record) -> None:
        name = self._names[record.topic.name]

        def decode() -> Any:
            lacking = self._lacking.setdefault(record.topic.name, set())
            return installed(self._log.decode(record), INPUTS[name].topic.message, lacking)

        try:
            self._intake.take(name, record.data, (record.log_time - self._first) / SECOND, decode)
        except ValueError as error:  # it is too short for its stamp, or says what cannot be
            raise BadInputError(
                f"Message {record.sequence} of topic {record.topic.name} cannot be shown: {error}"
            ) from error
