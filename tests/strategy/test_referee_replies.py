from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.planar import Pose2D
from tulip_strategy.game_controller import Rejected, Reply, ReplyMessage, RobotStatus, decode_reply, encode_reply
from tulip_strategy.game_controller.replies import ANSWERS

byte = st.integers(0, 0xFF)
word = st.integers(0, 0xFFFF)
metres = st.floats(-20.0, 20.0)
STATUS = RobotStatus(True, Pose2D(-1.5, 0.25, 0.5), (2.0, -0.125), 1.5)


def test_replies_have_the_bytes_of_their_versions() -> None:
    assert encode_reply(Reply(25, 1)).hex() == "52477274" + "01000000" + "1900" + "0100" + "02000000"
    assert encode_reply(Reply(25, 1, version=2)).hex() == "52477274" + "02" + "19" + "01" + "02"
    assert encode_reply(Reply(25, 3, version=4, status=STATUS)) == struct.pack(
        "<4s4B3ff2f", b"RGrt", 4, 3, 25, 1, -1500.0, 250.0, 0.5, 1.5, 2000.0, -125.0
    )


def test_every_version_of_the_packet_has_its_reply_and_port() -> None:
    assert ANSWERS == {7: (1, 3838), 8: (2, 3838), 12: (2, 3939), 18: (4, 3939), 19: (4, 3939), 20: (4, 3939)}


def test_a_ball_that_was_never_seen_has_the_age_minus_one() -> None:
    data = encode_reply(Reply(25, 1, version=4, status=RobotStatus(False, Pose2D())))
    assert struct.unpack("<f", data[20:24]) == (-1.0,)
    assert data[7] == 0
    reply = decode_reply(data)
    assert isinstance(reply, Reply)
    assert reply.status == RobotStatus(False, Pose2D())


@given(word, word, st.sampled_from(ReplyMessage))
def test_reply_1_survives_the_round_trip(team: int, player: int, message: ReplyMessage) -> None:
    reply = Reply(team, player, message)
    assert decode_reply(encode_reply(reply)) == reply


@given(byte, byte, st.sampled_from(ReplyMessage))
def test_reply_2_survives_the_round_trip(team: int, player: int, message: ReplyMessage) -> None:
    reply = Reply(team, player, message, 2)
    assert decode_reply(encode_reply(reply)) == reply


@given(byte, byte, st.booleans(), metres, metres, metres, metres, metres, st.floats(0.0, 1000.0))
def test_reply_4_survives_the_round_trip_within_single_precision(
    team: int, player: int, fallen: bool, x: float, y: float, yaw: float, ahead: float, left: float, age: float
) -> None:
    status = RobotStatus(fallen, Pose2D(x, y, yaw), (ahead, left), age)
    reply = decode_reply(encode_reply(Reply(team, player, version=4, status=status)))
    assert isinstance(reply, Reply)
    assert (reply.team, reply.player, reply.version) == (team, player, 4)
    back = reply.status
    assert back is not None
    assert back.ball is not None
    assert back.fallen is fallen
    numbers = (back.pose.x, back.pose.y, back.pose.yaw, *back.ball, back.ball_age)
    assert numbers == pytest.approx((x, y, yaw, ahead, left, age), rel=1e-6, abs=1e-6)  # 24 bits of mantissa


def test_reply_4_without_a_status_is_refused_since_nobody_knows_whether_the_robot_is_fallen() -> None:
    with pytest.raises(ValueError, match="reply 4 has no status"):
        encode_reply(Reply(25, 1, version=4))


def test_replies_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="does not fit"):
        encode_reply(Reply(256, 1, version=2))
    with pytest.raises(ValueError, match="does not fit"):
        encode_reply(Reply(25, 1, version=4, status=RobotStatus(False, Pose2D(1e36, 0.0, 0.0))))
    with pytest.raises(ValueError, match="reply version is 3; expected one of: 1, 2, 4"):
        encode_reply(Reply(25, 1, version=3))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"RGrt", "is 4 bytes long"),
        (b"RGme\x02\x19\x01\x02", "begins with b'RGme'"),
        (b"RGrt\x03\x19\x01\x02", "version is 3; expected one of: 1, 2, 4"),
        (b"RGrt\x02\x19\x01\x02\x00", "version 2 is 9 bytes long; expected 8"),
        (b"RGrt\x02\x19\x01\x03", "message is 3"),
        (b"RGrt\x01\x01\x00\x00\x19\x00\x01\x00\x02\x00\x00\x00", "version is 257"),
        (b"RGrt\x04\x01\x19\xff" + bytes(24), "fallen is 255; expected 0 or 1"),
        (b"RGrt\x04\x01\x19\x00" + b"\x00\x00\xc0\x7f" * 6, "not a finite number"),
    ],
)
def test_rejection_of_a_reply_names_what_is_wrong(data: bytes, words: str) -> None:
    rejected = decode_reply(data)
    assert isinstance(rejected, Rejected)
    assert words in rejected.reason


@given(st.binary(max_size=64))
def test_any_bytes_decode_to_a_reply_or_a_reason(data: bytes) -> None:
    assert isinstance(decode_reply(data), Rejected | Reply)
    assert isinstance(decode_reply(b"RGrt" + data), Rejected | Reply)
