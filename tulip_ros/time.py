"""Stamps: integer nanoseconds in the cores, builtin_interfaces/Time in messages.

Nodes take stamps from the messages that they answer; none of them reads a clock.
"""

from __future__ import annotations

from builtin_interfaces.msg import Time
from std_msgs.msg import Header

NANOSECONDS = 1_000_000_000
"""In one second."""


def to_message(stamp: int) -> Time:
    """Return a stamp [ns] as a message.

    Raises:
        ValueError: if the stamp does not fit: negative, or later than the year 2038.
    """
    seconds, nanoseconds = divmod(stamp, NANOSECONDS)
    if not 0 <= seconds < 2**31:
        raise ValueError(f"stamp is {stamp} ns; expected 0 or more and less than 2^31 s")
    return Time(sec=seconds, nanosec=nanoseconds)


def from_message(time: Time) -> int:
    """Return a message's stamp [ns]."""
    return int(time.sec) * NANOSECONDS + int(time.nanosec)


def header(stamp: int, frame: str = "") -> Header:
    """Return a header with a stamp [ns] and the frame that the data is in."""
    return Header(stamp=to_message(stamp), frame_id=frame)


def stamp_of(message: object) -> int:
    """Return the stamp [ns] in a message's header."""
    return from_message(message.header.stamp)  # type: ignore[attr-defined]
