"""The chi-square gate."""

from __future__ import annotations

from functools import cache

from scipy.stats import chi2


@cache
def gate(probability: float, dimension: int) -> float:
    """Return the squared Mahalanobis distance inside which a share `probability` of true measurements lies."""
    return float(chi2.ppf(probability, dimension))
