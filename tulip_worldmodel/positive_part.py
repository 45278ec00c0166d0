"""What of a small symmetric matrix is a covariance."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def positive_part(matrix: Array) -> Array:
    """Return the nearest (2, 2) matrix without negative eigenvalues: those are set to zero.

    In closed form, with eigenvalues m - r and m + r, as this is asked for some hundred times a second: where one of
    them is negative, (m + r) / 2 r (A - (m - r) I) is what the other one makes of A.

    Args:
        matrix: (2, 2), symmetric but for rounding.
    """
    (a, b), (c, d) = matrix.tolist()
    off, middle, half = 0.5 * (b + c), 0.5 * (a + d), 0.5 * (a - d)
    radius = math.hypot(half, off)
    if middle + radius <= 0.0:
        return np.zeros((2, 2))
    share = 1.0
    if middle < radius:
        share = (middle + radius) / (2.0 * radius)
        a, d = half + radius, radius - half
    return np.array([[share * a, share * off], [share * off, share * d]])
