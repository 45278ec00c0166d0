"""What an identification found, as tables of words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_motion.identification.base_parameters import base_parameters
from tulip_motion.identification.body_comparison import base_values, com_rows, rms
from tulip_motion.identification.com_identification import ComIdentification
from tulip_motion.identification.physical_consistency import WholeBody

Array = NDArray[np.float64]
Row = tuple[str, ...]
POSTURES = 200
"""On which two bodies are compared."""
BASE_HEADINGS = ("base parameter, by the whole mass", "believed [mm]", "found [mm]", "+- [mm]")
LINK_HEADINGS = ("link", "believed [kg]", "found [kg]", "CoM moved x, y, z [mm]", "told by the postures: mass, x, y, z")


def base_rows(fit: ComIdentification) -> list[Row]:
    """Return the base parameters that were sought: in words, as believed, as found, and their standard deviation."""
    before, spread = base_values(fit.prior), np.sqrt(np.diag(fit.covariance))
    columns = zip(fit.base.names, before.tolist(), fit.values.tolist(), spread.tolist(), strict=True)
    return [
        (name, f"{1e3 * was:.2f}", f"{1e3 * found:.2f}", f"{1e3 * sigma:.2f}")
        for name, was, found, sigma in list(columns)[fit.base.unknown]
    ]


def link_rows(fit: ComIdentification, whole: WholeBody) -> list[Row]:
    """Return mass and CoM of each link, and how much of them the postures told."""
    rows: list[Row] = []
    for was, found, told in zip(fit.prior.links, whole.robot.links, whole.told.tolist(), strict=True):
        moved = 1e3 * np.subtract(found.com, was.com)
        shares = ", ".join(f"{share:.0%}" for share in told)
        rows.append(
            (was.name, f"{was.mass:.3f}", f"{found.mass:.3f}", ", ".join(f"{x:+.1f}" for x in moved.tolist()), shares)
        )
    return rows


def com_difference(one: Robot, other: Robot) -> Array:
    """Return (2,) by how much the CoM of two bodies of one robot differs, RMS of x and y over random postures [m]."""
    rows = com_rows(one, POSTURES, np.random.default_rng(0))
    return rms(rows @ (base_values(one) - base_values(other)))


def difference_rows(one: Robot, other: Robot, covariance: Array) -> list[Row]:
    """Return the base parameters of two bodies, and by how many standard deviations they differ.

    Args:
        one: A body.
        other: Another one of the same robot.
        covariance: (r, r) of the difference [m^2]; where it is zero there is no deviation to tell.
    """
    first, second, spread = base_values(one), base_values(other), np.sqrt(np.diag(covariance))
    rows: list[Row] = []
    for name, a, b, sigma in zip(base_parameters(one).names, first, second, spread, strict=True):
        if a != b:
            deviations = f"{abs(a - b) / sigma:.1f}" if sigma > 0.0 else ""
            rows.append((name, f"{1e3 * a:.2f}", f"{1e3 * b:.2f}", f"{1e3 * (b - a):+.2f}", deviations))
    return rows


DIFFERENCE_HEADINGS = ("base parameter, by the whole mass", "first [mm]", "second [mm]", "difference [mm]", "sigmas")
