"""How well a body foretells the CoP of postures that it was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_motion.identification.base_parameters import base_parameters
from tulip_motion.identification.body_comparison import base_values
from tulip_motion.identification.com_identification import (
    IdentificationSettings,
    disturbance_rows,
    disturbance_spread,
)
from tulip_motion.identification.com_regressor import regressor_of
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.static_measurement import StaticMeasurement

Array = NDArray[np.float64]
SURE = 0.95
"""Share of honest covariances whose NEES lies inside its bounds."""


@dataclass(frozen=True)
class Validation:
    """Measured CoP less the CoP that was foretold.

    Attributes:
        residuals: (postures, 2) with the body that was identified [m].
        prior_residuals: (postures, 2) with the robot file [m].
        nees: Normalized estimation error squared, by the numbers measured: 1 on average if the covariance is honest.
        bounds: Between which an honest one lies, 95 times in 100.
    """

    residuals: Array
    prior_residuals: Array
    nees: float
    bounds: tuple[float, float]

    @property
    def rms(self) -> float:
        """Root of the mean square distance of measured and foretold CoP [m]."""
        return _rms(self.residuals)

    @property
    def prior_rms(self) -> float:
        """The same with the robot file [m]."""
        return _rms(self.prior_residuals)

    @property
    def too_sure(self) -> bool:
        """Whether the covariance is too small to explain the residuals."""
        return self.nees > self.bounds[1]


def validate(
    prior: Robot,
    values: Array,
    covariance: Array,
    model_error: float,
    measurements: Sequence[StaticMeasurement],
    settings: IdentificationSettings,
) -> Validation:
    """Compare a body with postures.

    How the IMU is mounted, and how the cells show the CoP, is not known beforehand (it may be otherwise
    on the day of these postures): their covariance counts in the NEES, and of the residuals their part is taken off,
    found with that covariance as a prior.

    Args:
        prior: The robot file's robot; gives the kinematics.
        values: (r,) base parameters theta_b of eq. (2), by the whole mass [m].
        covariance: (r, r) of these [m^2].
        model_error: s of eq. (2d) [m].
        measurements: Of postures that were not used for the fit.
        settings: What is taken for granted.

    Raises:
        IdentificationError: without postures.
    """
    if not measurements:
        raise IdentificationError("there are no postures to validate with; leave some out of the fit, or record more")
    base = base_parameters(prior)
    rows = [regressor_of(prior, each.side).cop(each.joint_positions, each.down) for each in measurements]
    known = np.vstack([base.rows(each.cop) for each in rows])
    heights = [float(base.rows(each.com)[2] @ values) for each in rows]
    postures = zip(measurements, heights, [each.slope_change for each in rows], strict=True)
    disturbances = np.vstack([disturbance_rows(prior, *posture) for posture in postures]) * disturbance_spread(settings)
    noise = np.zeros((2 * len(measurements),) * 2)
    for index, each in enumerate(measurements):
        here = slice(2 * index, 2 * index + 2)
        noise[here, here] = each.cop_covariance + model_error**2 * np.eye(2)
    measured = np.concatenate([each.cop for each in measurements])
    off = measured - known @ values
    prior_off = measured - known @ base_values(prior)
    spread = noise + known @ covariance @ known.T + disturbances @ disturbances.T
    nees = float(off @ np.linalg.solve(spread, off)) / len(off)
    low, high = scipy.stats.chi2.interval(SURE, len(off))
    return Validation(
        (off - _disturbed(off, disturbances, noise)).reshape(-1, 2),
        (prior_off - _disturbed(prior_off, disturbances, noise)).reshape(-1, 2),
        nees,
        (float(low) / len(off), float(high) / len(off)),
    )


def _disturbed(off: Array, disturbances: Array, noise: Array) -> Array:
    """Return the part of residuals that disturbances explain; those are given by their standard deviations."""
    weighted = np.linalg.solve(noise, disturbances)
    information = disturbances.T @ weighted + np.eye(disturbances.shape[1])
    part: Array = disturbances @ np.linalg.solve(information, weighted.T @ off)
    return part


def _rms(residuals: Array) -> float:
    return math.sqrt(float(np.mean(np.sum(residuals**2, axis=1))))
