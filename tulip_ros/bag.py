"""A recording: a folder with one MCAP file and metadata.yaml, as ROS 2 writes them."""

from __future__ import annotations

import os
import shutil
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding
from mcap.writer import CompressionType, Writer

from tulip_ros import schemas
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log, LoggedTopic
from tulip_ros.topics import Quality

CHUNK = 512 * 1024  # [B] compressed and written at one time; what a crash loses at most
FLUSH = 0.5  # [s] after which a chunk is written; looked at every 0.5 s, so a message waits 1 s at most
FREE = 500 * 2**20  # [B] of disk space that a recording leaves free
FOREVER = {"sec": 9223372036, "nsec": 854775807}


@dataclass
class _Channel:
    number: int
    type_name: str
    quality: str
    messages: int = 0


@dataclass
class _Span:
    first: int = 0
    last: int = 0
    messages: int = 0
    channels: dict[str, _Channel] = field(default_factory=dict)


class Bag:
    """Writes a recording."""

    def __init__(self, folder: Path) -> None:
        """Begin a recording.

        Args:
            folder: Is made; it must not exist yet, or be empty. The file in it is named after it.

        Raises:
            BadInputError: if the folder holds something, cannot be written, or too little disk space is free.
        """
        self.folder = folder
        self.path = folder / f"{folder.name}.mcap"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if any(folder.iterdir()):
                raise BadInputError(f"Recording folder {folder} is not empty; name another one, or remove it.")
            self._stream = open(self.path, "wb")
        except OSError as error:
            raise BadInputError(
                f"Recording folder {folder} cannot be written: {error.strerror}. Name another one."
            ) from error
        if not self.has_space():
            self._stream.close()
            self.path.unlink()
            raise BadInputError(
                f"Less than {FREE // 2**20} MiB are free at {folder}; make room or name another folder."
            )
        self._writer = Writer(self._stream, chunk_size=CHUNK, compression=CompressionType.ZSTD)
        self._writer.start(profile=Profile.ROS2, library="tulip_ros")
        self._schemas: dict[str, int] = {}
        self._copied: dict[str, tuple[str, str]] = {}
        self._span = _Span()
        self._flushed = time.monotonic()

    @property
    def messages(self) -> int:
        """How many messages were written."""
        return self._span.messages

    def size(self) -> int:
        """Return the file's size [B]."""
        return self.path.stat().st_size

    def has_space(self) -> bool:
        """Return whether enough disk space is free to go on."""
        return shutil.disk_usage(self.folder).free > FREE

    def add_topic(self, name: str, type_name: str, quality: Quality) -> None:
        """Declare a topic before its first message; the same again changes nothing.

        Args:
            name: Full name, as in /striker/odometry.
            type_name: As in nav_msgs/msg/Odometry.
            quality: That its publishers offer.

        Raises:
            LookupError: if the type's definition is not installed.
        """
        if name in self._span.channels:
            return
        if type_name not in self._schemas:
            text = schemas.definition(type_name).encode()
            self._schemas[type_name] = self._writer.register_schema(type_name, SchemaEncoding.ROS2, text)
        profiles = yaml.safe_dump([_profile(quality)], sort_keys=False)
        number = self._writer.register_channel(
            name, MessageEncoding.CDR, self._schemas[type_name], {"offered_qos_profiles": profiles}
        )
        self._span.channels[name] = _Channel(number, type_name, profiles)

    def copy_topic(self, topic: LoggedTopic) -> None:
        """Declare a topic as another recording holds it; the same again changes nothing.

        Raises:
            ValueError: if it was declared with another type or definition.
        """
        known = self._span.channels.get(topic.name)
        if known is not None:
            if self._copied.get(topic.name) != (topic.type_name, topic.definition):
                raise ValueError(f"topic {topic.name} has different types; expected one")
            return
        key = f"{topic.type_name}\n{topic.definition}"
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(
                topic.type_name, SchemaEncoding.ROS2, topic.definition.encode()
            )
        notes = {"offered_qos_profiles": topic.quality} if topic.quality else {}
        number = self._writer.register_channel(topic.name, MessageEncoding.CDR, self._schemas[key], notes)
        self._span.channels[topic.name] = _Channel(number, topic.type_name, topic.quality)
        self._copied[topic.name] = (topic.type_name, topic.definition)

    def copy_notes(self, log: Log, label: str = "") -> None:
        """Take over what the recorder of another recording noted and attached.

        Args:
            log: The other one.
            label: Put before each name, so that notes of several recordings do not mix.
        """
        for name, values in log.metadata.items():
            self._writer.add_metadata(f"{label}{name}", values)
        for each in log.attachments():
            self._writer.add_attachment(
                each.create_time, each.log_time, f"{label}{each.name}", each.media_type, each.data
            )

    def write(self, name: str, data: bytes, stamp: int) -> None:
        """Write one message.

        Args:
            name: A topic that was added.
            data: The serialized message.
            stamp: When it came in [ns since 1970].

        Raises:
            OSError: if the file cannot be written.
        """
        channel, span = self._span.channels[name], self._span
        self._writer.add_message(
            channel.number, log_time=stamp, data=data, publish_time=stamp, sequence=channel.messages
        )
        channel.messages += 1
        span.first = min(span.first, stamp) if span.messages else stamp
        span.last = max(span.last, stamp)
        span.messages += 1

    def flush(self) -> None:
        """Bring what was written to disk when the last time is FLUSH ago; call it often.

        Raises:
            OSError: if the file cannot be written.
        """
        now = time.monotonic()
        if now - self._flushed < FLUSH:
            return
        self._flushed = now
        # The library ends a chunk by its size alone and has no public way to end one sooner.
        self._writer._Writer__finalize_chunk()
        self._stream.flush()

    def close(self) -> None:
        """End the recording: index and metadata.

        Raises:
            OSError: if the file cannot be written.
        """
        if self._stream.closed:
            return
        self._writer.finish()
        self._stream.close()
        temporary = self.folder / "metadata.yaml.part"
        temporary.write_text(yaml.safe_dump(self._metadata(), sort_keys=False))
        os.replace(temporary, self.folder / "metadata.yaml")

    def _metadata(self) -> dict[str, Any]:
        span = self._span
        times = {
            "duration": {"nanoseconds": span.last - span.first},
            "starting_time": {"nanoseconds_since_epoch": span.first},
            "message_count": span.messages,
        }
        topics = [
            {
                "topic_metadata": {
                    "name": name,
                    "type": channel.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": yaml.safe_load(channel.quality) or [],
                    "type_description_hash": "",
                },
                "message_count": channel.messages,
            }
            for name, channel in span.channels.items()
        ]
        information = {
            "version": 9,
            "storage_identifier": "mcap",
            **times,
            "topics_with_message_count": topics,
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [self.path.name],
            "files": [{"path": self.path.name, **times}],
            "custom_data": {},
            "ros_distro": "jazzy",
        }
        return {"rosbag2_bagfile_information": information}


def _profile(quality: Quality) -> dict[str, Any]:
    return {
        "history": "keep_last",
        "depth": quality.depth,
        "reliability": "reliable",
        "durability": "transient_local" if quality.latched else "volatile",
        "deadline": FOREVER,
        "lifespan": FOREVER,
        "liveliness": "automatic",
        "liveliness_lease_duration": FOREVER,
        "avoid_ros_namespace_conventions": False,
    }
