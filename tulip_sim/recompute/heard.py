"""What passes between a recording, the stages that recompute, and who compares."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message, serialize_message

from tulip_ros import schemas, topics
from tulip_ros.log_file import Log, Record
from tulip_ros.serialized import time_at

UNIX_TIME = 10**17
"""[ns] Log times below are simulated: a lockstep's. Those of a graph count from 1970."""
OVERDUE = 1_000_000_000
"""[ns] of log time after which an input that a recorded output names is taken for lost."""


@dataclass
class Heard:
    """A message as a recording holds it.

    Attributes:
        name: Of its topic, without the robot's namespace.
        record: As recorded.
        log: The recording, which decodes it.
        picture: The picture that it holds, while that is decoded beside (decoding.py).
    """

    name: str
    record: Record
    log: Log
    picture: Future[NDArray[np.uint8]] | None = None

    @property
    def log_time(self) -> int:
        """When it was recorded [ns]."""
        return self.record.log_time

    @cached_property
    def message(self) -> Any:
        """The message."""
        return self.log.decode(self.record)

    @property
    def stamp(self) -> int:
        """Stamp [ns] of a message that begins with a header."""
        return time_at(self.record.data)


class Made:
    """A message that was computed anew, as an object or as its bytes, each made of the other when it is asked for.

    Attributes:
        name: Of its topic, without the robot's namespace.
        log_time: Of the recorded message in whose place it stands [ns].
        stamp: Of its header [ns].
    """

    def __init__(self, name: str, log_time: int, stamp: int, message: Any = None, data: bytes = b"") -> None:
        self.name, self.log_time, self.stamp = name, log_time, stamp
        self._message, self._data = message, data

    @property
    def message(self) -> Any:
        """The message."""
        if self._message is None:
            self._message = deserialize_message(self._data, schemas.message_class(_type_name(self.name)))
        return self._message

    @property
    def data(self) -> bytes:
        """The serialized message."""
        if not self._data:
            self._data = serialize_message(self._message)
        return self._data

    def __reduce__(self) -> tuple[type[Made], tuple[str, int, int, None, bytes]]:
        """Go to another process as bytes."""
        return Made, (self.name, self.log_time, self.stamp, None, self.data)


@cache
def _type_name(name: str) -> str:
    return next(topic.type_name for topic in topics.TOPICS if topic.name == name)


class Stage(Protocol):
    """One component, computed anew."""

    reads: frozenset[str]
    """Names of the topics that it hears."""
    writes: frozenset[str]
    """Names of the topics that it says."""
    told_by: frozenset[str]
    """Those of `writes` whose recorded messages tell when to compute."""

    def hear(self, heard: Heard | Made) -> Iterable[Made]:
        """Take an input, as recorded or as an earlier stage made it."""

    def answer(self, recorded: Heard) -> Iterable[Made]:
        """Take a recorded output, which tells when the component spoke and on which inputs."""

    def finish(self) -> Iterable[Made]:
        """Yield what was still waited for when the recording ended."""

    def shortcomings(self) -> dict[str, int]:
        """Return what could not be computed, by reason."""
