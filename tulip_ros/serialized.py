"""Reads a time from a serialized message without decoding the rest (CDR, either byte order)."""

from __future__ import annotations

from struct import Struct

from tulip_ros.time import NANOSECONDS

HEADER = 4
"""[B] Place of the header with which a message begins, after what tells the encoding."""
LITTLE, BIG = Struct("<iI"), Struct(">iI")


def time_at(data: bytes, place: int = HEADER) -> int:
    """Return the time [ns] at a place of a serialized message: the stamp, where it begins with a header."""
    seconds, nanoseconds = _order(data).unpack_from(data, place)
    return int(seconds) * NANOSECONDS + int(nanoseconds)


def after_header(data: bytes) -> int:
    """Return the place of what follows the header with which a serialized message begins, at a multiple of 4."""
    _, length = _order(data).unpack_from(data, HEADER + 4)
    return HEADER + 12 + (int(length) + 3) // 4 * 4


def _order(data: bytes) -> Struct:
    return LITTLE if data[1] & 1 else BIG
