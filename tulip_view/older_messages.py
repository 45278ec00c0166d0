"""Messages of a recording that was made with other definitions of their types than those installed here."""

from __future__ import annotations

from typing import Any

from tulip_ros.message_text import field_names

PLACES = 6
"""More fields that could not be taken over than this are not named one by one."""


def installed(message: Any, kind: type[Any], lacking: set[str]) -> Any:
    """Return a message as an object of the installed class: each field that both have, defaults for the others.

    Args:
        message: As decoded by the recording's own definition.
        kind: The class installed here.
        lacking: Gets the names of the fields that could not be taken over, as in "ball.age".
    """
    return message if isinstance(message, kind) else _fitted(message, kind(), lacking, "")


def told(lacking: set[str]) -> str:
    """Return fields in words."""
    names = sorted(lacking)
    return ", ".join(names[:PLACES]) + (f" and {len(names) - PLACES} more" if len(names) > PLACES else "")


def _fitted(message: Any, new: Any, lacking: set[str], place: str) -> Any:
    for name in field_names(new):
        default = getattr(new, name)
        try:
            value = getattr(message, name)
            if field_names(default):
                value = _fitted(value, default, lacking, f"{place}{name}.")
            elif isinstance(value, list) and value and field_names(value[0]):
                element = _element(new, name)
                value = [_fitted(each, element(), lacking, f"{place}{name}.") for each in value]
            setattr(new, name, value)
        except (AttributeError, AssertionError, TypeError, ValueError, LookupError, OverflowError):
            # Not there, or of another type or length: the setters of messages check that.
            lacking.add(place + name)
    return new


def _element(message: Any, name: str) -> type[Any]:
    """Return the class of a sequence's elements."""
    from tulip_ros import schemas

    words = message.get_fields_and_field_types()[name]  # as in sequence<tulip_msgs/Opponent, 8>, geometry_msgs/Point[3]
    package, element = words.removeprefix("sequence<").split("[")[0].split(",")[0].rstrip(">").split("/")
    found: type[Any] = schemas.message_class(f"{package}/msg/{element}")
    return found
