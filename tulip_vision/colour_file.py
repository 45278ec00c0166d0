"""colours.yaml: the boxes of the colour classes, the part of vision's parameters that belongs to a hall and its light.

The file is a ROS 2 parameter file of node vision, so it can be passed to the node as well; `SegmentationParameters`
takes its defaults of exactly these fields from it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tulip_description.yaml_file import read_yaml, write_lines

PATH = Path(__file__).with_name("colours.yaml")
NODE, KEY, PART = "vision", "ros__parameters", "segmentation"
CLASSES = ("green", "white", "orange", "yellow", "blue", "cyan", "magenta", "dark")
SIDES = ("hue", "saturation", "value")

Bounds = tuple[float, float]


class ColourFileError(ValueError):
    """A colour file cannot be used; the message says which and why."""


@dataclass(frozen=True)
class ColourFile:
    """What a colour file says.

    Attributes:
        boxes: Lower and upper bound of hue [deg], saturation and value, by class.
        reference_brightness: Value of the carpet for which the boxes are given, 0 to 1.
    """

    boxes: Mapping[str, Mapping[str, Bounds]]
    reference_brightness: float


def read_colours(path: Path = PATH) -> ColourFile:
    """Read a colour file.

    Raises:
        ColourFileError: if it cannot be read, or lacks a class or has something else.
    """
    content = read_yaml(path, ColourFileError)
    try:
        part = content[NODE][KEY][PART]
        brightness, colours = part["reference_brightness"], dict(part["colours"])
    except (TypeError, KeyError, ValueError):
        raise ColourFileError(
            f"{path} is no colour file; expected {NODE}: {KEY}: {PART}: with reference_brightness and colours"
        ) from None
    if set(colours) != set(CLASSES):
        raise ColourFileError(f"{path} has the colours {', '.join(map(str, colours))}; expected {', '.join(CLASSES)}")
    boxes = {name: _box(path, name, colours[name]) for name in CLASSES}
    reference = _number(path, "reference_brightness", brightness)
    if not 0.0 < reference <= 1.0:
        raise ColourFileError(f"{path}: reference_brightness is {reference}; expected above 0 to 1")
    return ColourFile(boxes, reference)


def write_colours(path: Path, colours: ColourFile, provenance: Sequence[str] = ()) -> None:
    """Write a colour file, all or nothing.

    Args:
        path: The file.
        colours: What to write.
        provenance: Lines that say where the numbers come from.

    Raises:
        OSError: if the file cannot be written.
    """
    lines = [
        "# The boxes of the colour classes: a ROS 2 parameter file of node vision, and the defaults of these fields of",
        "# SegmentationParameters (tulip_vision/segmentation.py), where units and meanings stand.",
        *(f"# {line}".rstrip() for line in provenance),
        f"{NODE}:",
        f"  {KEY}:",
        f"    {PART}:",
        f"      reference_brightness: {float(colours.reference_brightness)!r}",
        "      colours:",
    ]
    for name in CLASSES:
        sides = (f"{side}: [{low!r}, {high!r}]" for side, (low, high) in colours.boxes[name].items())
        lines.append(f"        {name}: {{{', '.join(sides)}}}")
    write_lines(path, lines)


def _box(path: Path, name: str, content: Any) -> dict[str, Bounds]:
    if not isinstance(content, dict) or set(content) != set(SIDES):
        raise ColourFileError(f"{path}: {name} is {content!r}; expected {', '.join(SIDES)}, each with two numbers")
    box = {}
    for side in SIDES:
        bounds = content[side]
        if not isinstance(bounds, list) or len(bounds) != 2:
            raise ColourFileError(f"{path}: {name}.{side} is {bounds!r}; expected two numbers")
        box[side] = (_number(path, f"{name}.{side}", bounds[0]), _number(path, f"{name}.{side}", bounds[1]))
    return box


def _number(path: Path, name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ColourFileError(f"{path}: {name} is {value!r}; expected a finite number")
    return float(value)
