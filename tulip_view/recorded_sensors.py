"""The sensors of a robot's body from a recording, simulated or of the real robot: what identifications begin with."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tulip_description.robot_io import Sensors
from tulip_motion.identification.motion_log import MotionLog, longest_part
from tulip_motion.messages import sensors_from_messages
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_ros.matching import SameStamp
from tulip_ros.time import stamp_of
from tulip_ros.topics import Topic

SENSORS = (topics.JOINT_STATES, topics.IMU, topics.FOOT_FORCES)


def sensors_of(path: Path, namespace: str = "", within: tuple[float, float] | None = None) -> Iterator[Sensors]:
    """Return the readings of joints, IMU and foot cells of one robot, in the order of the recording.

    Args:
        path: Folder or file of the recording.
        namespace: Of the robot; "" for one that is alone.
        within: From when to when [s] since the recording's begin, by its own clock; None: all of it.

    Raises:
        BadInputError: if the recording cannot be read, lacks one of the sensors, or is of a robot with other joints.
    """
    with Log(path) as log:
        names = [full_name(topic, namespace) for topic in SENSORS]
        missing = [name for name in names if name not in log.topics or not log.topics[name].messages]
        if missing:
            raise BadInputError(
                f"Recording {log.path} has no messages of {', '.join(missing)}; expected joints, IMU and foot cells of"
                f" the robot {namespace or 'that is alone'}: record these topics, or choose the robot by its namespace."
            )
        begin, _ = log.span
        start, end = (None, None) if within is None else (begin + round(1e9 * each) for each in within)
        instants = SameStamp(*names)
        for record in log.records(names, start, end):
            message = log.decode(record)
            complete = instants.add(record.topic.name, stamp_of(message), message)
            if complete is not None:
                yield _sensors(log.path, complete)


def motion_log_of(path: Path, namespace: str = "") -> MotionLog:
    """Return the longest part of a recording without a gap; arguments and errors as for `sensors_of`."""
    readings = list(sensors_of(path, namespace))
    try:
        return MotionLog.of(longest_part(readings))
    except ValueError as error:
        raise BadInputError(f"Recording {path}: {error}.") from error


def full_name(topic: Topic, namespace: str) -> str:
    """Return the name that a robot's topic has in a recording."""
    return f"/{topic.within(namespace).name}"


def _sensors(path: Path, messages: tuple[Any, ...]) -> Sensors:
    try:
        return sensors_from_messages(*messages)
    except ValueError as error:
        raise BadInputError(f"Recording {path} is of another robot: {error}.") from error
