"""The numbers of a robot's bodies and joints, and how far two sets of them are apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDING = 1e-9
"""Files hold numbers with all their digits, so only sums and changes of frame round: to 1e-16 or so."""


@dataclass(frozen=True)
class BodyFigures:
    """A rigid body.

    Attributes:
        mass: [kg].
        com: (3,) in the body's frame [m].
        inertia: (3, 3) about the CoM, along the axes of the body's frame [kg m^2].
    """

    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True)
class JointFigures:
    """A joint. What a format has no place for, or its loader does not tell, is None.

    Attributes:
        place: (3,) of the joint in its parent's frame [m].
        axis: (3,) in its own frame.
        lower, upper: Range [rad].
        effort: Greatest torque [N m].
        velocity: Greatest speed [rad/s].
        damping: [N m s/rad].
        friction: Dry friction [N m].
        armature: Inertia of the rotor on the joint's side [kg m^2].
    """

    place: Array
    axis: Array
    lower: float
    upper: float
    effort: float | None = None
    velocity: float | None = None
    damping: float | None = None
    friction: float | None = None
    armature: float | None = None


@dataclass(frozen=True)
class Figures:
    """A robot, or a ball.

    Attributes:
        bodies, joints: By name.
    """

    bodies: Mapping[str, BodyFigures]
    joints: Mapping[str, JointFigures]


@dataclass(frozen=True)
class Difference:
    """The greatest difference of one kind of number.

    Attributes:
        quantity: As in "mass [kg]".
        greatest: nan if nobody told.
        where: Body or joint that it belongs to.
        count: How many bodies or joints were compared.
    """

    quantity: str
    greatest: float
    where: str
    count: int

    @property
    def fits(self) -> bool:
        """Whether it is rounding, or nobody told."""
        return not self.greatest > ROUNDING


UNITS = {
    "mass": "kg", "com": "m", "inertia": "kg m^2", "place": "m", "axis": "1", "lower": "rad", "upper": "rad",
    "effort": "N m", "velocity": "rad/s", "damping": "N m s/rad", "friction": "N m", "armature": "kg m^2",
}  # fmt: skip


class MissingPartError(ValueError):
    """A loaded file has other bodies or joints than expected; the message names them."""


def compare(found: Figures, wanted: Figures) -> list[Difference]:
    """Return the greatest difference of each kind of number.

    Raises:
        MissingPartError: if found has not the bodies and joints of wanted.
    """
    differences = []
    for kind, mine, theirs, figures in (
        ("bodies", found.bodies, wanted.bodies, BodyFigures),
        ("joints", found.joints, wanted.joints, JointFigures),
    ):
        if set(mine) != set(theirs):
            raise MissingPartError(
                f"{kind} are {', '.join(sorted(mine)) or 'none'}; expected {', '.join(sorted(theirs)) or 'none'}"
            )
        for field in fields(figures) if theirs else ():
            sizes = {
                name: _distance(getattr(mine[name], field.name), getattr(theirs[name], field.name)) for name in mine
            }
            where = max(sizes, key=lambda name: (not np.isnan(sizes[name]), sizes[name]))
            differences.append(Difference(f"{field.name} [{UNITS[field.name]}]", sizes[where], where, len(sizes)))
    return differences


def _distance(found: Array | float | None, wanted: Array | float | None) -> float:
    if found is None or wanted is None:
        return float("nan")
    return float(np.abs(np.asarray(found) - np.asarray(wanted)).max())
