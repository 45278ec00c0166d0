"""What all formats have in common: names of the parts, and which robots can be written."""

from __future__ import annotations

from collections.abc import Iterable

from tulip_description.pseudo_inertia import why_impossible
from tulip_description.robot import Robot

ROBOT, FIELD, BALL = "robot", "field", "ball"
PARTS = (ROBOT, FIELD, BALL)
"""What each format has one file of."""
WORLD = "world"
"""The file that holds all parts together."""


class ExportError(ValueError):
    """Something cannot be exported; the message says what and what to do."""


def check_realizable(robot: Robot, form: str) -> None:
    """Refuse a robot that a physics engine would not load.

    Args:
        robot: To be written.
        form: Name of the format, for the message.

    Raises:
        ExportError: if a link's inertia belongs to no body.
    """
    bad = [link.name for link in robot.links if why_impossible(link.mass, link.com, link.inertia)]
    if bad:
        raise ExportError(
            f"inertias of {', '.join(bad)} (variant {robot.variant}) belong to no body, and no program that reads"
            f" {form} takes them; expected the playing variant, or urdf alone"
        )


def check_parts(parts: Iterable[str]) -> tuple[str, ...]:
    """Return parts in their order.

    Raises:
        ExportError: if one is unknown or there is none.
    """
    found = tuple(parts)
    if not found or not set(found) <= set(PARTS):
        raise ExportError(f"parts are {', '.join(found) or 'none'}; expected some of {', '.join(PARTS)}")
    return tuple(part for part in PARTS if part in found)
