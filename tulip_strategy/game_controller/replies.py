"""What a robot sends back to the referee program, and to which port.

| reply | answers packets of version | bytes | to port |
| --- | --- | --- | --- |
| 1 | 7 | 16 | 3838 |
| 2 | 8 | 8 | 3838 |
| 2 | 12 | 8 | 3939 |
| 4 | 18, 19, 20 | 32 | 3939 |

Reply 4 tells where the robot is, in metres here and in millimetres on the wire. Its frame is `map`: the origin in the
middle of the field, x towards the goal that the robot attacks, so that its own goal is at negative x.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import IntEnum

from tulip_description.planar import Pose2D
from tulip_strategy.game_controller.packets import Fault, Rejected

REPLY_MAGIC = b"RGrt"
ANSWERS: dict[int, tuple[int, int]] = {
    7: (1, 3838),
    8: (2, 3838),
    12: (2, 3939),
    18: (4, 3939),
    19: (4, 3939),
    20: (4, 3939),
}
"""By version of the packet: version of the reply, and the referee's UDP port."""
STATUS_VERSION = 4  # the reply that tells the robot's status

_PREFIX = 5  # bytes needed to know the version, which is in byte 4 of every reply
_REPLIES = {1: struct.Struct("<4sIHHI"), 2: struct.Struct("<4s4B"), STATUS_VERSION: struct.Struct("<4s4B3ff2f")}
_NEVER = -1.0  # age of a ball that was never seen
_MILLIMETRES = 1000.0  # [mm/m]


class ReplyMessage(IntEnum):
    """What a robot asks or says; reply 4 always says that it is alive."""

    PENALISE = 0
    UNPENALISE = 1
    ALIVE = 2


@dataclass(frozen=True)
class RobotStatus:
    """What a robot tells of itself.

    Attributes:
        fallen: Whether it lies on the ground.
        pose: base_footprint in map [m], [rad].
        ball: (x, y) of the ball in base_footprint [m], or None if it was never seen.
        ball_age: Time since the ball was seen [s].
    """

    fallen: bool
    pose: Pose2D
    ball: tuple[float, float] | None = None
    ball_age: float = 0.0


@dataclass(frozen=True)
class Reply:
    """What a robot sends back.

    Attributes:
        team: Team number.
        player: Player number, from 1 on.
        message: See `ReplyMessage`.
        version: Of the reply.
        status: Of the robot; reply 4 needs it, the others do not carry it.
    """

    team: int
    player: int
    message: ReplyMessage = ReplyMessage.ALIVE
    version: int = 1
    status: RobotStatus | None = None


def encode_reply(reply: Reply) -> bytes:
    """Write a reply.

    Raises:
        ValueError: if the version is not known, a number does not fit its field, or the status is missing.
    """
    if reply.version not in _REPLIES:
        raise ValueError(f"reply version is {reply.version}; expected one of: {', '.join(map(str, _REPLIES))}")
    layout = _REPLIES[reply.version]
    try:
        if reply.version != STATUS_VERSION:
            return layout.pack(REPLY_MAGIC, reply.version, reply.team, reply.player, int(reply.message))
        status = reply.status
        if status is None:
            raise ValueError(f"reply {reply.version} has no status; expected whether the robot is fallen, and where")
        pose = (status.pose.x * _MILLIMETRES, status.pose.y * _MILLIMETRES, status.pose.yaw)
        ball = (0.0, 0.0) if status.ball is None else status.ball
        return layout.pack(
            REPLY_MAGIC,
            reply.version,
            reply.player,  # before the team, other than in replies 1 and 2
            reply.team,
            int(status.fallen),
            *pose,
            _NEVER if status.ball is None else status.ball_age,
            ball[0] * _MILLIMETRES,
            ball[1] * _MILLIMETRES,
        )
    except (struct.error, OverflowError) as error:
        raise ValueError(f"reply does not fit its fields: {error}") from error


def decode_reply(data: bytes) -> Reply | Rejected:
    """Read a reply; any bytes are allowed, none raises."""
    if len(data) < _PREFIX:
        return Rejected(Fault.SIZE, f"reply is {len(data)} bytes long; expected at least {_PREFIX}")
    if data[:4] != REPLY_MAGIC:
        return Rejected(Fault.MAGIC, f"reply begins with {data[:4]!r}; expected {REPLY_MAGIC!r}")
    layout = _REPLIES.get(data[4])
    if layout is None:
        return _unknown_version(data[4])
    if len(data) != layout.size:
        return Rejected(Fault.SIZE, f"reply of version {data[4]} is {len(data)} bytes long; expected {layout.size}")
    _, version, *values = layout.unpack(data)
    if version not in _REPLIES:  # a field of four bytes in reply 1
        return _unknown_version(version)
    return _read_status(values) if version == STATUS_VERSION else _read_plain(version, values)


def _read_plain(version: int, values: list[int]) -> Reply | Rejected:
    team, player, message = values
    if message not in tuple(ReplyMessage):
        return Rejected(Fault.STATE, f"reply message is {message}; expected 0 to {max(ReplyMessage).value}")
    return Reply(team, player, ReplyMessage(message), version)


def _read_status(values: list[float]) -> Reply | Rejected:
    player, team, fallen, x, y, yaw, ball_age, ball_x, ball_y = values
    if fallen not in (0, 1):
        return Rejected(Fault.STATE, f"fallen is {fallen}; expected 0 or 1")
    if not all(math.isfinite(value) for value in values):
        return Rejected(Fault.STATE, "a pose or a ball is not a finite number")
    seen = ball_age >= 0.0
    status = RobotStatus(
        fallen == 1,
        Pose2D(x / _MILLIMETRES, y / _MILLIMETRES, yaw),
        (ball_x / _MILLIMETRES, ball_y / _MILLIMETRES) if seen else None,
        ball_age if seen else 0.0,
    )
    return Reply(int(team), int(player), ReplyMessage.ALIVE, STATUS_VERSION, status)


def _unknown_version(version: int) -> Rejected:
    known = ", ".join(map(str, _REPLIES))
    return Rejected(Fault.VERSION, f"reply version is {version}; expected one of: {known}")
