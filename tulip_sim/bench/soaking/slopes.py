"""Whether a figure grows with time: a straight line through its samples, and how sure its slope is.

Samples that follow each other are alike: memory that was taken stays taken. Taken for independent they would make any
slope seem sure. So their number is reduced by the correlation of neighbouring residuals, as is usual for trends of
time series (Santer et al., Journal of Geophysical Research 105, 2000, eqs. 4 to 6).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import linregress, t

CONFIDENCE = 0.95

Series = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Times [h], ascending, and values, of one process."""


@dataclass(frozen=True)
class Slope:
    """How a figure changes with time.

    Attributes:
        per_hour: Slope of the line, in the figure's unit by hour.
        margin: Half of the width of its confidence interval, infinite where there are too few samples to tell.
        mean: Of all samples.
        first: Mean of the first fifth of the samples of each process.
        last: Mean of the last fifth.
        hours: From the first sample to the last, all processes together.
    """

    per_hour: float
    margin: float
    mean: float
    first: float
    last: float
    hours: float

    @property
    def verdict(self) -> str:
        """Return "flat" if the interval holds zero, else "grows" or "falls"; "unknown" with too few samples."""
        if not math.isfinite(self.margin):
            return "unknown"
        if abs(self.per_hour) <= self.margin:
            return "flat"
        return "grows" if self.per_hour > 0.0 else "falls"


def fit(series: Sequence[Series], warm_up: float) -> Slope | None:
    """Fit one slope to the samples of several processes, each with a level of its own.

    Args:
        series: Of each process.
        warm_up: Time [h] since a process's first sample which is left out.

    Returns:
        The slope, or None if no process has two samples after its warm-up.
    """
    kept = [(times[times - times[0] >= warm_up], values[times - times[0] >= warm_up]) for times, values in series]
    kept = [(times, values) for times, values in kept if len(times) > 1]
    if not kept:
        return None
    times = np.concatenate([each - each.mean() for each, _ in kept])
    values = np.concatenate([each - each.mean() for _, each in kept])
    line = linregress(times, values)
    residuals = np.split(values - line.slope * times, np.cumsum([len(each) for each, _ in kept])[:-1])
    number = _independent(residuals)
    freedom = number - len(kept) - 1  # a level each, and the slope
    if np.ptp(values) == 0.0:
        margin = 0.0
    elif freedom < 1.0:
        margin = math.inf
    else:
        square = sum(float(each @ each) for each in residuals)
        error = math.sqrt(square / freedom / float(times @ times))
        margin = float(t.ppf(0.5 + CONFIDENCE / 2.0, freedom)) * error
    fifths = [max(1, len(each) // 5) for each, _ in kept]
    return Slope(
        per_hour=float(line.slope),
        margin=margin,
        mean=float(np.concatenate([each for _, each in kept]).mean()),
        first=float(np.mean([each[:n].mean() for (_, each), n in zip(kept, fifths, strict=True)])),
        last=float(np.mean([each[-n:].mean() for (_, each), n in zip(kept, fifths, strict=True)])),
        hours=float(sum(each[-1] - each[0] for each, _ in kept)),
    )


def _independent(residuals: Sequence[NDArray[np.float64]]) -> float:
    """Return the number of independent samples that tell as much: n (1 - r) / (1 + r), with r of neighbours."""
    number = sum(len(each) for each in residuals)
    square = sum(float(each @ each) for each in residuals)
    if square == 0.0:
        return float(number)
    neighbours = max(0.0, sum(float(each[1:] @ each[:-1]) for each in residuals) / square)
    return number * (1.0 - neighbours) / (1.0 + neighbours)
