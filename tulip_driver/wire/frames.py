"""What the frames of the wire mean: identifiers, bits and steps of every number. docs/wire.md has them as tables.

Numbers beyond what their bits hold are cut off at the end. Steps are powers of two.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot_io import Battery, JointCommand, Sensors
from tulip_driver.wire.packet import FRAME, Frames, Kind, Packet, WireError

Array = NDArray[np.float64]

IDENTITY_ID = 0x001
COMMAND_ID = 0x100  # + number of the joint
JOINT_ID = 0x200  # + number of the joint
ORIENTATION_ID, ANGULAR_VELOCITY_ID, ACCELERATION_ID = 0x300, 0x301, 0x302
FOOT_ID = 0x310  # + 0 left, 1 right
BATTERY_ID = 0x320
EMERGENCY_ID = 0x330
NAMES = {
    COMMAND_ID: "joint command",
    JOINT_ID: "joint",
    ORIENTATION_ID: "orientation",
    ANGULAR_VELOCITY_ID: "angular velocity",
    ACCELERATION_ID: "acceleration",
    FOOT_ID: "foot",
}

POSITION_STEP = 2.0**-13  # [rad] to +-4
# Of a joint's command: bits, signed, step. Together 64.
COMMAND_BITS = (
    ("position", 16, True, POSITION_STEP),
    ("velocity", 12, True, 2.0**-7),  # [rad/s] to +-16
    ("stiffness", 12, False, 2.0**-2),  # [N m/rad] to 1023.75
    ("damping", 12, False, 2.0**-7),  # [N m s/rad] to 31.99
    ("effort", 12, True, 2.0**-4),  # [N m] to +-128
)
# Of a joint's reading, 16 bits each: position, velocity to +-32 rad/s, torque to +-256 N m, temperature.
JOINT_STEPS = np.array([POSITION_STEP, 2.0**-10, 2.0**-7, 2.0**-4])
ORIENTATION_STEP = 2.0**-15
ANGULAR_VELOCITY_STEP = 2.0**-11  # [rad/s] to +-16
ACCELERATION_STEP = 2.0**-9  # [m/s^2] to +-64
CELL_STEP = 2.0**-3  # [N] to +-4096
BATTERY_STEPS = np.array([2.0**-8, 2.0**-8, 2.0**-14])  # voltage to 128 V, current to +-128 A, charge to 1
UNKNOWN = -(2**15)
"""Stands for a temperature, current or charge that is not known."""
FAULT = 2
EMERGENCIES = {1: "its stop button is pressed", FAULT: "it has a fault"}
"""Why a body asks for an emergency stop, by number."""


def identity_frames(names: Sequence[str]) -> Frames:
    """Return the frame that tells which joints a body has: their number and the CRC-32 of their names."""
    checksum = zlib.crc32(",".join(names).encode())
    halves = np.array([checksum & 0xFFFF, checksum >> 16], np.uint16).view(np.int16)
    return _frames([IDENTITY_ID], np.array([[len(names), *halves, 0]]))


def check_identity(packet: Packet, names: Sequence[str]) -> None:
    """Refuse a body with other joints.

    Raises:
        WireError: if it has.
    """
    (told,) = _find(packet, IDENTITY_ID, 1, "identity")
    if told[0] != len(names):
        raise WireError(f"the body has {told[0]} joints; expected {len(names)}, those of robot.yaml")
    if (told != identity_frames(names)["data"][0]).any():
        raise WireError(f"the body's joints have other names; expected {', '.join(names)}, in this order")


def command_frames(command: JointCommand, names: Sequence[str]) -> Frames:
    """Return a frame for each joint of a command.

    Args:
        command: For some of the joints, or all.
        names: Of all the body's joints, whose places are the numbers of their frames.
    """
    word = np.zeros(len(command.names), np.uint64)
    shift = 0
    for name, bits, signed, step in COMMAND_BITS:
        lowest, highest = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
        number = np.clip(np.rint(getattr(command, name) / step), lowest, highest).astype(np.int64)
        word |= (number & ((1 << bits) - 1)).astype(np.uint64) << np.uint64(shift)
        shift += bits
    places = [COMMAND_ID + names.index(name) for name in command.names]
    return _frames(places, word.astype("<u8").view("<i2").reshape(-1, 4))


def command_of(packet: Packet, names: Sequence[str]) -> JointCommand:
    """Return the command of a packet.

    Raises:
        WireError: if a frame is no joint's command.
    """
    joints = packet.frames["id"].astype(int) - COMMAND_ID
    if packet.kind is not Kind.COMMAND or not len(joints) or joints.min() < 0 or joints.max() >= len(names):
        raise WireError(f"frames are {[hex(each) for each in packet.frames['id']]}; expected commands of joints")
    word = np.ascontiguousarray(packet.frames["data"]).view("<u8").ravel()
    values: dict[str, Array] = {}
    shift = 0
    for name, bits, signed, step in COMMAND_BITS:
        number = ((word >> np.uint64(shift)) & np.uint64((1 << bits) - 1)).astype(np.int64)
        if signed:
            number -= (number >> bits - 1) << bits
        values[name] = number.astype(float) * step
        shift += bits
    return JointCommand(packet.sequence, packet.stamp, tuple(names[joint] for joint in joints), **values)


def reading_frames(sensors: Sensors) -> Frames:
    """Return the frames of a whole reading."""
    n = len(sensors.joint_positions)
    known = sensors.joint_temperatures
    temperatures = np.full(n, np.nan) if known is None else known
    joints = np.column_stack((sensors.joint_positions, sensors.joint_velocities, sensors.joint_efforts, temperatures))
    parts = [
        (range(JOINT_ID, JOINT_ID + n), joints / JOINT_STEPS),
        ([ORIENTATION_ID], sensors.imu_orientation[None] / ORIENTATION_STEP),
        ([ANGULAR_VELOCITY_ID], _four(sensors.imu_angular_velocity) / ANGULAR_VELOCITY_STEP),
        ([ACCELERATION_ID], _four(sensors.imu_linear_acceleration) / ACCELERATION_STEP),
        ([FOOT_ID, FOOT_ID + 1], sensors.foot_cells / CELL_STEP),
    ]
    if sensors.battery is not None:
        battery = np.array([sensors.battery.voltage, sensors.battery.current, sensors.battery.charge])
        parts.append(([BATTERY_ID], _four(battery / BATTERY_STEPS)))
    if sensors.emergency:
        number = next((number for number, words in EMERGENCIES.items() if words == sensors.emergency), FAULT)
        parts.append(([EMERGENCY_ID], np.array([[number, 0.0, 0.0, 0.0]])))
    return np.concatenate([_frames(list(places), _rounded(values)) for places, values in parts])


def reading_of(packet: Packet, joints: int) -> Sensors:
    """Return the reading of a packet.

    Args:
        packet: Of kind READING.
        joints: How many the body has.

    Raises:
        WireError: if a sensor is missing.
    """
    states = _find(packet, JOINT_ID, joints, NAMES[JOINT_ID]) * JOINT_STEPS
    temperatures = np.where(states[:, 3] <= UNKNOWN * JOINT_STEPS[3], np.nan, states[:, 3])
    (orientation,) = _find(packet, ORIENTATION_ID, 1, NAMES[ORIENTATION_ID]) * ORIENTATION_STEP
    (angular_velocity,) = _find(packet, ANGULAR_VELOCITY_ID, 1, NAMES[ANGULAR_VELOCITY_ID]) * ANGULAR_VELOCITY_STEP
    (acceleration,) = _find(packet, ACCELERATION_ID, 1, NAMES[ACCELERATION_ID]) * ACCELERATION_STEP
    battery = None
    if (packet.frames["id"] == BATTERY_ID).any():
        told = packet.frames["data"][packet.frames["id"] == BATTERY_ID][0, :3]
        values = [math.nan if each == UNKNOWN else each * step for each, step in zip(told, BATTERY_STEPS, strict=True)]
        battery = Battery(*values)
    emergency = ""
    if (packet.frames["id"] == EMERGENCY_ID).any():
        number = int(packet.frames["data"][packet.frames["id"] == EMERGENCY_ID][0, 0])
        emergency = EMERGENCIES.get(number, f"for its reason number {number}")
    return Sensors(
        stamp=packet.stamp,
        joint_positions=states[:, 0],
        joint_velocities=states[:, 1],
        joint_efforts=states[:, 2],
        imu_orientation=orientation,
        imu_angular_velocity=angular_velocity[:3],
        imu_linear_acceleration=acceleration[:3],
        foot_cells=_find(packet, FOOT_ID, 2, NAMES[FOOT_ID]).astype(float) * CELL_STEP,
        joint_temperatures=None if np.isnan(temperatures).all() else temperatures,
        battery=battery,
        emergency=emergency,
    )


def _find(packet: Packet, first: int, count: int, name: str) -> NDArray[np.int16]:
    """Return (count, 4) numbers of the frames from an identifier on."""
    wanted = range(first, first + count)
    places = {int(each): place for place, each in enumerate(packet.frames["id"])}
    missing = [each for each in wanted if each not in places]
    if missing:
        raise WireError(f"packet of kind {packet.kind.name} lacks the frame {missing[0]:#x} ({name})")
    found: NDArray[np.int16] = packet.frames["data"][[places[each] for each in wanted]]
    return found


def _frames(places: Sequence[int], data: NDArray[np.int64] | NDArray[np.int16]) -> Frames:
    frames = np.zeros(len(places), FRAME)
    frames["id"], frames["data"] = places, data
    return frames


def _four(values: Array) -> Array:
    """Return (1, 4) numbers: three and a zero."""
    return np.array([[*values, 0.0]])


def _rounded(values: Array) -> NDArray[np.int64]:
    """Return whole numbers of 16 bits; what is not known has a number of its own."""
    known = np.clip(np.rint(values), UNKNOWN + 1, 2**15 - 1)
    return np.where(np.isnan(values), UNKNOWN, known).astype(np.int64)
