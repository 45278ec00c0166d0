"""Message classes and their definitions in text, by the name of the type."""

from __future__ import annotations

import importlib
import os
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

PRIMITIVE = re.compile(r"(bool|byte|char|float32|float64|u?int(8|16|32|64)|w?string)(<=\d+)?$")
NAME = re.compile(r"([a-z][a-z0-9_]{0,99})/(msg|srv|action)/([A-Z][A-Za-z0-9_]{0,99})")
"""What a type can be called. Names come from recordings and from the graph: no other is looked for."""
ARRAY = re.compile(r"\[[^\]]*\]$")
SEPARATOR = "=" * 80 + "\n"


@cache
def message_class(type_name: str) -> type[Any]:
    """Return the class of a message type.

    Args:
        type_name: As in "sensor_msgs/msg/Image".

    Raises:
        LookupError: if the type is not installed.
    """
    package, kind, name = _parts(type_name)
    _text(type_name)  # a module of another kind is not even imported
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), name)
    except (ImportError, AttributeError) as error:
        raise LookupError(f"message type {type_name} is not installed; install the ROS package {package}") from error


@cache
def definition(type_name: str) -> str:
    """Return a message type's definition followed by those of all types in it, as recordings hold it (ros2msg).

    Raises:
        LookupError: if the text of a definition is not installed.
    """
    return _with_parts(_text(type_name), type_name)


@cache
def service_definitions(type_name: str) -> tuple[str, str]:
    """Return the definitions of a service's request and response, each as `definition` returns a message's.

    Args:
        type_name: As in "std_srvs/srv/Trigger".

    Raises:
        LookupError: if the text of a definition is not installed.
    """
    request, _, response = _text(type_name).partition("---\n")
    return _with_parts(request, type_name), _with_parts(response, type_name)


def _with_parts(text: str, type_name: str) -> str:
    parts, seen, waiting = [text], {type_name}, _parts_of(text, type_name)
    while waiting:
        part = waiting.pop(0)
        if part in seen:
            continue
        seen.add(part)
        package, _, name = part.split("/")
        text = _text(part)
        parts.append(f"{SEPARATOR}MSG: {package}/{name}\n{text}")
        waiting += _parts_of(text, part)
    return "".join(parts)


def _text(type_name: str) -> str:
    prefixes = [*filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)), sys.prefix]
    package, kind, name = _parts(type_name)
    for prefix in prefixes:
        path = Path(prefix) / "share" / package / kind / f"{name}.{kind}"
        if path.exists():
            text = path.read_text()
            return text if text.endswith("\n") else text + "\n"
    raise LookupError(f"the definition of {type_name} is not installed below {' or '.join(prefixes)}")


def _parts(type_name: str) -> tuple[str, str, str]:
    found = NAME.fullmatch(type_name)
    if found is None:
        raise LookupError(f"there can be no type {type_name[:100]!r}; expected a name as in sensor_msgs/msg/Image")
    return found[1], found[2], found[3]


def _parts_of(text: str, type_name: str) -> list[str]:
    """Return the types of the fields that are messages themselves."""
    package = type_name.split("/")[0]
    parts = []
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if len(words) < 2 or "=" in words[1]:  # no field, or a constant
            continue
        field_type = ARRAY.sub("", words[0])
        if PRIMITIVE.match(field_type):
            continue
        *owner, name = field_type.split("/")
        parts.append(f"{owner[0] if owner else package}/msg/{name}")
    return parts
