"""Reads a time from a serialized message without decoding the rest (CDR, either byte order)."""

from __future__ import annotations

from struct import Struct, error

from tulip_ros.time import NANOSECONDS

HEADER = 4
"""[B] Place of the header with which a message begins, after what tells the encoding."""
LITTLE, BIG = Struct("<iI"), Struct(">iI")


def time_at(data: bytes, place: int = HEADER) -> int:
    """Return the time [ns] at a place of a serialized message: the stamp, where it begins with a header.

    Raises:
        ValueError: if the message ends before.
    """
    seconds, nanoseconds = _two(data, place)
    return seconds * NANOSECONDS + nanoseconds


def after_header(data: bytes) -> int:
    """Return the place of what follows the header with which a serialized message begins, at a multiple of 4.

    Raises:
        ValueError: if the message ends before.
    """
    _, length = _two(data, HEADER + 4)
    return HEADER + 12 + (length + 3) // 4 * 4


def _two(data: bytes, place: int) -> tuple[int, int]:
    try:
        first, second = (LITTLE if data[1] & 1 else BIG).unpack_from(data, place)
    except (error, IndexError):
        raise ValueError(f"a message ends after {len(data)} bytes; expected a time or a length at {place}") from None
    return int(first), int(second)
