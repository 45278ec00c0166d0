"""Static measurements from a recording of the experiment, simulated or of the real robot: what the fit begins with.

The recording says on `identification/progress` which readings count. They are averaged as the experiment itself does.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tulip_description.robot import Robot
from tulip_description.robot_io import Sensors
from tulip_motion.identification.averaging import HoldAverage
from tulip_motion.identification.progress import Hold
from tulip_motion.identification.static_measurement import StaticMeasurement
from tulip_motion.messages import progress_from_message, sensors_from_messages
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_ros.matching import SameStamp
from tulip_ros.time import stamp_of
from tulip_ros.topics import Topic

SENSORS = (topics.JOINT_STATES, topics.IMU, topics.FOOT_FORCES)
Advance = Callable[[int], None]
"""Is told how many postures were averaged since the last time."""


def holds_of(log: Log, namespace: str = "") -> tuple[Hold, ...]:
    """Return which postures were held, and when, in their order.

    Args:
        log: A recording.
        namespace: Of the robot; "" for one that is alone.

    Raises:
        BadInputError: if the recording is none of an experiment, or no posture was held in it.
    """
    name = _full_name(topics.IDENTIFICATION, namespace)
    if name not in log.topics:
        raise BadInputError(f"Recording {log.path} has no topic {name}; expected one of scripts/identify.py run.")
    found: dict[int, Hold] = {}
    for record in log.records([name]):
        try:
            hold = progress_from_message(log.decode(record)).hold
        except ValueError as error:
            raise BadInputError(f"Recording {log.path}: {error}.") from error
        if hold is not None:
            found[hold.posture] = hold
    if not found:
        raise BadInputError(f"In recording {log.path} no posture was held; repeat the experiment.")
    return tuple(found.values())


def measurements_of(
    path: Path, robot: Robot, namespace: str = "", advance: Advance = lambda number: None
) -> tuple[tuple[Hold, StaticMeasurement], ...]:
    """Return what each posture told that was held.

    Args:
        path: Folder or file of the recording.
        robot: Whose it is; gives the places of the cells.
        namespace: Of the robot; "" for one that is alone.
        advance: For a progress bar.

    Raises:
        BadInputError: if the recording cannot be used.
    """
    with Log(path) as log:
        holds = holds_of(log, namespace)
        averages = [HoldAverage(robot, hold.side) for hold in holds]
        names = [_full_name(topic, namespace) for topic in SENSORS]
        instants, present = SameStamp(*names), 0
        # Recorders differ in their clocks: stamps alone say which readings count.
        for record in log.records(names):
            message = log.decode(record)
            complete = instants.add(record.topic.name, stamp_of(message), message)
            if complete is None:
                continue
            stamp = stamp_of(message)
            while present < len(holds) and stamp > holds[present].end:
                present += 1
                advance(1)
            if present < len(holds) and stamp >= holds[present].begin:
                averages[present].add(_sensors(path, complete))
    found = []
    for hold, average in zip(holds, averages, strict=True):
        try:
            found.append((hold, average.measurement()))
        except ValueError as error:
            raise BadInputError(f"Recording {path}, posture {hold.posture}: {error}.") from error
    return tuple(found)


def _sensors(path: Path, messages: tuple[Any, ...]) -> Sensors:
    try:
        return sensors_from_messages(*messages)
    except ValueError as error:
        raise BadInputError(f"Recording {path} is of another robot: {error}.") from error


def _full_name(topic: Topic, namespace: str) -> str:
    return f"/{topic.within(namespace).name}"
