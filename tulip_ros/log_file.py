"""A recording, read: what it holds, its messages in the order of time, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any

from mcap.records import Attachment, Schema
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import deserialize_message

from tulip_description.yaml_file import read_yaml
from tulip_ros import schemas
from tulip_ros.errors import BadInputError
from tulip_ros.log_chunks import messages_of
from tulip_ros.log_index import IndexedFile, damages_of

ENCODINGS = ("cdr",)
REPEATED = "repeated"
"""Note in a file that continues a recording: of which topics it begins with messages of the file before, and the
sequence numbers of the first and the last of them, as in "3 3"."""


@dataclass(frozen=True)
class LoggedTopic:
    """One topic of a recording.

    Attributes:
        name: Full name, as in /striker/odometry.
        type_name: As in nav_msgs/msg/Odometry.
        definition: Of the type and all types in it, in text (ros2msg).
        messages: How many there are.
        quality: Quality of service that its publishers offered, as rosbag2 notes it in YAML; "" where not noted.
    """

    name: str
    type_name: str
    definition: str
    messages: int
    quality: str = ""


@dataclass(frozen=True)
class Record:
    """One message as it was recorded.

    Attributes:
        topic: Of which topic.
        log_time: When it came in [ns since 1970; of simulated time in a lockstep recording].
        publish_time: When it was sent [ns], as log_time.
        sequence: Number of the message on its topic.
        data: Serialized (CDR).
    """

    topic: LoggedTopic
    log_time: int
    publish_time: int
    sequence: int
    data: bytes


class Log:
    """A recording that is open for reading.

    Example:
        >>> with Log(Path("recordings/trial")) as log:  # doctest: +SKIP
        ...     for record in log.records(["/world_state"]):
        ...         print(record.log_time, log.decode(record).robot_pose)
    """

    def __init__(self, path: Path) -> None:
        """Open a recording.

        Args:
            path: Its folder, or one MCAP file.

        Raises:
            DamagedLogError: if it has no index, because its recorder was killed, or is cut or damaged.
            BadInputError: if it is no recording, or cannot be read.
        """
        self.path = path
        self.files = files_of(path)
        self._decoders: dict[str, Any] = {}
        self._open = ExitStack()
        self._files: list[IndexedFile] = []
        try:
            for file in self.files:
                self._files.append(self._open.enter_context(IndexedFile(file)))
        except BaseException:
            self._open.close()
            raise

    def __enter__(self) -> Log:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close all files."""
        self.close()

    def close(self) -> None:
        """Close all files."""
        self._open.close()

    @cached_property
    def topics(self) -> dict[str, LoggedTopic]:
        """Topics by their names, in the order of these.

        Raises:
            DamagedLogError: if a definition is damaged.
        """
        counts: dict[str, int] = {}
        found: dict[str, Schema] = {}
        qualities: dict[str, str] = {}
        for file, repeated in zip(self._files, self._repeated, strict=True):
            summary, statistics = file.summary, file.summary.statistics
            for number, channel in summary.channels.items():
                if channel.message_encoding not in ENCODINGS or channel.schema_id not in summary.schemas:
                    continue  # not written by ROS 2: nothing that could be decoded
                found.setdefault(channel.topic, summary.schemas[channel.schema_id])
                qualities.setdefault(channel.topic, channel.metadata.get("offered_qos_profiles", ""))
                here = 0 if statistics is None else statistics.channel_message_counts.get(number, 0)
                first, last = repeated.get(channel.topic, (0, -1))
                counts[channel.topic] = counts.get(channel.topic, 0) + max(0, here - (last + 1 - first))
        with damages_of(self.path):
            return {
                name: LoggedTopic(name, found[name].name, found[name].data.decode(), counts[name], qualities[name])
                for name in sorted(found)
            }

    @cached_property
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last message [ns]; twice 0 without messages."""
        spans = [
            (statistics.message_start_time, statistics.message_end_time)
            for file in self._files
            if (statistics := file.summary.statistics) is not None and statistics.message_count
        ]
        return (min(first for first, _ in spans), max(last for _, last in spans)) if spans else (0, 0)

    @cached_property
    def metadata(self) -> dict[str, dict[str, str]]:
        """What the recorder noted, by the name of the note.

        Raises:
            DamagedLogError: if a note is damaged.
        """
        entries = [entry for file in self._files for entry in file.metadata()]
        return {entry.name: dict(entry.metadata) for entry in entries if entry.name != REPEATED}

    def attachments(self) -> Iterator[Attachment]:
        """Yield the files that the recorder put in; what a later file repeats comes once.

        Raises:
            DamagedLogError: if one is damaged.
        """
        seen: set[tuple[str, bytes]] = set()
        for file in self._files:
            for each in file.attachments():
                if (each.name, each.data) not in seen:
                    seen.add((each.name, each.data))
                    yield each

    def records(
        self, names: Collection[str] | None = None, start: int | None = None, end: int | None = None
    ) -> Iterator[Record]:
        """Yield messages in the order of their log times.

        Args:
            names: Of the topics wanted; None for all.
            start: First log time wanted [ns], or None.
            end: First log time not wanted any more [ns], or None.

        Raises:
            DamagedLogError: if the file turns out to be damaged on the way.
        """
        wanted = self.topics if names is None else {name: self.topics[name] for name in names if name in self.topics}
        for file, repeated in zip(self._files, self._repeated, strict=True):
            summary = file.summary
            channels = {key: wanted[each.topic] for key, each in summary.channels.items() if each.topic in wanted}
            with damages_of(file.path):
                for channel, sequence, log_time, published, data in messages_of(file, summary, channels, start, end):
                    topic = channels[channel]
                    if topic.name in repeated and sequence <= repeated[topic.name][1]:
                        continue  # the file before had it
                    yield Record(topic, log_time, published, sequence, data)

    def decode(self, record: Record) -> Any:
        """Return a message, by the definition that the recording itself holds.

        Where that is the installed one, it is an object of the installed class; otherwise one with the same attributes.

        Raises:
            BadInputError: if data and definition do not fit.
        """
        topic = record.topic
        try:
            if topic.type_name not in self._decoders:
                self._decoders[topic.type_name] = _decoder(topic)
            return self._decoders[topic.type_name](record.data)
        except Exception as error:  # a decoder meets damaged data in many ways
            raise BadInputError(
                f"Message {record.sequence} of topic {topic.name} in {self.path} is no {topic.type_name}: {error}"
            ) from error

    @cached_property
    def _repeated(self) -> list[dict[str, tuple[int, int]]]:
        """Numbers of the first and the last message that each file repeats from the one before, by topic."""
        found: list[dict[str, tuple[int, int]]] = []
        for file in self._files:
            with damages_of(file.path):
                notes = [each.metadata for each in file.metadata() if each.name == REPEATED and found]
                words = {topic: str(numbers).split() for note in notes for topic, numbers in note.items()}
                found.append({topic: (int(each[0]), int(each[-1])) for topic, each in words.items()})
        return found if len(found) > 1 else [{}]


def files_of(path: Path) -> list[Path]:
    """Return the MCAP files of a recording in the order of time.

    Args:
        path: Folder or file.

    Raises:
        BadInputError: if there is none.
    """
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise BadInputError(f"There is no recording {path}; expected a folder or an MCAP file.")
    held = {file.name: file for file in path.iterdir() if file.is_file()}  # no name leads out of the folder
    try:
        content = read_yaml(path / "metadata.yaml", ValueError)
        named = [str(name) for name in content["rosbag2_bagfile_information"]["relative_file_paths"]]
    except (ValueError, KeyError, TypeError):
        named = []
    found = [held[name] for name in dict.fromkeys(named) if name in held]
    found = found or sorted((file for file in held.values() if file.suffix == ".mcap"), key=_age_in_name)
    if not found:
        raise BadInputError(f"Folder {path} holds no recording; expected a file that ends in .mcap.")
    return found


def _age_in_name(path: Path) -> tuple[int, str]:
    """Return what sorts name_2.mcap before name_10.mcap."""
    return len(path.name), path.name


def _decoder(topic: LoggedTopic) -> Any:
    try:
        if schemas.definition(topic.type_name) == topic.definition:
            message_class = schemas.message_class(topic.type_name)
            return lambda data: deserialize_message(data, message_class)
    except LookupError:
        pass  # not installed here: the recording knows the type
    schema = Schema(id=1, name=topic.type_name, encoding="ros2msg", data=topic.definition.encode())
    return DecoderFactory().decoder_for("cdr", schema)
