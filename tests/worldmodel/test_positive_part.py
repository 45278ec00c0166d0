"""The positive part of a 2 x 2 matrix is that of its eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest

from tulip_worldmodel.positive_part import positive_part


@pytest.mark.parametrize("seed", range(200))
def test_negative_eigenvalues_are_cut_off_as_by_the_library(seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(2, 2)) * 10.0 ** rng.integers(-6, 3)
    matrix = matrix + matrix.T + rng.normal() * np.eye(2) * np.abs(matrix).max()
    values, vectors = np.linalg.eigh(matrix)
    expected = (vectors * np.maximum(values, 0.0)) @ vectors.T
    assert positive_part(matrix) == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(matrix).max())


@pytest.mark.parametrize("factor", [0.0, 2.0, -2.0])
def test_multiples_of_the_identity(factor: float) -> None:
    assert np.array_equal(positive_part(factor * np.eye(2)), max(factor, 0.0) * np.eye(2))
