"""The base parameters of eq. (2): what the standard parameters of the CoM come to, without redundancy.

Only some combinations of the standard parameters theta move the CoM: a shift of mass along a joint's axis from one of
its bodies to the other changes nothing. So some columns of the stacked rows W = (R(q_1); R(q_2); ...) over random
postures depend on the others, W_2 = W_1 B, and with theta split alike

    W theta = W_1 theta_b,    theta_b = theta_1 + B theta_2 = K theta                                         (2c)

(Gautier, "Numerical calculation of the base inertial parameters of robots", 1991). W holds the x and y rows on both
feet: the CoP shows no others. Which columns are kept is a choice; here it depends on their names alone: first moments
before masses, and bodies from the trunk outwards. Then every child's mass goes into its parent's moments by the way
from joint to joint, and the one mass that is kept, the trunk's, becomes the sum of all, which is 1 by the definition of
theta.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from tulip_description.robot import SIDES, Robot
from tulip_motion.identification.com_regressor import PER_BODY, ComRegressor

Array = NDArray[np.float64]
POSTURES = 60
"""Random postures on each foot: 240 rows for 72 columns."""
DEPENDENT = 1e-9
"""A column whose part outside of the span of others is smaller than this share of it lies in their span.

Exact dependence leaves 1e-15, and the smallest true part is about 0.1.
"""


@dataclass(frozen=True)
class Reduction:
    """Independent columns and what they stand for.

    Attributes:
        columns: Indices of the r columns kept, in the order of preference.
        combinations: (r, p) K of eq. (2c).
    """

    columns: tuple[int, ...]
    combinations: Array


def reduce_columns(stack: Array, preference: Sequence[int]) -> Reduction:
    """Keep the first columns that are independent, and express the rest by them.

    The rank comes from a QR decomposition with column pivoting. Pivoting by size would choose columns by chance where
    sizes are alike; so columns are taken in the order of preference, each if it is not in the span of those before.

    Args:
        stack: (rows, p) W, rows > p.
        preference: All column indices, the most wanted first.

    Raises:
        ValueError: if it is unclear which columns are independent.
    """
    diagonal = np.abs(np.diag(scipy.linalg.qr(stack, mode="r", pivoting=True)[0]))
    rank = int(np.count_nonzero(diagonal > DEPENDENT * diagonal[0]))
    kept: list[int] = []
    directions = np.empty((len(stack), 0))
    for column in preference:
        rest = stack[:, column].copy()
        for _ in range(2):  # once more for what rounding left
            rest -= directions @ (directions.T @ rest)
        size = float(np.linalg.norm(rest))
        if size > DEPENDENT * float(np.linalg.norm(stack[:, column])):
            kept.append(column)
            directions = np.column_stack((directions, rest / size))
    if len(kept) != rank:
        raise ValueError(f"{len(kept)} columns are independent one by one, but the rank is {rank}; expected the same")
    combinations = np.asarray(np.linalg.lstsq(stack[:, kept], stack, rcond=None)[0], dtype=np.float64)
    combinations[np.abs(combinations) < DEPENDENT] = 0.0
    return Reduction(tuple(kept), combinations)


@dataclass(frozen=True)
class BaseParameters:
    """The base parameters of a robot's CoM.

    Attributes:
        names: Of the r base parameters, as sums of standard ones.
        columns: Indices of the columns of R that stay.
        combinations: (r, 4 links) K: theta_b = K theta.
    """

    names: tuple[str, ...]
    columns: tuple[int, ...]
    combinations: Array

    @property
    def unknown(self) -> slice:
        """Those that measurements have to tell: all but the last, the sum of all masses, which is 1."""
        return slice(0, len(self.columns) - 1)

    def rows(self, full: Array) -> Array:
        """Return (..., r) the reduced rows of rows (..., 4 links) of eq. (2a)."""
        reduced: Array = full[..., self.columns]
        return reduced


@cache
def base_parameters(robot: Robot) -> BaseParameters:
    """Return the base parameters of a robot's CoM as the CoP on both feet shows it.

    Raises:
        ValueError: if the columns cannot be told apart, or the total mass is not the one mass that is left.
    """
    rng = np.random.default_rng(0)
    low, high = robot.position_limits
    stack = np.vstack(
        [
            regressor.com(rng.uniform(low, high))[:2]
            for regressor in (ComRegressor(robot, "left"), ComRegressor(robot, "right"))
            for _ in range(POSTURES)
        ]
    )
    found = reduce_columns(stack, preference(robot))
    total = np.tile([1.0, 0.0, 0.0, 0.0], len(robot.links))
    if not np.allclose(found.combinations[-1], total, atol=DEPENDENT):
        raise ValueError("the last base parameter is not the sum of all masses; expected one mass to stay")
    names = tuple(_in_words(robot, row, column) for row, column in zip(found.combinations, found.columns, strict=True))
    return BaseParameters(names, found.columns, found.combinations)


def preference(robot: Robot) -> list[int]:
    """Return the column indices, first moments before masses, bodies in the order of `robot.links`."""
    bodies = range(len(robot.links))
    moments = [PER_BODY * body + axis for body in bodies for axis in (1, 2, 3)]
    return moments + [PER_BODY * body for body in bodies]


def standard_name(robot: Robot, column: int) -> str:
    """Return the name of a standard parameter, times M: `m(thigh)` [kg] or `m c_x(thigh)` [kg m]."""
    body, kind = divmod(column, PER_BODY)
    return f"{('m', 'm c_x', 'm c_y', 'm c_z')[kind]}({robot.links[body].name})"


def _in_words(robot: Robot, row: Array, column: int) -> str:
    """Return a combination as a sum, its own column first, equal factors of masses put together."""
    factors: dict[float, list[int]] = {}
    for index in np.flatnonzero(row).tolist():
        if index != column:
            factors.setdefault(round(float(row[index]), 6), []).append(index)
    text = standard_name(robot, column)
    for factor, columns in factors.items():
        terms = [standard_name(robot, index) for index in columns]
        named = f"m({', '.join(_bodies(robot, columns))})" if _all_masses(columns) else " + ".join(terms)
        size = "" if abs(factor) == 1.0 else f"{abs(factor):g} "
        bracket = f"({named})" if size and len(terms) > 1 and not _all_masses(columns) else named
        text += f" {'-' if factor < 0.0 else '+'} {size}{bracket}"
    return text


def _all_masses(columns: Sequence[int]) -> bool:
    return all(column % PER_BODY == 0 for column in columns)


def _bodies(robot: Robot, columns: Sequence[int]) -> list[str]:
    """Return the names of bodies; those of a whole leg, seen from some link downwards, as one word."""
    names = [robot.links[column // PER_BODY].name for column in columns]
    for side in SIDES:
        leg = [link.name for link in robot.links if link.name.startswith(f"{side}_") and link.name != f"{side}_arm"]
        for first in range(len(leg) - 2):
            if set(leg[first:]) <= set(names):
                names = [name for name in names if name not in leg[first:]] + [f"{leg[first]} and below"]
                break
    return names
