"""How a robot stands: now, as its running driver says, or at a moment of a recording. What rehearsals begin with."""

from __future__ import annotations

import math
import time
from functools import partial
from pathlib import Path
from typing import Any

from tulip_description.robot import Robot
from tulip_description.robot_io import Sensors
from tulip_motion.messages import sensors_from_messages
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_ros.matching import SameStamp
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import stamp_of
from tulip_sim.rehearsal.present import Present, present_of
from tulip_view.recorded_sensors import SENSORS, sensors_of

SPAN = 0.3  # [s] of readings that are averaged
ENOUGH = 75  # readings: SPAN at 250 Hz
PATIENCE = 10.0  # [s] of wall-clock time for a running robot to be heard


class _Listener(ComponentNode):
    """Collects readings of a running robot."""

    def __init__(self, namespace: str) -> None:
        super().__init__("rehearsal", namespace=namespace)
        self.readings: list[Sensors] = []
        self.fault = ""
        self._instants = SameStamp(*(topic.name for topic in SENSORS))
        for topic in SENSORS:
            self.listen(topic, partial(self._on_sensor, topic.name))

    def begin_anew(self) -> None:
        """Forget what was heard: time began anew."""
        self.readings.clear()
        self._instants = SameStamp(*(topic.name for topic in SENSORS))

    def _on_sensor(self, name: str, message: Any) -> None:
        complete = self._instants.add(name, stamp_of(message), message)
        if complete is not None:
            try:
                self.readings.append(sensors_from_messages(*complete))
            except ValueError as error:
                self.fault = str(error)


def running(robot: Robot, namespace: str = "", patience: float = PATIENCE) -> Present:
    """Return how a running robot stands.

    Args:
        robot: What it is like.
        namespace: Of its nodes.
        patience: Longest wait for its sensors [s].

    Raises:
        BadInputError: if its sensors are not heard, or it does not stand.
    """
    with session(lambda: _Listener(namespace), arguments=[], handle_signals=False) as (listener, spin):
        end = time.monotonic() + patience
        while len(listener.readings) < ENOUGH and not listener.fault and time.monotonic() < end:
            spin(0.05)
    if listener.fault:
        raise BadInputError(f"The running robot is another one: {listener.fault}.")
    if len(listener.readings) < ENOUGH:
        raise BadInputError(
            f"No robot was heard within {patience:.0f} s on {', '.join(topic.name for topic in SENSORS)}: start its"
            " driver (scripts/launch.py), or rehearse from its standing posture."
        )
    return _checked(robot, listener.readings, "The running robot")


def recorded(robot: Robot, path: Path, at: float, namespace: str = "") -> Present:
    """Return how a robot stood at a moment of a recording.

    Args:
        robot: What it is like.
        path: Folder or file of the recording.
        at: Time since the recording's begin [s].
        namespace: Of the robot in it.

    Raises:
        BadInputError: if the recording cannot be read or lacks a sensor, has nothing at that time, or the robot does
            not stand there.
    """
    if not (math.isfinite(at) and at >= 0.0):
        raise BadInputError(f"Time in the recording is {at} s; expected 0 or more.")
    readings = list(sensors_of(path, namespace, (at, at + SPAN)))
    if not readings:
        with Log(path) as log:
            begin, end = log.span
        raise BadInputError(
            f"Recording {path} has no readings at {at:g} s; it lasts {1e-9 * (end - begin):.1f} s. Name another time."
        )
    return _checked(robot, readings, f"The robot at {at:g} s of {path}")


def _checked(robot: Robot, readings: list[Sensors], who: str) -> Present:
    try:
        return present_of(robot, readings)
    except ValueError as error:
        raise BadInputError(f"{who} cannot be rehearsed from: {error}.") from error
