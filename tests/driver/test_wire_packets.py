"""The bytes of the wire: numbers keep their value to half a step, and nothing but a whole packet is one."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from bodies import ROBOT, VirtualBody, command
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tulip_description.robot import JOINTS, LEG_JOINTS
from tulip_description.robot_io import Battery
from tulip_driver.wire.frames import (
    check_identity,
    command_frames,
    command_of,
    identity_frames,
    reading_frames,
    reading_of,
)
from tulip_driver.wire.packet import Kind, Packet, Stream, VersionError, WireError, decode, encode

READING = VirtualBody().exchange(None)
HEADER = 17  # [B]


def packet_of_reading(sequence: int = 1) -> bytes:
    return encode(Packet(Kind.READING, sequence, READING.stamp, reading_frames(READING)))


def test_a_command_of_one_joint_has_the_bits_that_the_document_says() -> None:
    order = command(
        stamp=5, names=("left_hip_roll",), position=-1.0, velocity=0.5, stiffness=100.0, damping=2.0, effort=-3.0
    )
    data = encode(Packet(Kind.COMMAND, 9, 5, command_frames(order, JOINTS)))
    word = (-8192 & 0xFFFF) | 64 << 16 | 400 << 28 | 256 << 40 | (-48 & 0xFFF) << 52
    body = b"TU\x01\x03" + struct.pack("<IQB", 9, 5, 1) + struct.pack("<HQ", 0x101, word)
    assert data == body + struct.pack("<I", zlib.crc32(body))


@pytest.mark.parametrize(
    ("words", "heard", "number"),
    [
        ("its stop button is pressed", "its stop button is pressed", 1),
        ("winding of left_knee is broken", "it has a fault", 2),
    ],
)
def test_a_body_that_asks_for_an_emergency_stop_says_so_in_a_frame_of_its_own(
    words: str, heard: str, number: int
) -> None:
    assert 0x330 not in reading_frames(READING)["id"]
    frames = reading_frames(replace(READING, emergency=words))
    assert (frames[-1]["id"], frames[-1]["data"].tolist()) == (0x330, [number, 0, 0, 0])
    assert reading_of(Packet(Kind.READING, 1, 1, frames), len(JOINTS)).emergency == heard
    frames["data"][-1, 0] = 77  # of a newer body
    assert reading_of(Packet(Kind.READING, 1, 1, frames), len(JOINTS)).emergency == "for its reason number 77"


def test_a_joints_reading_has_the_bits_that_the_document_says() -> None:
    reading = replace(
        READING,
        joint_positions=np.full(14, 0.5),
        joint_velocities=np.full(14, -1.0),
        joint_efforts=np.full(14, 2.0),
        joint_temperatures=np.array([40.0, *[np.nan] * 13]),
    )
    frames = reading_frames(reading)
    assert frames[0]["id"] == 0x200 and frames[0]["data"].tolist() == [4096, -1024, 256, 640]
    assert frames[1]["data"][3] == -32768


@given(
    arrays(float, 12, elements=st.floats(-3.99, 3.99)),
    arrays(float, 12, elements=st.floats(-15, 15)),
    arrays(float, 12, elements=st.floats(-120, 120)),
    arrays(float, 12, elements=st.floats(0, 1000)),
    arrays(float, 12, elements=st.floats(0, 31)),
)
def test_a_command_comes_back_to_half_a_step(
    position: np.ndarray, velocity: np.ndarray, effort: np.ndarray, stiffness: np.ndarray, damping: np.ndarray
) -> None:
    sent = command(7, 3, position=position, velocity=velocity, effort=effort, stiffness=stiffness, damping=damping)
    packet = decode(encode(Packet(Kind.COMMAND, 3, 7, command_frames(sent, JOINTS))))
    came = command_of(packet, JOINTS)
    assert (came.sequence, came.stamp, came.names) == (3, 7, LEG_JOINTS)
    for name, step in (
        ("position", 2**-13),
        ("velocity", 2**-7),
        ("effort", 2**-4),
        ("stiffness", 0.25),
        ("damping", 2**-7),
    ):
        np.testing.assert_allclose(getattr(came, name), getattr(sent, name), atol=step / 2 + 1e-12)


def test_values_beyond_the_bits_are_cut_off_and_never_change_their_sign() -> None:
    sent = command(position=100.0, velocity=-100.0, effort=1e6, stiffness=1e6, damping=1e6)
    came = command_of(decode(encode(Packet(Kind.COMMAND, 1, 0, command_frames(sent, JOINTS)))), JOINTS)
    assert came.position[0] == pytest.approx(4.0, abs=1e-3)
    assert came.velocity[0] == -16.0
    assert came.effort[0] == pytest.approx(128.0, abs=0.1)
    assert came.stiffness[0] == 1023.75
    assert came.damping[0] == pytest.approx(32.0, abs=0.01)


def test_a_reading_comes_back_with_what_is_known_of_temperatures_and_battery() -> None:
    rng = np.random.default_rng(1)
    sent = replace(
        READING,
        joint_positions=rng.uniform(-2, 2, 14),
        joint_velocities=rng.uniform(-10, 10, 14),
        joint_efforts=rng.uniform(-60, 60, 14),
        imu_orientation=np.array([0.1, -0.2, 0.3, 0.927]),
        imu_angular_velocity=rng.uniform(-5, 5, 3),
        imu_linear_acceleration=rng.uniform(-30, 30, 3),
        foot_cells=rng.uniform(0, 300, (2, 4)),
        joint_temperatures=np.array([35.0, *[np.nan] * 13]),
        battery=Battery(25.2, current=3.5),
    )
    came = reading_of(decode(encode(Packet(Kind.READING, 1, 99, reading_frames(sent)))), 14)
    assert came.stamp == 99
    np.testing.assert_allclose(came.joint_positions, sent.joint_positions, atol=2**-14)
    np.testing.assert_allclose(came.joint_velocities, sent.joint_velocities, atol=2**-11)
    np.testing.assert_allclose(came.joint_efforts, sent.joint_efforts, atol=2**-8)
    np.testing.assert_allclose(came.imu_orientation, sent.imu_orientation, atol=2**-16)
    np.testing.assert_allclose(came.imu_angular_velocity, sent.imu_angular_velocity, atol=2**-12)
    np.testing.assert_allclose(came.imu_linear_acceleration, sent.imu_linear_acceleration, atol=2**-10)
    np.testing.assert_allclose(came.foot_cells, sent.foot_cells, atol=2**-4)
    assert came.joint_temperatures is not None and came.joint_temperatures[0] == 35.0
    assert np.isnan(came.joint_temperatures[1:]).all()
    assert came.battery is not None and came.battery.voltage == pytest.approx(25.2, abs=0.01)
    assert came.battery.current == 3.5 and np.isnan(came.battery.charge)


def test_every_single_wrong_bit_is_noticed() -> None:
    data = packet_of_reading()
    for bit in range(8 * len(data)):
        wrong = bytearray(data)
        wrong[bit // 8] ^= 1 << bit % 8
        with pytest.raises(WireError):
            decode(bytes(wrong))


@given(st.binary(max_size=400))
def test_arbitrary_bytes_are_refused_with_a_reason(data: bytes) -> None:
    with pytest.raises(WireError, match="expected"):
        decode(data)


@given(st.integers(0, 65535), st.integers(1, 40))
def test_whole_packets_with_other_frames_are_refused_with_a_reason(first: int, count: int) -> None:
    frames = np.zeros(count, reading_frames(READING).dtype)
    frames["id"] = (first + np.arange(count)) % 65536
    packet = decode(encode(Packet(Kind.READING, 1, 0, frames)))
    with pytest.raises(WireError):
        reading_of(packet, 14)


def test_another_version_is_told_before_the_checksum_is_asked() -> None:
    data = bytearray(packet_of_reading())
    data[2] = 2
    with pytest.raises(VersionError, match="version 2 of the wire; expected 1"):
        decode(bytes(data))


def test_command_frames_of_unknown_joints_are_refused() -> None:
    frames = command_frames(command(), JOINTS).copy()
    frames["id"][0] = 0x10E
    with pytest.raises(WireError, match="expected commands of joints"):
        command_of(Packet(Kind.COMMAND, 1, 0, frames), JOINTS)


def test_another_robot_is_told_by_its_number_of_joints_or_their_names() -> None:
    names = ROBOT.joint_names
    check_identity(Packet(Kind.IDENTITY, 1, 0, identity_frames(names)), names)
    with pytest.raises(WireError, match="has 12 joints; expected 14"):
        check_identity(Packet(Kind.IDENTITY, 1, 0, identity_frames(names[:12])), names)
    with pytest.raises(WireError, match="other names"):
        check_identity(Packet(Kind.IDENTITY, 1, 0, identity_frames((*names[1:], names[0]))), names)


@settings(max_examples=30)
@given(st.binary(max_size=60), st.binary(max_size=60), st.integers(1, 97))
def test_a_stream_gives_every_packet_out_of_noise_and_pieces(before: bytes, between: bytes, piece: int) -> None:
    # Noise that looks like the beginning of a long packet may hold up what follows until more bytes come.
    packets = [packet_of_reading(number) for number in (1, 2)]
    line = before + packets[0] + between + packets[1] + bytes(3000)
    stream = Stream()
    found = [each for start in range(0, len(line), piece) for each in stream.feed(line[start : start + piece])]
    assert found == packets
