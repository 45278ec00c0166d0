"""Weighted linear least squares for time series, whose errors last longer than a sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
PASSES = 4  # the weights come from the residuals, which hardly change after the second pass


class Series(NamedTuple):
    """Equations of one uninterrupted piece of a recording, in the order of time.

    Attributes:
        design: (t, r, p) what multiplies the p parameters in each of r kinds of equations.
        target: (t, r) what they shall give.
    """

    design: Array
    target: Array


class Prior(NamedTuple):
    """What is known before.

    Attributes:
        mean: (p,).
        covariance: (p, p), positive definite.
    """

    mean: Array
    covariance: Array


class Fit(NamedTuple):
    """What the equations say.

    Attributes:
        parameters: (p,) most likely.
        covariance: (p, p).
        deviations: (r,) standard deviation of the residuals of each kind of equations.
        correlations: (r,) for how many samples an error lasts: so many count as one.
        learned: How many independent combinations the equations know better than the prior: the sum over all
            combinations of the share of the prior's information in the whole that is not the prior's.
    """

    parameters: Array
    covariance: Array
    deviations: Array
    correlations: Array
    learned: float


def fit(series: Sequence[Series], prior: Prior) -> Fit:
    """Return the parameters that agree best with equations and prior.

    With the prior pi ~ N(pi_0, L L^T) and pi = pi_0 + L z, z minimizes

        |z|^2 + sum over kinds k of |A_k L z - (b_k - A_k pi_0)|^2 / (s_k^2 t_k)                          (D7)

    s_k is the standard deviation of the residuals and t_k their correlation time in samples, the sum of their
    autocorrelation: t successive errors of a slow cause are one error, not t, and give the information of one.
    Parameters that do not act on any equation keep the prior.

    Raises:
        ValueError: if there are fewer samples than it takes to know the errors, or the prior is not positive definite.
    """
    samples = sum(len(piece.target) for piece in series)
    if samples < 50:
        raise ValueError(f"there are {samples} samples; expected at least 50, to know how large their errors are")
    try:
        root = np.linalg.cholesky(prior.covariance)
    except np.linalg.LinAlgError:
        raise ValueError(
            "the prior's covariance is not positive definite; expected some doubt of each parameter"
        ) from None
    designs = [piece.design @ root for piece in series]
    targets = [piece.target - piece.design @ prior.mean for piece in series]
    kinds = targets[0].shape[1]
    products = [sum(d[:, k].T @ d[:, k] for d in designs) for k in range(kinds)]
    loads = [sum(d[:, k].T @ t[:, k] for d, t in zip(designs, targets, strict=True)) for k in range(kinds)]
    variances = np.array([float(sum((t[:, k] ** 2).sum() for t in targets)) for k in range(kinds)]) / samples
    correlations = np.ones(kinds)
    floor = 1e-18 * np.maximum(variances, np.finfo(float).tiny)  # of exact data, which have no errors
    unit = np.eye(len(prior.mean))
    for _ in range(PASSES):
        weights = 1.0 / (np.maximum(variances, floor) * correlations)
        information = unit + sum(w * product for w, product in zip(weights, products, strict=True))
        step = np.linalg.solve(information, sum(w * load for w, load in zip(weights, loads, strict=True)))
        residuals = [t - d @ step for d, t in zip(designs, targets, strict=True)]
        variances = np.array([sum(float((r[:, k] ** 2).sum()) for r in residuals) for k in range(kinds)]) / samples
        correlations = np.array([correlation_time([r[:, k] for r in residuals]) for k in range(kinds)])
    spread = np.linalg.inv(information)
    return Fit(
        prior.mean + root @ step,
        root @ spread @ root.T,
        np.sqrt(variances),
        correlations,
        float(len(unit) - np.trace(spread)),
    )


def correlation_time(pieces: Sequence[Array]) -> float:
    """Return for how many samples an error lasts, >= 1: the autocorrelation summed to its first zero, both ways.

    The mean is not taken off: an offset is an error, too.

    Args:
        pieces: (t,) residuals of each piece of a recording.
    """
    longest = max(len(piece) for piece in pieces)
    power = sum(float(piece @ piece) for piece in pieces)
    if power == 0.0:
        return 1.0
    time = 1.0
    for lag in range(1, longest):
        share = sum(float(piece[lag:] @ piece[:-lag]) for piece in pieces if len(piece) > lag) / power
        if share <= 0.0:
            break
        time += 2.0 * share
    return time
