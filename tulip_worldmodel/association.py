"""Which sighting belongs to which moving object: each at most to one, with the least sum of distances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

Array = NDArray[np.float64]

UNMATCHED_PENALTY = 1e6  # far beyond any gate, so that the solver matches as many pairs inside the gates as it can


def assign(distances: Array, limits: Array) -> list[tuple[int, int]]:
    """Match rows (objects) and columns (sightings).

    Args:
        distances: (n, m) squared Mahalanobis distances.
        limits: (m,) the gate of each sighting, which depends on its dimension.

    Returns:
        Pairs (row, column) inside their gates, every row and column at most once.
    """
    if distances.size == 0:
        return []
    inside = distances <= limits[None, :]
    rows, columns = linear_sum_assignment(np.where(inside, distances, UNMATCHED_PENALTY))
    return [(int(row), int(column)) for row, column in zip(rows, columns, strict=True) if inside[row, column]]
