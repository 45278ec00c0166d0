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
        solid: Whether the ball bounces off it; else it is only seen.
    """

    name: str
    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    colour: str
    solid: bool = True


def keeper_parts(team_colour: str = "cyan") -> tuple[KeeperPart, ...]:
    """Return the boxes of the figure: 1.30 m high, 0.60 m wide, none inside another.

    Args:
        team_colour: Of the arms and of the plates on chest and back, cyan or magenta.

    Raises:
        ValueError: if the colour is another one.
    """
    if team_colour not in TEAM_COLOURS:
        raise ValueError(f"team_colour is {team_colour!r}; expected {' or '.join(TEAM_COLOURS)}")
    parts = [
        KeeperPart("trunk", (0.0, 0.0, 0.87), (0.18, 0.40, 0.46), "grey"),
        KeeperPart("chest_marker", (0.0925, 0.0, 0.95), (0.005, 0.24, 0.20), team_colour, solid=False),
        KeeperPart("back_marker", (-0.0925, 0.0, 0.95), (0.005, 0.24, 0.20), team_colour, solid=False),
        KeeperPart("neck", (0.0, 0.0, 1.11), (0.06, 0.06, 0.02), "black", solid=False),
        KeeperPart("head", (0.0, 0.0, 1.21), (0.14, 0.14, 0.18), "black"),
    ]
    for name, side in (("left", 1.0), ("right", -1.0)):
        parts += [
            KeeperPart(f"{name}_foot", (0.04, side * 0.14, 0.03), (0.22, 0.15, 0.06), "black"),
            KeeperPart(f"{name}_leg", (0.0, side * 0.14, 0.35), (0.11, 0.11, 0.58), "grey"),
            KeeperPart(f"{name}_arm", (0.0, side * 0.26, 0.86), (0.08, 0.08, 0.44), team_colour),
        ]
    return tuple(parts)
