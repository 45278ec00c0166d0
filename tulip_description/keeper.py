"""The goalkeeper figure: an upright, robot-like body of boxes that is seen by the camera and stops the ball.

Its frame, keeper, has its origin on the ground between the feet, x where it looks, y to the left, z up. All
measures are assumed: an AdultSize robot of about TUlip's size.
"""

from __future__ import annotations

from dataclasses import dataclass

TEAM_COLOURS = ("cyan", "magenta")
"""Colours of the team markers, by the rules of 2013."""


@dataclass(frozen=True)
class KeeperPart:
    """One box of the figure, with its edges along the axes of keeper.

    Attributes:
        name: What it is.
        centre: x, y, z of its middle in keeper [m].
        size: Its edges along x, y, z [m].
        colour: Name of its colour: black, grey or a team colour.
    """

    name: str
    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    colour: str


def keeper_parts(team_colour: str = "cyan") -> tuple[KeeperPart, ...]:
    """Return the boxes of the figure: 1.20 m high, 0.42 m wide, none inside another.

    Args:
        team_colour: Of the markers on upper arms and chest, cyan or magenta.

    Raises:
        ValueError: if the colour is another one.
    """
    if team_colour not in TEAM_COLOURS:
        raise ValueError(f"team_colour is {team_colour!r}; expected {' or '.join(TEAM_COLOURS)}")
    parts = [
        KeeperPart("trunk", (0.0, 0.0, 0.80), (0.15, 0.28, 0.40), "grey"),
        KeeperPart("chest_marker", (0.0775, 0.0, 0.85), (0.005, 0.18, 0.18), team_colour),
        KeeperPart("back_marker", (-0.0775, 0.0, 0.85), (0.005, 0.18, 0.18), team_colour),
        KeeperPart("neck", (0.0, 0.0, 1.02), (0.06, 0.06, 0.04), "black"),
        KeeperPart("head", (0.0, 0.0, 1.12), (0.14, 0.14, 0.16), "black"),
    ]
    for name, side in (("left", 1.0), ("right", -1.0)):
        parts += [
            KeeperPart(f"{name}_foot", (0.03, side * 0.10, 0.03), (0.22, 0.12, 0.06), "black"),
            KeeperPart(f"{name}_shank", (0.0, side * 0.10, 0.19), (0.09, 0.08, 0.26), "grey"),
            KeeperPart(f"{name}_thigh", (0.0, side * 0.10, 0.46), (0.11, 0.09, 0.28), "black"),
            KeeperPart(f"{name}_upper_arm", (0.0, side * 0.175, 0.87), (0.07, 0.07, 0.22), team_colour),
            KeeperPart(f"{name}_forearm", (0.0, side * 0.175, 0.64), (0.06, 0.06, 0.24), "black"),
        ]
    return tuple(parts)
