"""Messages as plain values, for people and for JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tulip_ros.errors import BadInputError, unknown

LONGEST_BYTES = 64
"""Longer runs of bytes (pictures) are told by their length alone."""


def to_plain(value: Any) -> Any:
    """Return a message, or a part of one, as dicts, lists, numbers and strings."""
    if isinstance(value, bool | int | str) or value is None:
        return value
    if isinstance(value, float):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, bytes | bytearray | memoryview) or getattr(value, "typecode", "") == "B":
        data = bytes(value)
        return list(data) if len(data) <= LONGEST_BYTES else f"<{len(data)} bytes>"
    if isinstance(value, np.ndarray):
        return value.tolist()
    names = field_names(value)
    if names:
        return {name: to_plain(getattr(value, name)) for name in names}
    return [to_plain(each) for each in value]


def field_names(message: Any) -> tuple[str, ...]:
    """Return the names of a message's fields; none for anything else."""
    if hasattr(message, "get_fields_and_field_types"):
        return tuple(message.get_fields_and_field_types())
    # A type that is not installed: mcap's own decoder makes an object with just these attributes.
    return tuple(getattr(message, "__slots__", ())) if not hasattr(message, "__iter__") else ()


def without_nan(value: Any) -> Any:
    """Return plain values with None in place of what JSON does not have: NaN and infinity."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: without_nan(each) for key, each in value.items()}
    return [without_nan(each) for each in value] if isinstance(value, list) else value


def select(message: Any, fields: Sequence[str]) -> dict[str, Any]:
    """Return some fields of a message as plain values.

    Args:
        message: The message.
        fields: As in "header.stamp", "robot_pose", "ball.position" or "robot_pose.0"; none means all of them.

    Raises:
        BadInputError: if it has no such field.
    """
    if not fields:
        plain = to_plain(message)
        return plain if isinstance(plain, dict) else {"value": plain}
    return {field: to_plain(_reach(message, field)) for field in fields}


def _reach(message: Any, path: str) -> Any:
    value = message
    for name in path.split("."):
        names = field_names(value)
        if name in names:
            value = getattr(value, name)
        elif not names and name.isdigit() and hasattr(value, "__getitem__"):
            if int(name) >= len(value):
                raise BadInputError(f"Field {path!r}: there are {len(value)} elements; expected an index below that.")
            value = value[int(name)]
        else:
            raise unknown(f"field {path!r} of {type(message).__name__}, at", name, names)
    return value
