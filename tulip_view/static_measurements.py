"""Static measurements from a recording of the experiment, simulated or of the real robot: what the fit begins with.

The recording says on `identification/progress` which readings count. They are averaged as the experiment itself does.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tulip_description.robot import Robot
from tulip_motion.identification.averaging import HoldAverage
from tulip_motion.identification.progress import Hold
from tulip_motion.identification.static_measurement import StaticMeasurement
from tulip_motion.messages import progress_from_message
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_view.recorded_sensors import full_name, sensors_of

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
    name = full_name(topics.IDENTIFICATION, namespace)
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
    averages, present = [HoldAverage(robot, hold.side) for hold in holds], 0
    for sensors in sensors_of(path, namespace):
        while present < len(holds) and sensors.stamp > holds[present].end:
            present += 1
            advance(1)
        if present < len(holds) and sensors.stamp >= holds[present].begin:
            averages[present].add(sensors)
    found = []
    for hold, average in zip(holds, averages, strict=True):
        try:
            found.append((hold, average.measurement()))
        except ValueError as error:
            raise BadInputError(f"Recording {path}, posture {hold.posture}: {error}.") from error
    return tuple(found)
