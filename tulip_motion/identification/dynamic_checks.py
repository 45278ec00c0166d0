"""Is what a dynamic identification found a body that this robot can have? What is beyond belief is refused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from tulip_motion.identification.correlated_fit import Fit, Prior
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.zmp_regressor import CELL_PARAMETERS, PARAMETER_NAMES, PER_BODY, ZmpRegressor
from tulip_motion.identification.zmp_rows import ZmpRows

Array = NDArray[np.float64]

LEAST_LEARNED = 5.0  # combinations; the CoM's two coordinates, mass, height and something that moves
LARGEST_SPREAD = 0.5  # of the cells: the rim of a sole is not half as far out again as they are
LARGEST_ERROR = 6e-3  # [m] of the ZMP, root mean square; squats and sways leave 2 mm, a walk 4
DOUBT = 2.0  # times the prior's standard deviations: what filters and soles do to the ZMP ends up in the body, too
ABSURD = 1e-9
"""Probability of a body, by the prior, below which it is not this robot's."""
MIRRORED = {
    "heel and toe cells": (True, False),
    "inner and outer cells": (False, True),
    "heel and toe and inner and outer cells": (True, True),
}
"""Cells that are swapped have the CoP beyond their middle, along or across the sole: a spread (D5) of -2."""
FAR_BETTER = 0.5
"""Share of the ZMP's error that is left, at most, when cells are swapped back that were swapped."""


def check_result(regressor: ZmpRegressor, recordings: Sequence[ZmpRows], prior: Prior, found: Fit) -> None:
    """Check that a fit is this robot's body, and that the recordings told it.

    Args:
        regressor: Of the robot.
        recordings: That were fitted.
        prior: Of the parameters (10 b + 3,).
        found: The fit.

    Raises:
        IdentificationError: if not; says why, and names cells that are swapped, if that explains it.
    """
    if found.learned < LEAST_LEARNED:
        raise IdentificationError(
            f"the recordings tell {found.learned:.1f} combinations of parameters better than the robot file; expected"
            f" {LEAST_LEARNED:.0f} or more: add squats, sways and leans of larger amplitude"
        )
    reason = (
        _why_no_cells(found.parameters[-CELL_PARAMETERS:-1])
        or _why_no_zmp(recordings, found.parameters)
        or _why_no_body(regressor, prior, found)
    )
    if reason:
        swapped = _swapped(recordings, prior, found.parameters[-CELL_PARAMETERS:-1])
        raise IdentificationError(
            f"the CoP is where it would be if {swapped} of both feet are swapped ({reason}): correct the wiring or the"
            " order of the cells and record again"
            if swapped
            else f"{reason}: another robot, cells that are broken or mixed up, encoders with another zero, or a fall or"
            " a hand on the robot in the recording; check these, or state a larger spread of masses and CoMs if the"
            " robot was rebuilt"
        )


def _why_no_cells(spreads: Array) -> str:
    """Return why no sole has cells with such spreads (2,), or ""."""
    for spread, axis in zip(spreads.tolist(), ("along", "across"), strict=True):
        if abs(spread) > LARGEST_SPREAD:
            return (
                f"the CoP fits the motion if its way {axis} the soles is {1.0 + spread:.2f} of what the cells show;"
                f" expected {1.0 - LARGEST_SPREAD:.1f} to {1.0 + LARGEST_SPREAD:.1f}"
            )
    return ""


def _why_no_zmp(recordings: Sequence[ZmpRows], parameters: Array) -> str:
    """Return in which recording more is left of the ZMP's error than a body can be to blame for, or ""."""
    for number, recording in enumerate(recordings, start=1):
        left = recording.rms_error(parameters)
        if left > LARGEST_ERROR:
            return (
                f"in recording {number} of {len(recordings)} the ZMP of the best body is {1e3 * left:.1f} mm (RMS)"
                f" beside the measured CoP; expected at most {1e3 * LARGEST_ERROR:.0f} mm"
            )
    return ""


def _why_no_body(regressor: ZmpRegressor, prior: Prior, found: Fit) -> str:
    """Return why a body is beyond belief, by the prior, or "".

    What was found differs from the prior's mean by a normal vector of covariance P - C, the prior's less that of the
    fit; by P^-1 its square is, on average, the number of combinations that were learned.
    """
    difference = found.parameters - prior.mean
    square = float(difference @ np.linalg.solve(prior.covariance, difference))
    if chi2.sf(square / DOUBT**2, found.learned) > ABSURD:
        return ""
    names = [f"{kind}({body})" for body in regressor.body_names for kind in PARAMETER_NAMES]
    away = np.abs(difference / np.sqrt(np.diag(prior.covariance)))
    # Masses and first moments are what people can look for.
    worst = max((i for i in range(len(names)) if i % PER_BODY < 4), key=lambda i: float(away[i]))
    return (
        f"the motion asks for a body that is beyond belief (chi^2 {square:.0f} for {found.learned:.0f} combinations);"
        f" {names[worst]} is {prior.mean[worst]:.3f} in the robot file and would be {found.parameters[worst]:.3f},"
        f" {away[worst]:.1f} standard deviations away"
    )


def _swapped(recordings: Sequence[ZmpRows], prior: Prior, spreads: Array) -> str:
    """Return which cells are swapped, by the spreads (2,) that were found or by the robot file's ZMP, or ""."""

    def left(along: bool, across: bool) -> float:
        parameters = prior.mean.copy()
        parameters[-CELL_PARAMETERS:-1] = -2.0 * along, -2.0 * across
        return sum(recording.rms_error(parameters) for recording in recordings)

    for name, (along, across) in MIRRORED.items():
        if tuple(spreads < -1.0) == (along, across):
            return name
    best = min(MIRRORED, key=lambda name: left(*MIRRORED[name]))
    return best if left(*MIRRORED[best]) < FAR_BETTER * left(False, False) else ""
