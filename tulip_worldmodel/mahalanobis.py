"""Squared Mahalanobis distances, the chi-square gate, and small matrices."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

Array = NDArray[np.float64]


def diagonal(values: Sequence[float]) -> Array:
    """Return an (n, n) diagonal matrix; numpy's own takes three times as long for small ones."""
    matrix = np.zeros((len(values), len(values)))
    matrix.ravel()[:: len(values) + 1] = values
    return matrix


@cache
def gate(probability: float, dimension: int) -> float:
    """Return the squared Mahalanobis distance inside which a share `probability` of true measurements lies."""
    return float(chi2.ppf(probability, dimension))


def distances_and_determinants(innovations: Array, spreads: Array) -> tuple[Array, Array]:
    """Return the squared Mahalanobis distances of innovations, and the determinants of their covariances.

    Written out for one and two dimensions: for matrices so small, calls of a solver take most of the time.

    Args:
        innovations: (k, m), m 1 or 2.
        spreads: (k, m, m) their covariances, symmetric.

    Returns:
        (k,) distances and (k,) determinants.
    """
    if innovations.shape[1] == 1:
        determinants = spreads[:, 0, 0]
        return innovations[:, 0] ** 2 / determinants, determinants
    first, second = innovations[:, 0], innovations[:, 1]
    a, b, d = spreads[:, 0, 0], spreads[:, 0, 1], spreads[:, 1, 1]
    determinants = a * d - b**2
    return (d * first**2 - 2.0 * b * first * second + a * second**2) / determinants, determinants
