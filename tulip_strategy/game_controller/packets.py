"""Bytes to packets and back, of all versions; byte 4 tells which."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum

from tulip_strategy.game_controller.layout import Packet
from tulip_strategy.game_controller.meaning import MEANINGS
from tulip_strategy.game_controller.versions import LAYOUTS

PACKET_MAGIC = b"RGme"
_PREFIX = 5  # bytes needed to know the version: the magic and byte 4


class Fault(Enum):
    """What is wrong with bytes that are no usable packet, in one word."""

    MAGIC = "magic"
    VERSION = "version"
    SIZE = "size"
    STATE = "state"
    TEAM = "team"


@dataclass(frozen=True)
class Rejected:
    """Bytes that are no usable packet or reply.

    Attributes:
        fault: What was wrong, in one word.
        reason: What was wrong and what was expected.
    """

    fault: Fault
    reason: str


def decode(data: bytes) -> Packet | Rejected:
    """Read a referee packet; any bytes are allowed, none raises."""
    if len(data) < _PREFIX:
        return Rejected(Fault.SIZE, f"packet is {len(data)} bytes long; expected at least {_PREFIX}")
    if data[:4] != PACKET_MAGIC:
        return Rejected(Fault.MAGIC, f"packet begins with {data[:4]!r}; expected {PACKET_MAGIC!r}")
    layout = LAYOUTS.get(data[4])
    if layout is None:
        return _unknown_version(data[4])
    if len(data) != layout.size:
        return Rejected(
            Fault.SIZE, f"packet of version {layout.version} is {len(data)} bytes long; expected {layout.size}"
        )
    packet = Packet(layout, layout.codec.unpack(data))
    if packet.version != layout.version:  # a field of two or four bytes
        return _unknown_version(packet.version)
    phases = MEANINGS[layout.version].phases
    if packet.state not in phases:
        return Rejected(Fault.STATE, f"game state is {packet.state}; expected 0 to {max(phases)}")
    return packet


def encode(packet: Packet) -> bytes:
    """Write a referee packet.

    Raises:
        ValueError: if a value does not fit its field.
    """
    try:
        return packet.layout.codec.pack(*packet.values)
    except struct.error as error:
        raise ValueError(f"packet does not fit version {packet.layout.version}: {error}") from error


def _unknown_version(version: int) -> Rejected:
    known = ", ".join(map(str, LAYOUTS))
    return Rejected(Fault.VERSION, f"referee protocol version is {version}; expected one of: {known}")
