"""Lines of figures with fewer points."""

from __future__ import annotations

import numpy as np

from tulip_view.report.figures import peaks

TIMES = np.arange(100_003) / 250.0


def test_a_single_peak_among_many_points_is_kept() -> None:
    values = np.sin(TIMES)
    values[54_321], values[77_777] = 5.0, -6.0
    t, v = peaks(TIMES, values, 1000)
    assert len(v) <= 1000
    assert v.max() == 5.0
    assert t[v.argmax()] == TIMES[54_321]
    assert v.min() == -6.0
    assert (np.diff(t) > 0.0).all()


def test_a_gap_of_one_point_still_breaks_the_line() -> None:
    values = np.cos(TIMES)
    values[40_000] = np.nan
    t, v = peaks(TIMES, values, 1000)
    assert np.isnan(v).sum() == 1
    assert t[np.isnan(v)] == TIMES[40_000]


def test_a_line_that_is_nothing_but_a_gap_stays_one() -> None:
    _, v = peaks(TIMES, np.full_like(TIMES, np.nan), 1000)
    assert np.isnan(v).all()


def test_a_short_line_is_left_alone() -> None:
    t, v = peaks(TIMES[:500], TIMES[:500] ** 2, 1000)
    assert np.array_equal(t, TIMES[:500])
    assert np.array_equal(v, TIMES[:500] ** 2)
