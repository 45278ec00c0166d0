"""YAML that anybody may have written: safe types alone, no deeper and no larger than a file of settings ever is.

A text of a few lines can stand for gigabytes (aliases of aliases) or end the process (the library's fast loader calls
itself for each level). So its events are looked through first, one after the other, before anything is made of them.
"""

from __future__ import annotations

import re
from typing import Any

import yaml

LARGEST = 2**21  # [B] of a file; a robot's parameters take some 10 kB
DEEPEST = 50  # levels; our own files have 6
MOST = 2**22  # characters and values, once each alias is replaced by what it stands for
INTEGERS = range(-(2**63), 2**64)
"""What a number of 64 bits can be, with or without a sign. Larger ones have no use here, and no float takes them."""
MERGE = "<<"
"""The key that takes over the entries of other mappings; it may stand more than once."""

_SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where its library is there


class _Loader(_SafeLoader):  # type: ignore[misc]  # one of two, the library's choice
    """Reads 1e-3 as a number, as ROS does (YAML 1.1 alone wants 1.0e-3)."""

    def construct_yaml_int(self, node: Any) -> int:
        value: int = super().construct_yaml_int(node)
        if value not in INTEGERS:
            raise _refusal("found a number of more than 64 bits", node)
        return value


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_yaml_int)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+$"), list("-+.0123456789")
)


def load_yaml(text: str | bytes) -> Any:
    """Return the content of a YAML text.

    Raises:
        yaml.YAMLError: if it is none, is larger or deeper than LARGEST, DEEPEST and MOST allow, or names a key twice.
    """
    if len(text) > LARGEST:
        raise yaml.YAMLError(f"it is {len(text)} characters long; expected at most {LARGEST}")
    _check(text)
    try:
        return yaml.load(text, _Loader)
    except (ValueError, ArithmeticError, LookupError, AttributeError, TypeError) as error:
        # As for 2013-99-99, !!int x or !!timestamp x: the library does not check what it converts.
        raise yaml.YAMLError(f"a value cannot be what it seems or is said to be: {error}") from error


class _Collection:
    """A list or a mapping that is not ended yet."""

    def __init__(self, event: Any, total: int) -> None:
        self.anchor: str | None = event.anchor
        self.before = total
        self.keys: set[str] | None = set() if isinstance(event, yaml.MappingStartEvent) else None
        self.entries = 0

    def take(self, event: Any) -> None:
        """Take an entry: of a mapping in turn a key and its value."""
        self.entries += 1
        if self.keys is None or self.entries % 2 == 0 or not isinstance(event, yaml.ScalarEvent):
            return
        if event.value in self.keys and event.value != MERGE:
            raise _refusal(f"found key {event.value[:100]!r} a second time", event)
        self.keys.add(event.value)


def _check(text: str | bytes) -> None:
    """Raise YAMLError for what is too deep, too large once it is unfolded, or says something twice."""
    total = 0
    sizes: dict[str, int] = {}  # of what each alias stands for
    within: list[_Collection] = []
    for event in yaml.parse(text, _SafeLoader):
        if within and isinstance(event, yaml.NodeEvent):
            within[-1].take(event)
        if isinstance(event, yaml.CollectionStartEvent):
            within.append(_Collection(event, total))
            total += 1
            if len(within) > DEEPEST:
                raise _refusal(f"found more than {DEEPEST} levels", event)
        elif isinstance(event, yaml.CollectionEndEvent):
            ended = within.pop()
            if ended.anchor is not None:
                sizes[ended.anchor] = total - ended.before
        elif isinstance(event, yaml.ScalarEvent):
            total += 1 + len(event.value)
            if event.anchor is not None:
                sizes[event.anchor] = 1 + len(event.value)
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise _refusal(f"found alias {event.anchor!r} of nothing, or of what it is a part of", event)
            total += sizes[event.anchor]
        if total > MOST:
            raise _refusal(f"found more than {MOST} characters once aliases are replaced", event)


def _refusal(problem: str, place: Any) -> yaml.MarkedYAMLError:
    """Return the error for what is wrong with an event or a node."""
    return yaml.MarkedYAMLError(problem=problem, problem_mark=place.start_mark)
