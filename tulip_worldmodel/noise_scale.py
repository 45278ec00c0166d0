"""How much worse vision is than it says: a factor on the spreads that it claims, learnt from innovations.

A filter that believes a conceited sensor grows sure of a wrong pose, finds its features unexplained, and calls itself
lost. So the median of the squared Mahalanobis distances is watched: of true features, half lie above the median of the
chi-square distribution if the claims are right. A feature above it raises the factor s a little, one below it lowers
it, in proportions that balance at s's true value (H. Robbins and S. Monro, "A stochastic approximation method",
Annals of Mathematical Statistics 22, 1951):

    ln s <- ln s + r (1 - q)   if d^2 > median,   else   ln s - r q,      q = p_false + (1 - p_false) / 2

A median cares little how far away false features are. Vision is never believed more than it asks for: s >= 1.
"""

from __future__ import annotations

import math
from functools import cache

from scipy.stats import chi2

from tulip_worldmodel.localization_parameters import LocalizationParameters


class NoiseScale:
    """The factor, of all features of one camera."""

    def __init__(self, parameters: LocalizationParameters) -> None:
        """Begin by believing vision."""
        self._rate = parameters.noise_scale_rate
        self._greatest = math.log(parameters.greatest_noise_scale)
        self._logarithm = 0.0

    @property
    def value(self) -> float:
        """By which spreads are to be multiplied, >= 1."""
        return math.exp(self._logarithm)

    def add(self, distance: float, dimension: int, false_rate: float) -> None:
        """Take one feature.

        Args:
            distance: Squared Mahalanobis distance to the nearest landmark, with spreads as scaled now.
            dimension: Of the measurement.
            false_rate: Share of such features that are none.
        """
        share = false_rate + 0.5 * (1.0 - false_rate)
        step = 1.0 - share if distance > _median(dimension) else -share
        self._logarithm = max(0.0, min(self._greatest, self._logarithm + self._rate * step))


@cache
def _median(dimension: int) -> float:
    return float(chi2.median(dimension))
