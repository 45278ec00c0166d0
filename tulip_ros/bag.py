"""A recording: a folder with MCAP files and metadata.yaml, as ROS 2 writes them."""

from __future__ import annotations

import math
import shutil
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mcap.records import Attachment, Channel, Schema
from mcap.well_known import MessageEncoding, SchemaEncoding

from tulip_ros import bag_metadata, schemas
from tulip_ros.bag_metadata import FileEntry, TopicEntry
from tulip_ros.bag_writer import BagWriter
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import REPEATED, Log, LoggedTopic, Record
from tulip_ros.mcap_file import Chunk, McapFile
from tulip_ros.topics import Quality

CHUNK = 512 * 1024  # [B] compressed and written at one time
FLUSH = 0.5  # [s] after which a chunk is written however small it is: what a crash loses at most, beside its writing
FREE = 500 * 2**20  # [B] of disk space that a recording leaves free
DEFINE = 64  # chunks, half a minute at most, after which all types are told anew: a damaged part loses itself alone


@dataclass(frozen=True)
class Split:
    """When a recording goes on in a new file.

    Attributes:
        size: Once the file is so large [B]; 0 for never.
        seconds: Once so much time is in it [s]; 0 for never.
    """

    size: int = 0
    seconds: float = 0.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not usable.
        """
        for name, value in (("size", self.size), ("seconds", self.seconds)):
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f"{name} is {value}; expected a finite number >= 0")

    def __bool__(self) -> bool:
        """Return whether there can be more than one file."""
        return self.size > 0 or self.seconds > 0


@dataclass
class _Topic:
    number: int
    type_name: str
    definition: str
    quality: str
    kept: deque[tuple[int, int, bytes]] | None  # sequence, publish time, data of the last messages of a latched topic
    messages: int = 0


@dataclass
class _Part:
    """One file: what is in it so far."""

    file: McapFile
    first: int | None = None  # log time [ns]
    chunks: int = 0
    chunk: Chunk = field(default_factory=Chunk)


class Bag:
    """Writes a recording.

    Every file of it is complete in itself: it begins with all notes and attachments, and with the last messages of
    latched topics, which are marked so that `Log` reads them once.
    """

    def __init__(
        self,
        folder: Path,
        split: Split | None = None,
        free: int = FREE,
        compression: str = "zstd",
        sync: bool = True,
    ) -> None:
        """Begin a recording.

        Args:
            folder: Is made; it must not exist yet, or be empty. The files in it are named after it.
            split: When to go on in a new file; None for never.
            free: Disk space to leave free [B].
            compression: "zstd", or "none": three times as fast for raw pictures, and twice as large.
            sync: Have the disk keep what is written, so that a loss of power costs a second.

        Raises:
            BadInputError: if the folder holds something, cannot be written, or too little disk space is free.
        """
        self.folder = folder
        self._split = split or Split()
        self._free = free
        self._compression, self._sync = compression, sync
        self._parts: list[_Part] = []
        self._topics: dict[str, _Topic] = {}
        self._schemas: dict[tuple[str, str], Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._notes: dict[str, dict[str, str]] = {}
        self._attachments: dict[str, Attachment] = {}
        self._writer = BagWriter()
        self._flushed = time.monotonic()
        self._closed = False
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if any(folder.iterdir()):
                raise BadInputError(f"Recording folder {folder} is not empty; name another one, or remove it.")
            if not self.has_space():
                raise BadInputError(
                    f"Less than {free // 2**20} MiB are free at {folder}; make room or name another folder."
                )
            self._part = self._begin()
        except OSError as error:
            raise BadInputError(
                f"Recording folder {folder} cannot be written: {error.strerror}. Name another one."
            ) from error

    @property
    def path(self) -> Path:
        """The first file."""
        return self._parts[0].file.path

    @property
    def paths(self) -> list[Path]:
        """All files so far, in the order of time."""
        return [part.file.path for part in self._parts]

    @property
    def messages(self) -> int:
        """How many messages were written, not counting those that are repeated in a new file."""
        return sum(topic.messages for topic in self._topics.values())

    def size(self) -> int:
        """Return the size of what is written [B]."""
        return sum(part.file.size for part in self._parts)

    def has_space(self) -> bool:
        """Return whether enough disk space is free to go on."""
        return shutil.disk_usage(self.folder).free > self._free

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Write names and values that explain the recording; the same name again replaces them.

        Raises:
            OSError: if the file cannot be written.
        """
        self._notes[name] = dict(values)
        self._writer.do(self._part.file, lambda file: file.add_metadata(name, values))

    def attach(self, name: str, media_type: str, data: bytes, moment: int = 0) -> None:
        """Write a file that explains the recording; the same name again replaces it.

        Args:
            name: As in "robot.yaml".
            media_type: As in "text/yaml".
            data: What it holds.
            moment: When that was found [ns], or 0.

        Raises:
            OSError: if the file cannot be written.
        """
        attachment = Attachment(create_time=moment, log_time=moment, name=name, media_type=media_type, data=data)
        self._attachments[name] = attachment
        self._writer.do(self._part.file, lambda file: file.add_attachment(attachment))

    def copy_notes(self, log: Log, label: str = "") -> None:
        """Take over what the recorder of another recording noted and attached.

        Args:
            log: The other one.
            label: Put before each name, so that notes of several recordings do not mix.
        """
        for name, values in log.metadata.items():
            if name != REPEATED:
                self.note(f"{label}{name}", values)
        for each in log.attachments():
            self.attach(f"{label}{each.name}", each.media_type, each.data, each.log_time)

    def add_topic(self, name: str, type_name: str, quality: Quality) -> None:
        """Declare a topic before its first message; the same again changes nothing.

        Args:
            name: Full name, as in /striker/odometry.
            type_name: As in nav_msgs/msg/Odometry.
            quality: That its publishers offer.

        Raises:
            LookupError: if the type's definition is not installed.
        """
        if name not in self._topics:
            profiles, depth = bag_metadata.quality_profiles(quality), quality.depth if quality.latched else 0
            self._add_topic(name, type_name, schemas.definition(type_name), profiles, depth)

    def copy_topic(self, topic: LoggedTopic) -> None:
        """Declare a topic as another recording holds it; the same again changes nothing.

        Raises:
            ValueError: if it was declared with another type or definition.
        """
        known = self._topics.get(topic.name)
        if known is None:
            self._add_topic(topic.name, topic.type_name, topic.definition, topic.quality, 0)
        elif (known.type_name, known.definition) != (topic.type_name, topic.definition):
            raise ValueError(f"topic {topic.name} has different types; expected one")

    def copy(self, record: Record) -> None:
        """Write a message as another recording holds it.

        Raises:
            ValueError: if its topic was declared with another type or definition.
            OSError: if the file cannot be written.
        """
        self.copy_topic(record.topic)
        self.write(record.topic.name, record.data, record.log_time, record.publish_time)

    def write(self, name: str, data: bytes, stamp: int, published: int | None = None) -> None:
        """Write one message.

        Args:
            name: A topic that was added.
            data: The serialized message.
            stamp: When it came in [ns since 1970].
            published: When it was sent [ns since 1970]; None for the same time.

        Raises:
            OSError: if the file cannot be written.
        """
        topic, part = self._topics[name], self._part
        if part.first is None:
            part.first = stamp
        elif self._split and self._is_full(part, stamp - part.first):
            part = self._next(stamp)
        sent = stamp if published is None else published
        part.chunk.add(topic.number, topic.messages, stamp, sent, data)
        if topic.kept is not None:
            topic.kept.append((topic.messages, sent, data))
        topic.messages += 1
        if part.chunk.size > CHUNK:
            self._push()

    def flush(self) -> None:
        """Bring what was written to disk when the last time is FLUSH ago; call it often.

        Raises:
            OSError: if the file cannot be written.
        """
        now = time.monotonic()
        if now - self._flushed >= FLUSH:
            self._flushed = now
            self._push()
            self._writer.check()

    def close(self) -> None:
        """End the recording: index and metadata.

        Raises:
            OSError: if the file cannot be written; what is on the disk can be recovered.
        """
        if self._closed:
            return
        self._closed = True
        error: OSError | None = None
        try:
            self._push()
            self._writer.do(self._part.file, McapFile.finish)
        except OSError as problem:
            error = problem
        try:
            self._writer.close()
        except OSError as problem:
            error = problem
        try:
            if not self._part.file.closed:  # what was written until the error can have an index if there is room for it
                self._part.file.finish()
            self._write_metadata()
        except OSError as problem:
            error = error or problem
        finally:
            self._part.file.abandon()
        if error is not None:
            raise error

    @property
    def ended(self) -> bool:
        """Whether all files have their index, so that nothing must be recovered."""
        return self._closed and all(part.file.finished for part in self._parts)

    def _write_metadata(self) -> None:
        files = [part.file for part in self._parts]
        entries = [FileEntry(each.path.name, each.first, each.last, each.messages) for each in files]
        topics = [
            TopicEntry(name, it.type_name, it.quality, sum(each.counts.get(it.number, 0) for each in files))
            for name, it in self._topics.items()
        ]
        bag_metadata.write(self.folder, entries, topics)

    def _add_topic(self, name: str, type_name: str, definition: str, quality: str, kept: int) -> None:
        schema = self._schemas.get((type_name, definition))
        if schema is None:
            number = len(self._schemas) + 1
            schema = Schema(id=number, data=definition.encode(), encoding=SchemaEncoding.ROS2, name=type_name)
            self._schemas[type_name, definition] = schema
            self._define(schema)
        number = len(self._channels) + 1
        channel = Channel(
            id=number,
            topic=name,
            message_encoding=MessageEncoding.CDR,
            metadata={"offered_qos_profiles": quality} if quality else {},
            schema_id=schema.id,
        )
        self._channels[number] = channel
        self._define(channel)
        self._topics[name] = _Topic(number, type_name, definition, quality, deque(maxlen=kept) if kept else None)

    def _define(self, record: Schema | Channel) -> None:
        """Write a schema or a channel into the chunk, and have the index list it."""
        known = self._part.file.schemas if isinstance(record, Schema) else self._part.file.channels
        known[record.id] = record
        self._part.chunk.add_definition(record)

    def _define_all(self) -> None:
        for record in (*self._schemas.values(), *self._channels.values()):
            self._define(record)

    def _push(self) -> None:
        """Hand the chunk over to be written, and begin another one."""
        part = self._part
        if not part.chunk.messages:
            return
        self._writer.chunk(part.file, part.chunk)
        self._flushed = time.monotonic()
        part.chunk, part.chunks = Chunk(), part.chunks + 1
        if part.chunks % DEFINE == 0:
            self._define_all()

    def _begin(self) -> _Part:
        number = f"_{len(self._parts)}" if self._split else ""
        path = self.folder / f"{self.folder.name}{number}.mcap"
        part = _Part(McapFile(path, compression=self._compression, sync=self._sync))
        self._parts.append(part)
        return part

    def _is_full(self, part: _Part, length: int) -> bool:
        too_long = 0 < self._split.seconds * 1e9 <= length
        return too_long or 0 < self._split.size <= part.file.size

    def _next(self, stamp: int) -> _Part:
        """End the file and begin the next one, which explains itself."""
        self._push()
        self._writer.do(self._part.file, McapFile.finish)
        part = self._part = self._begin()
        for name, values in self._notes.items():
            self.note(name, values)
        for each in self._attachments.values():
            self.attach(each.name, each.media_type, each.data, each.log_time)
        kept = {name: topic.kept for name, topic in self._topics.items() if topic.kept}
        repeated = {name: f"{entries[0][0]} {entries[-1][0]}" for name, entries in kept.items()}
        self._writer.do(part.file, lambda file: file.add_metadata(REPEATED, repeated))
        self._define_all()
        part.first = stamp
        for name, entries in kept.items():
            number = self._topics[name].number
            for sequence, published, data in entries:
                part.chunk.add(number, sequence, stamp, published, data)
        return part
