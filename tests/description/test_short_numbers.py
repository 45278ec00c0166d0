"""Short numbers are near those that they stand for, and what is no number stays so."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from tulip_description.short_numbers import fixed_point, significant

VALUES = np.random.default_rng(1).normal(size=2000) * np.logspace(-6, 3, 2000)


@pytest.mark.parametrize("digits", [10, 16])
def test_fixed_point_is_within_half_a_step(digits: int) -> None:
    rounded = fixed_point(VALUES, digits)
    assert np.abs(rounded - VALUES).max() <= 2.0 ** -(digits + 1)
    assert np.array_equal(rounded, fixed_point(rounded, digits))
    assert np.array_equal(rounded * 2.0**digits, np.rint(rounded * 2.0**digits))


def test_significant_digits_are_relative_to_each_number() -> None:
    rounded = significant(VALUES, 12)
    assert (np.abs(rounded / VALUES - 1.0)).max() <= 2.0**-12
    assert np.array_equal(significant(rounded, 12), rounded)


@pytest.mark.parametrize("short", [fixed_point, significant])
def test_zero_and_what_is_no_number_stay(short) -> None:
    special = np.array([0.0, np.nan, np.inf, -np.inf])
    assert np.array_equal(short(special), special, equal_nan=True)
    assert short(np.zeros((2, 3))).shape == (2, 3)


@pytest.mark.parametrize("short", [fixed_point, significant])
def test_short_numbers_compress(short) -> None:
    assert len(zlib.compress(short(VALUES).tobytes())) < 0.5 * len(zlib.compress(VALUES.tobytes()))
