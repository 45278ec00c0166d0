"""metadata.yaml of a recording, as ROS 2 writes it: which files there are, and what is in them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from tulip_description.yaml_text import load_yaml
from tulip_ros.topics import Quality

NAME = "metadata.yaml"
FOREVER = {"sec": 9223372036, "nsec": 854775807}


@dataclass(frozen=True)
class FileEntry:
    """One file: its name, log times of the first and the last message [ns], and how many there are."""

    name: str
    first: int
    last: int
    messages: int


@dataclass(frozen=True)
class TopicEntry:
    """One topic: name, type, quality of service in YAML ("" where not known), and how many messages there are."""

    name: str
    type_name: str
    quality: str
    messages: int


def write(
    folder: Path, files: Sequence[FileEntry], topics: Sequence[TopicEntry], notes: Mapping[str, str] | None = None
) -> None:
    """Write the file.

    Args:
        folder: Of the recording.
        files: In the order of time.
        topics: Of all files together.
        notes: Go in as `custom_data`.

    Raises:
        OSError: if it cannot be written.
    """
    filled = [entry for entry in files if entry.messages]
    first = min((entry.first for entry in filled), default=0)
    last = max((entry.last for entry in filled), default=0)
    information = {
        "version": 9,
        "storage_identifier": "mcap",
        **_times(FileEntry("", first, last, sum(entry.messages for entry in files))),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": profiles_of(topic.quality),
                    "type_description_hash": "",
                },
                "message_count": topic.messages,
            }
            for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [entry.name for entry in files],
        "files": [{"path": entry.name, **_times(entry)} for entry in files],
        "custom_data": dict(notes or {}),
        "ros_distro": "jazzy",
    }
    temporary = folder / f"{NAME}.part"
    with open(temporary, "w") as stream:
        yaml.safe_dump({"rosbag2_bagfile_information": information}, stream, sort_keys=False)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(temporary, folder / NAME)


def quality_profiles(quality: Quality) -> str:
    """Return a quality of service as recordings note it, in YAML."""
    profile = {
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
    return yaml.safe_dump([profile], sort_keys=False)


def profiles_of(quality: str) -> list[Any]:
    """Return the profiles of a quality of service as a recording notes it; none of one that is no such YAML."""
    try:
        found = load_yaml(quality)
    except yaml.YAMLError:
        return []
    return found if isinstance(found, list) else []


def _times(entry: FileEntry) -> dict[str, Any]:
    return {
        "duration": {"nanoseconds": entry.last - entry.first},
        "starting_time": {"nanoseconds_since_epoch": entry.first},
        "message_count": entry.messages,
    }
