"""Recorded topics that keep their last message for late listeners."""

from __future__ import annotations

from collections.abc import Sequence

from tulip_ros import topics
from tulip_ros.bag_metadata import profiles_of
from tulip_ros.log_file import Log, LoggedTopic, Record
from tulip_ros.topics import Quality

DEEPEST = 1000  # messages that a sender keeps; a recording that asks for more is not obeyed
SPARE = Quality(depth=50)  # of topics that this project does not know and whose recorder did not note it


def quality_of(topic: LoggedTopic) -> Quality:
    """Return the quality of service of a recorded topic: as noted, else as this project has it."""
    for known in topics.TOPICS:
        if topic.name.endswith(f"/{known.name.lstrip('/')}") and topic.type_name == known.type_name:
            return known.quality
    profiles = profiles_of(topic.quality)
    try:
        latched = bool(profiles) and all(each["durability"] in ("transient_local", 1) for each in profiles)
        depth = max((int(each["depth"]) for each in profiles), default=0)
    except (KeyError, TypeError, ValueError, OverflowError):
        return SPARE
    return Quality(depth if 0 < depth <= DEEPEST else SPARE.depth, latched)


def latched_before(log: Log, names: Sequence[str], start: int) -> list[Record]:
    """Return what somebody who begins to listen at a time still hears from before: each latched topic's last message.

    Args:
        log: The recording.
        names: Of the topics wanted.
        start: Log time [ns].
    """
    latched = [name for name in names if quality_of(log.topics[name]).latched]
    return list({record.topic.name: record for record in log.records(latched, None, start)}.values()) if latched else []
