"""Packets of the wire: a header, CAN-like frames of an identifier and eight bytes, a checksum. docs/wire.md."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

VERSION = 1
SYNC = b"TU"
HEADER = struct.Struct("<2sBBIQB")
"""Sync, version, kind, sequence, stamp [ns], number of frames; little endian, as all of it."""
CHECKSUM = struct.Struct("<I")
FRAME = np.dtype([("id", "<u2"), ("data", "<i2", 4)])
"""A frame: identifier and four numbers of 16 bits, which the identifier gives a meaning."""
LONGEST = HEADER.size + 255 * FRAME.itemsize + CHECKSUM.size
"""[B] of a packet."""

Frames = NDArray[Any]


class Kind(IntEnum):
    """What a packet is."""

    HELLO = 1
    """From the driver: who is there? From now on it is this driver that the body obeys and sends readings to."""
    IDENTITY = 2
    """From the body, to a hello."""
    COMMAND = 3
    """From the driver: frames for the joints that it names."""
    READING = 4
    """From the body: frames of all sensors."""
    STOP = 5
    """From the driver: no torque at any joint, at once."""


class WireError(ValueError):
    """Bytes that are no packet, or a packet that is not what was expected."""


class VersionError(WireError):
    """A packet of another version of the wire."""


@dataclass(frozen=True)
class Packet:
    """One packet.

    Attributes:
        kind: What it is.
        sequence: Grows by one with each packet of one sender; 32 bits.
        stamp: On the body's clock [ns]: of a reading, when it was measured; of a command, of the reading it answers.
        frames: (k,) of dtype FRAME.
    """

    kind: Kind
    sequence: int
    stamp: int = 0
    frames: Frames = field(default_factory=lambda: np.zeros(0, FRAME))


def encode(packet: Packet) -> bytes:
    """Return a packet's bytes.

    Raises:
        ValueError: if it has more than 255 frames.
    """
    if len(packet.frames) > 255:
        raise ValueError(f"packet has {len(packet.frames)} frames; expected 255 at most")
    sequence = packet.sequence & 0xFFFFFFFF
    body = HEADER.pack(SYNC, VERSION, packet.kind, sequence, packet.stamp, len(packet.frames))
    body += packet.frames.astype(FRAME, copy=False).tobytes()
    return body + CHECKSUM.pack(zlib.crc32(body))


def decode(data: bytes) -> Packet:
    """Return the packet of exactly these bytes.

    Raises:
        VersionError: if it is of another version.
        WireError: if they are no packet.
    """
    if len(data) < HEADER.size + CHECKSUM.size:
        raise WireError(f"packet is {len(data)} bytes long; expected {HEADER.size + CHECKSUM.size} or more")
    sync, version, kind, sequence, stamp, count = HEADER.unpack_from(data)
    if sync != SYNC:
        raise WireError(f"packet begins with {sync!r}; expected {SYNC!r}")
    if version != VERSION:  # before the length: another version may have longer frames
        raise VersionError(f"packet is of version {version} of the wire; expected {VERSION}")
    length = HEADER.size + count * FRAME.itemsize + CHECKSUM.size
    if len(data) != length:
        raise WireError(f"packet is {len(data)} bytes long; expected {length} with its {count} frames")
    expected = zlib.crc32(data[: -CHECKSUM.size])
    if _checksum(data) != expected:
        raise WireError(f"checksum is {_checksum(data):08x}; expected {expected:08x}")
    if kind not in Kind.__members__.values():
        raise WireError(f"packet is of kind {kind}; expected one of {', '.join(str(int(each)) for each in Kind)}")
    return Packet(Kind(kind), sequence, stamp, np.frombuffer(data, FRAME, count, HEADER.size))


def _checksum(data: bytes) -> int:
    return int(CHECKSUM.unpack_from(data, len(data) - CHECKSUM.size)[0])


class Stream:
    """Finds packets in a stream of bytes, as a serial line gives them: in pieces, with noise in between."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self.skipped = 0
        """Bytes that belonged to no packet."""

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Take further bytes and yield whatever has a right checksum; `decode` tells whether it is a packet."""
        self._bytes += data
        while True:
            start = self._bytes.find(SYNC)
            noise = start if start >= 0 else max(len(self._bytes) - 1, 0)
            self._skip(noise)
            if len(self._bytes) < HEADER.size:
                return
            length = HEADER.size + self._bytes[HEADER.size - 1] * FRAME.itemsize + CHECKSUM.size
            if len(self._bytes) < length:
                return
            whole = bytes(self._bytes[:length])
            if _checksum(whole) == zlib.crc32(whole[: -CHECKSUM.size]):
                del self._bytes[:length]
                yield whole
            else:
                self._skip(1)  # a sync in the midst of noise: the next one may be right

    def _skip(self, count: int) -> None:
        del self._bytes[:count]
        self.skipped += count
