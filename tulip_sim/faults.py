"""Faults of the simulated body's sensors, from a moment on: what breaks, and what is read then.

Each is a line of text, so that a parameter file can hold it: kind, part where there is one, and when it begins [s].

    encoder left_knee 12.5      the joint's angle is read as it was then, also by the joint's own controller
    imu 12.5                    every reading of the IMU is the one of then
    cell left_toe_outer 12.5    that force cell reads nothing
    camera 12.5                 no pictures any more

A joint has two encoders: the one that sticks tells its angle, at the joint; its speed comes from the motor's side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import CELL_NAMES, SIDES
from tulip_description.robot_io import Sensors

Array = NDArray[np.float64]


CELLS = tuple(f"{side}_{place}" for side in SIDES for place in CELL_NAMES)
"""Names of the force cells, in the order of `Sensors.foot_cells`."""
PARTS = {"encoder": "a joint", "imu": "", "cell": "a force cell", "camera": ""}
"""Kinds of faults, and what their second word names."""


@dataclass(frozen=True)
class SensorFault:
    """One fault.

    Attributes:
        kind: One of PARTS.
        part: Joint or force cell, or "".
        begin: [ns].
    """

    kind: str
    part: str
    begin: int


def read_fault(text: str) -> SensorFault:
    """Return the fault that a line describes.

    Raises:
        ValueError: if it describes none.
    """
    kind, *rest = text.split() or [""]
    if kind not in PARTS:
        raise ValueError(f"fault is {text!r}; expected to begin with one of {', '.join(PARTS)}")
    wanted = f"{kind}{f' NAME, the name of {PARTS[kind]},' if PARTS[kind] else ''} and a time in s"
    if len(rest) != (2 if PARTS[kind] else 1):
        raise ValueError(f"fault is {text!r}; expected {wanted}")
    try:
        begin = float(rest[-1])
    except ValueError:
        begin = math.nan
    if not (math.isfinite(begin) and begin >= 0.0):
        raise ValueError(f"fault is {text!r}; expected {wanted} >= 0")
    part = rest[0] if PARTS[kind] else ""
    if kind == "cell" and part not in CELLS:
        raise ValueError(f"fault is {text!r}; expected a force cell out of {', '.join(CELLS)}")
    return SensorFault(kind, part, round(begin * 1e9))


class SensorFaults:
    """The faults of one robot's sensors. Without any it changes nothing.

    Args:
        lines: As above.
        joint_names: All joints, in the order of `Sensors`.

    Raises:
        ValueError: if a line describes no fault, or an unknown joint.
    """

    def __init__(self, lines: Sequence[str], joint_names: Sequence[str]) -> None:
        faults = [read_fault(line) for line in lines]
        for fault in faults:
            if fault.kind == "encoder" and fault.part not in joint_names:
                raise ValueError(f"fault of encoder {fault.part!r}; expected a joint out of {', '.join(joint_names)}")
        self._encoders = {joint_names.index(each.part): each.begin for each in faults if each.kind == "encoder"}
        self._cells = {CELLS.index(each.part): each.begin for each in faults if each.kind == "cell"}
        self._imu = min((each.begin for each in faults if each.kind == "imu"), default=None)
        self._camera = min((each.begin for each in faults if each.kind == "camera"), default=None)
        self._felt: dict[int, float] = {}  # [rad] where the joint's controller finds each encoder that sticks
        self._read: dict[int, float] = {}  # [rad] what its readings say
        self._frozen: Sensors | None = None

    def sees(self, now: int) -> bool:
        """Return whether there are pictures at a time [ns]."""
        return self._camera is None or now < self._camera

    def felt(self, positions: Array, now: int) -> Array:
        """Return (n,) joint positions [rad] as the joints' controllers read them.

        Args:
            positions: (n,) as they are [rad].
            now: [ns].
        """
        return _stuck(positions, self._encoders, self._felt, now)

    def reading(self, sensors: Sensors) -> Sensors:
        """Return what is read in place of a reading."""
        now = sensors.stamp
        if self._encoders:
            sensors = replace(sensors, joint_positions=_stuck(sensors.joint_positions, self._encoders, self._read, now))
        dead = [index for index, begin in self._cells.items() if now >= begin]
        if dead:
            cells = sensors.foot_cells.copy()
            cells.ravel()[dead] = 0.0
            sensors = replace(sensors, foot_cells=cells)
        if self._imu is None or now < self._imu:
            return sensors
        kept = self._frozen = self._frozen or sensors
        return replace(
            sensors,
            imu_orientation=kept.imu_orientation,
            imu_angular_velocity=kept.imu_angular_velocity,
            imu_linear_acceleration=kept.imu_linear_acceleration,
        )


def _stuck(positions: Array, begins: dict[int, int], kept: dict[int, float], now: int) -> Array:
    """Return positions in which those encoders that stick by now read what they did when they began to."""
    due = [index for index, begin in begins.items() if now >= begin]
    if not due:
        return positions
    positions = positions.copy()
    for index in due:
        positions[index] = kept.setdefault(index, float(positions[index]))
    return positions
