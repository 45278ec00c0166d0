"""gait.yaml: the part of motion's parameters that the gait tuner owns.

The file is a ROS 2 parameter file of node motion, so it can be passed to the node as well; `MotionParameters` takes
its defaults of exactly these fields from it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from tulip_description.yaml_file import read_yaml, write_lines

PATH = Path(__file__).with_name("gait.yaml")
NODE, KEY = "motion", "ros__parameters"


class GaitFileError(ValueError):
    """A gait file cannot be used; the message says which and why."""


class GaitFile:
    """The values of a gait file, and which of them were asked for.

    Attributes:
        path: Of the file.
        values: Its numbers by name.
    """

    def __init__(self, path: Path = PATH) -> None:
        """Read a file.

        Raises:
            GaitFileError: if it cannot be read, or is not a parameter file of node motion with numbers only.
        """
        self.path = path
        self.values = read_gait(path)
        self._asked: set[str] = set()

    def value(self, name: str) -> float:
        """Return a parameter.

        Raises:
            GaitFileError: if the file does not have it.
        """
        if name not in self.values:
            raise GaitFileError(f"{self.path} lacks {name}; expected a number for it below {NODE}: {KEY}:")
        self._asked.add(name)
        return self.values[name]

    def check_complete(self) -> None:
        """Check that nothing else is in the file than what was asked for.

        Raises:
            GaitFileError: if there is.
        """
        unknown = sorted(set(self.values) - self._asked)
        if unknown:
            raise GaitFileError(
                f"{self.path} has {', '.join(unknown)}, which motion does not take from it;"
                f" expected only {', '.join(sorted(self._asked))}"
            )


def read_gait(path: Path) -> dict[str, float]:
    """Return the numbers of a gait file by name.

    Raises:
        GaitFileError: if it cannot be read, or is not a parameter file of node motion with numbers only.
    """
    content = read_yaml(path, GaitFileError)
    try:
        values = content[NODE][KEY]
        items = list(values.items())
    except (TypeError, KeyError, AttributeError):
        raise GaitFileError(
            f"{path} is not a parameter file of node {NODE}; expected {NODE}: {KEY}: name: number"
        ) from None
    for name, value in items:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise GaitFileError(f"{path}: {name} is {value!r}; expected a finite number")
    return {str(name): float(value) for name, value in items}


def write_gait(path: Path, values: Mapping[str, float], provenance: Sequence[str]) -> None:
    """Write a gait file, all or nothing.

    Args:
        path: The file.
        values: The numbers by name.
        provenance: Lines that say where they come from.

    Raises:
        OSError: if the file cannot be written.
    """
    lines = [
        "# The tuned part of motion's parameters: a ROS 2 parameter file, and the defaults of these fields of",
        "# MotionParameters (tulip_motion/parameters.py), where units and meanings stand. Written by scripts/tune.py.",
        *(f"# {line}".rstrip() for line in provenance),
        f"{NODE}:",
        f"  {KEY}:",
        *(f"    {name}: {float(value)!r}" for name, value in values.items()),
    ]
    write_lines(path, lines)
