"""Parameters of a core (a frozen dataclass) as ROS parameters of its node.

Every field becomes a read-only parameter of the same name; fields that are dataclasses themselves become a
prefix ("gait.step_time"). Rows of equal length in a tuple of tuples become one flat array.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any, TypeVar

import numpy as np
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from tulip_ros.errors import BadInputError, unknown

P = TypeVar("P")

ROS_NAMES = frozenset({"use_sim_time", "start_type_description_service"})
"""Parameters that every rclpy node has."""


def flatten(parameters: Any, prefix: str = "") -> dict[str, Any]:
    """Return the fields of a dataclass object by dotted name, with the values that they have.

    Args:
        parameters: Object of a dataclass.
        prefix: Put before each name.
    """
    return {name: value for name, _, value in _walk(parameters, prefix)}


def plain(parameters: Any, prefix: str = "") -> dict[str, Any]:
    """Return the fields of a dataclass object by dotted name, as parameter files hold them.

    Args:
        parameters: Object of a dataclass.
        prefix: Put before each name.
    """
    return {name: _to_ros(value) for name, value in flatten(parameters, prefix).items()}


def replace(parameters: P, overrides: Mapping[str, Any], node: str) -> P:
    """Return the parameters with some values replaced.

    Args:
        parameters: Object of a frozen dataclass, with the defaults.
        overrides: New values by dotted name, of the types that YAML gives.
        node: Name of the node, for messages.

    Raises:
        BadInputError: for an unknown name, a value of the wrong type, or one that the dataclass refuses.
    """
    known = flatten(parameters)
    for name, value in overrides.items():
        if name not in known:
            raise unknown(f"parameter of node {node!r} called", name, known)
        _check(f"{node}.{name}", known[name], value)
    try:
        return _rebuild(parameters, overrides, "")
    except ValueError as error:
        raise BadInputError(f"Parameters of node {node!r}: {error}") from error


def declare(node: Node, parameters: P) -> P:
    """Declare every field as a parameter of the node and return the parameters with the node's overrides applied.

    Args:
        node: The node, made with the overrides of the command line and of parameter files.
        parameters: Object of a frozen dataclass, with the defaults.

    Raises:
        BadInputError: as `replace`.
    """
    given = {name: parameter.value for name, parameter in node._parameter_overrides.items() if name not in ROS_NAMES}
    given = {name: value for name, value in given.items() if not name.startswith("qos_overrides.")}
    result = replace(parameters, given, node.get_name())
    descriptor = ParameterDescriptor(read_only=True, dynamic_typing=True, description=type(parameters).__name__)
    for name, value in flatten(result).items():
        node.declare_parameter(name, _to_ros(value), descriptor, ignore_override=True)
    return result


def _walk(parameters: Any, prefix: str) -> Iterator[tuple[str, Any, Any]]:
    for field in dataclasses.fields(parameters):
        if not field.init:
            continue
        value = getattr(parameters, field.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            yield from _walk(value, f"{prefix}{field.name}.")
        else:
            yield f"{prefix}{field.name}", field, value


def _rebuild(parameters: Any, overrides: Mapping[str, Any], prefix: str) -> Any:
    changes: dict[str, Any] = {}
    for field in dataclasses.fields(parameters):
        if not field.init:
            continue
        name, value = f"{prefix}{field.name}", getattr(parameters, field.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            if any(key.startswith(f"{name}.") for key in overrides):
                changes[field.name] = _rebuild(value, overrides, f"{name}.")
        elif name in overrides:
            changes[field.name] = _from_ros(value, overrides[name])
    return dataclasses.replace(parameters, **changes) if changes else parameters


def _check(name: str, default: Any, value: Any) -> None:
    if isinstance(default, bool):
        fits, expected = isinstance(value, bool), "true or false"
    elif isinstance(default, Enum):
        fits, expected = (
            value in [member.name.lower() for member in type(default)],
            "one of " + ", ".join(member.name.lower() for member in type(default)),
        )
    elif isinstance(default, int):
        fits, expected = isinstance(value, int) and not isinstance(value, bool), "an integer"
    elif isinstance(default, float):
        fits, expected = _is_number(value), "a number"
    elif isinstance(default, str):
        fits, expected = isinstance(value, str), "text"
    elif isinstance(default, tuple | list | np.ndarray):
        fits, expected = _sequence_fits(default, value)
    else:  # None by default: whatever the dataclass accepts
        return
    if not fits:
        raise BadInputError(f"Parameter {name} is {value!r}; expected {expected}, as in {_to_ros(default)!r}.")


def _sequence_fits(default: Any, value: Any) -> tuple[bool, str]:
    flat = _plain(default)
    is_list = isinstance(value, list | tuple) or hasattr(value, "tolist")
    if not flat:  # the default does not tell what it is a list of
        return is_list, "a list"
    if isinstance(flat[0], str):
        return is_list and all(isinstance(item, str) for item in value), "a list of texts"
    numbers = is_list and all(map(_is_number, value))
    if _is_nested(default):
        width = len(default[0])
        return numbers and len(value) % width == 0, f"a flat list of numbers, {width} a row"
    return numbers, "a list of numbers"


def _is_number(value: Any) -> bool:
    # NaN passes nearly every check of a range, and then stays in whatever is computed from it.
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)


def _is_nested(value: Any) -> bool:
    return isinstance(value, tuple | list) and len(value) > 0 and isinstance(value[0], tuple | list)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    if _is_nested(value):
        return [item for row in value for item in row]
    return list(value) if isinstance(value, tuple) else value


def _to_ros(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.name.lower()
    plain = _plain(value)
    if isinstance(plain, list) and any(isinstance(item, float) for item in plain):
        return [float(item) for item in plain]
    return plain


def _from_ros(default: Any, value: Any) -> Any:
    if isinstance(default, Enum):
        return type(default)[value.upper()]
    if isinstance(default, bool | str) or default is None:
        return value
    if isinstance(default, int | float):
        return type(default)(value)
    if isinstance(default, np.ndarray):
        return np.asarray(list(value), dtype=default.dtype).reshape((-1, *default.shape[1:]))
    items = [float(item) if _holds_floats(default) else item for item in value]
    if _is_nested(default):
        width = len(default[0])
        rows = [tuple(items[start : start + width]) for start in range(0, len(items), width)]
        return type(default)(rows)
    return type(default)(items)


def _holds_floats(default: Any) -> bool:
    return any(isinstance(item, float) for item in _plain(default))
