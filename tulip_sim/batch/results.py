"""Rows as a Parquet or CSV file, and what they say, with confidence intervals of 95 %."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from tulip_ros.errors import BadInputError
from tulip_sim.batch.jobs import Play, Row

ENDINGS = (".csv", ".parquet")
CONFIDENCE = 0.95
PARQUET_HINT = "Install the extra: pip install 'tulip-soccer[batch]', or name a file that ends in .csv"


def check_ending(path: Path) -> None:
    """Refuse a results file that cannot be written for its name.

    Raises:
        BadInputError: for another ending, or if the package for it is not installed.
    """
    if path.suffix not in ENDINGS:
        raise BadInputError(f"Results file {path} ends in {path.suffix!r}; expected {' or '.join(ENDINGS)}.")
    if path.suffix == ".parquet":
        try:
            import pyarrow  # noqa: F401
        except ImportError as error:
            raise BadInputError(f"A Parquet file needs the package pyarrow. {PARQUET_HINT}.") from error


def write_results(path: Path, rows: Sequence[Row]) -> None:
    """Write the rows, sorted by seed and set, so that the file does not depend on which job ended first.

    The file is replaced as a whole: who reads it never meets half of one.
    """
    rows = sorted(rows, key=lambda row: (row["seed"], row["set"]))
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        if path.suffix == ".parquet":
            import pyarrow
            import pyarrow.parquet

            pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows), fresh)
        else:
            with open(fresh, "w", newline="") as file:
                writer = csv.DictWriter(file, list(rows[0]) if rows else ["set", "seed"])
                writer.writeheader()
                writer.writerows(rows)
        fresh.replace(path)
    finally:
        fresh.unlink(missing_ok=True)


@dataclass(frozen=True)
class Estimate:
    """A figure of one parameter set.

    Attributes:
        name: What it is, with its unit.
        value: The rate (0 to 1) or mean; NaN without data.
        low, high: Ends of the confidence interval; NaN where there are too few data.
        count: How many rows it comes from.
        is_rate: Whether it is a rate.
    """

    name: str
    value: float
    low: float
    high: float
    count: int
    is_rate: bool

    def __str__(self) -> str:
        if not self.count:
            return "-"
        scale, unit = (100.0, " %") if self.is_rate else (1.0, "")
        digits = 0 if self.is_rate else 2
        text = f"{scale * self.value:.{digits}f}{unit}"
        if np.isnan(self.low):
            return text
        return f"{text} ({scale * self.low:.{digits}f} to {scale * self.high:.{digits}f})"


def summarize(rows: Sequence[Row], play: Play) -> dict[str, list[Estimate]]:
    """Return what the rows of each parameter set say."""
    sets: dict[str, list[Row]] = {}
    for row in sorted(rows, key=lambda row: row["seed"]):
        sets.setdefault(row["set"], []).append(row)
    return {
        name: [rate(words, [row[column] for row in own]) for words, column in play.rates.items()]
        + [
            mean(words, [row[column] for row in own if row[column] is not None and (not only or row[only])])
            for words, (column, only) in play.means.items()
        ]
        for name, own in sets.items()
    }


def rate(name: str, happened: Sequence[bool]) -> Estimate:
    """Return how often something happened, with Wilson's interval."""
    if not happened:
        return Estimate(name, np.nan, np.nan, np.nan, 0, True)
    count = sum(happened)
    interval = stats.binomtest(count, len(happened)).proportion_ci(CONFIDENCE, "wilson")
    return Estimate(name, count / len(happened), float(interval.low), float(interval.high), len(happened), True)


def mean(name: str, values: Sequence[float]) -> Estimate:
    """Return the mean of some values, with Student's interval; that needs two of them."""
    if not values:
        return Estimate(name, np.nan, np.nan, np.nan, 0, False)
    middle = float(np.mean(values))
    if len(values) < 2:
        return Estimate(name, middle, np.nan, np.nan, 1, False)
    half = float(stats.sem(values) * stats.t.ppf(0.5 + 0.5 * CONFIDENCE, len(values) - 1))
    return Estimate(name, middle, middle - half, middle + half, len(values), False)
