"""Is this a log of this robot? Its weight, its CoP by the prior's bounds, and which mix-up of cells would explain it.

Before any fit the CoP is predicted from the prior, with the covariance that the spread of masses and CoMs, the IMU's
mounting and the cells leave. Each supposed mix-up gives other measurements; what they are worth is their likelihood.
A log is refused if one of the mix-ups is far likelier than the log as it stands, or if even that is absurd.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from tulip_description.model import Side
from tulip_description.robot import Robot
from tulip_motion.identification.body_prior import Spread, body_prior, check_weight
from tulip_motion.identification.com_regressor import PER_BODY, regressor_of
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.static_measurement import StaticMeasurement

Array = NDArray[np.float64]
ROUGHNESS = 2e-3  # [m] what a sound log may err by beside all that is modelled
FAR_LIKELIER = 20.0
"""Difference of log-likelihoods that convinces: one in 5e8."""
ABSURD = 1e-9
"""Probability of a log below which it is not this robot's."""
OTHER: dict[Side, Side] = {"left": "right", "right": "left"}


class Mixup(NamedTuple):
    """A way in which cells may have been mixed up.

    Attributes:
        name: In words.
        undo: Gives the measurement as it would have been.
    """

    name: str
    undo: Callable[[Robot, StaticMeasurement], StaticMeasurement]


def _reordered(
    order: tuple[int, ...], sides: tuple[Side, ...]
) -> Callable[[Robot, StaticMeasurement], StaticMeasurement]:
    """Take the cells of some feet in another order."""

    def undo(robot: Robot, measurement: StaticMeasurement) -> StaticMeasurement:
        if measurement.side not in sides:
            return measurement
        cells, places = measurement.cells[list(order)], robot.feet[get_args(Side).index(measurement.side)].cells
        return replace(measurement, cop=cells @ np.array(places) / cells.sum(), cells=cells)

    return undo


def _other_foot(robot: Robot, measurement: StaticMeasurement) -> StaticMeasurement:
    """Take the cells as the other foot's: heel and toe stay, inner and outer lie mirrored."""
    sign = np.array([1.0, -1.0])
    covariance = measurement.cop_covariance * np.outer(sign, sign)
    return replace(measurement, side=OTHER[measurement.side], cop=measurement.cop * sign, cop_covariance=covariance)


def _exchanged(one: int, other: int) -> tuple[int, ...]:
    order = [0, 1, 2, 3]
    order[one], order[other] = other, one
    return tuple(order)


CELLS = ("heel inner", "heel outer", "toe inner", "toe outer")
ORDERS: dict[str, tuple[int, ...]] = {
    "heel and toe cells": (2, 3, 0, 1),
    "inner and outer cells": (1, 0, 3, 2),
    "heel and toe and inner and outer cells": (3, 2, 1, 0),
    **{f"the {CELLS[a]} and {CELLS[b]} cells": _exchanged(a, b) for a, b in combinations(range(4), 2)},
}
MIXUPS: tuple[Mixup, ...] = (
    Mixup("the cells of the left and the right foot are swapped", _other_foot),
    *(
        Mixup(f"{what} of {where} are swapped", _reordered(order, sides))
        for what, order in ORDERS.items()
        for where, sides in (
            ("both feet", get_args(Side)),
            ("the left foot", ("left",)),
            ("the right foot", ("right",)),
        )
    ),
)


def check_plausible(
    robot: Robot, measurements: Sequence[StaticMeasurement], mass: float, spread: Spread, mount_spread: float
) -> None:
    """Check that measurements can be this robot's.

    Args:
        robot: As it is believed to be.
        measurements: Of it.
        mass: As the cells weigh it [kg].
        spread: Of its bodies about the robot file.
        mount_spread: Of the IMU's mounting angles [rad].

    Raises:
        IdentificationError: if they cannot; names the mix-up that explains them, if one does.
    """
    check_weight(robot, mass, spread)
    expected = _Expected(robot, measurements, mass, spread, mount_spread)
    found, chi_square = expected.log_likelihood(measurements)
    rivals = []
    for mixup in MIXUPS:
        undone = [mixup.undo(robot, measurement) for measurement in measurements]
        same_feet = all(one.side == other.side for one, other in zip(undone, measurements, strict=True))
        rival = expected if same_feet else _Expected(robot, undone, mass, spread, mount_spread)
        rivals.append((*rival.log_likelihood(undone), mixup.name))
    rivals.sort(reverse=True)
    best, best_chi_square, _ = rivals[0]
    numbers = 2 * len(measurements)
    if best > found + FAR_LIKELIER and chi2.sf(best_chi_square, numbers) > ABSURD:
        names = " or ".join(name for likelihood, _, name in rivals if likelihood > best - FAR_LIKELIER)
        raise IdentificationError(
            f"the CoP is where it would be if {names}: correct the wiring or the order of the cells and measure again"
        )
    if chi2.sf(chi_square, numbers) < ABSURD:
        raise IdentificationError(
            f"the CoP is not where this robot's can be (chi^2 {chi_square:.0f} for {numbers} numbers), and no swap of"
            " cells explains it: a log of another robot, a broken cell, or encoders with another zero; check these, or"
            " state a larger spread of masses and CoMs if the robot was rebuilt"
        )


class _Expected:
    """Where the CoP of postures is expected to be by the prior, and how sure that is."""

    def __init__(
        self,
        robot: Robot,
        measurements: Sequence[StaticMeasurement],
        mass: float,
        spread: Spread,
        mount_spread: float,
    ) -> None:
        prior = body_prior(robot, spread, mass)
        rows, nuisance = [], []
        for measurement in measurements:
            posture = regressor_of(robot, measurement.side).cop(measurement.joint_positions, measurement.down)
            rows.append(posture.cop)
            nuisance.append(-float(posture.com[2] @ prior.mean) * posture.slope_change)
        stack, mounting = np.vstack(rows), np.vstack(nuisance)
        # The masses add up to what was weighed: the prior under this condition.
        total = np.tile(np.eye(PER_BODY)[0], len(robot.links))
        mixed = prior.covariance @ total
        gain = mixed / float(total @ mixed)
        mean = prior.mean + gain * (1.0 - float(total @ prior.mean))
        covariance = prior.covariance - np.outer(gain, mixed)
        spread_of_cop = stack @ covariance @ stack.T + mount_spread**2 * mounting @ mounting.T
        for index, each in enumerate(measurements):
            place = slice(2 * index, 2 * index + 2)
            spread_of_cop[place, place] += each.cop_covariance + ROUGHNESS**2 * np.eye(2)
        self._cop = stack @ mean
        self._lower = np.linalg.cholesky(spread_of_cop)

    def log_likelihood(self, measurements: Sequence[StaticMeasurement]) -> tuple[float, float]:
        """Return the logarithm of the likelihood of these CoPs, up to a constant, and their chi^2."""
        error = np.concatenate([measurement.cop for measurement in measurements]) - self._cop
        chi_square = float(np.sum(np.linalg.solve(self._lower, error) ** 2))
        return -0.5 * chi_square - float(np.log(np.diag(self._lower)).sum()), chi_square
