"""Serialized messages (CDR): equal but for the bytes that mean nothing.

Numbers are aligned to their size, and the serializer leaves in the gaps, and behind the end, whatever was in its buffer
before. The middleware fills up to a multiple of four bytes as well. So two messages can only be compared byte by byte
once the gaps are cleared and the end is cut.
"""

from __future__ import annotations

import re
from functools import cache
from struct import Struct, error

from tulip_ros import schemas

HEAD = 4  # [B] before the data, which tell their byte order; alignment counts from their end
SIZES = {
    **dict.fromkeys(("boolean", "octet", "char", "int8", "uint8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float"), 4),
    **dict.fromkeys(("int64", "uint64", "double"), 8),
}
"""[B] of numbers, as generated classes name them; each is aligned to its size."""
FIXED, STRING, NUMBERS, MESSAGES = range(4)
ARRAY = re.compile(r"(.+)\[(\d+)\]$")
SEQUENCE = re.compile(r"sequence<(.+?)(?:, \d+)?>$")

Step = tuple[int, int, int, "tuple[Step, ...]"]
"""What comes next: kind, alignment, size [B] (of one element for a sequence), and the steps of one element."""


def without_gaps(type_name: str, data: bytes) -> bytes:
    """Return a serialized message with zeros in its gaps, and without what fills it up behind its end.

    Args:
        type_name: As in "nav_msgs/msg/Odometry".
        data: Serialized by the definition that is installed.

    Raises:
        LookupError: if the type is not installed, or holds what is not known here (wide strings, long doubles).
        ValueError: if the data end too early.
    """
    steps, cleared = steps_of(type_name), bytearray(data)
    try:
        end = _clear(steps, data, cleared, 0, _LITTLE if data[1] & 1 else _BIG)
    except (error, IndexError):
        raise ValueError(f"{len(data)} bytes are no {type_name}: they end too early") from None
    if end + HEAD > len(data):
        raise ValueError(f"{len(data)} bytes are no {type_name}; expected at least {end + HEAD}")
    return bytes(cleared[: end + HEAD])


_LITTLE, _BIG = Struct("<I"), Struct(">I")


def _clear(steps: tuple[Step, ...], data: bytes, cleared: bytearray, place: int, number: Struct) -> int:
    """Clear the gaps from a place on and return where the message ends."""
    for kind, alignment, size, inner in steps:
        place = _over_gap(cleared, place, alignment)
        if kind == FIXED:
            place += size
            continue
        (count,) = number.unpack_from(data, HEAD + place)
        place += 4
        if kind == STRING:
            place += count
        elif kind == NUMBERS:
            if count:
                place = _over_gap(cleared, place, size) + count * size
        else:
            for _ in range(count):
                place = _clear(inner, data, cleared, place, number)
    return place


def _over_gap(cleared: bytearray, place: int, alignment: int) -> int:
    """Clear what lies before the next multiple of an alignment, and return that place.

    Raises:
        IndexError: if it lies behind the end: a count that is damaged would lead on and on.
    """
    end = place + -place % alignment
    if HEAD + end > len(cleared):
        raise IndexError(f"byte {end} lies behind the end")
    cleared[HEAD + place : HEAD + end] = bytes(end - place)
    return end


@cache
def steps_of(type_name: str) -> tuple[Step, ...]:
    """Return how a message type is laid out.

    Raises:
        LookupError: as `without_gaps`.
    """
    steps: list[Step] = []
    for kind in schemas.message_class(type_name).get_fields_and_field_types().values():
        steps += _steps(kind)
    merged: list[Step] = []
    for step in steps:
        if merged and step[0] == merged[-1][0] == FIXED and step[1] == merged[-1][1]:
            merged[-1] = (FIXED, step[1], merged[-1][2] + step[2], ())
        else:
            merged.append(step)
    return tuple(merged)


def _steps(kind: str) -> list[Step]:
    if array := ARRAY.match(kind):
        return _steps(array[1]) * int(array[2])
    if sequence := SEQUENCE.match(kind):
        inner = tuple(_steps(sequence[1]))
        if sequence[1] in SIZES:
            return [(NUMBERS, 4, SIZES[sequence[1]], ())]
        return [(MESSAGES, 4, 0, inner)]
    if kind in SIZES:
        return [(FIXED, SIZES[kind], SIZES[kind], ())]
    if kind.split("<")[0] == "string":
        return [(STRING, 4, 0, ())]
    if "/" not in kind:
        raise LookupError(f"fields of type {kind} are not known; expected numbers, strings and messages")
    package, name = kind.split("/")
    return list(steps_of(f"{package}/msg/{name}"))
