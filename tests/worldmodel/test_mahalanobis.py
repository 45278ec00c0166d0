from __future__ import annotations

import numpy as np
import pytest

from tulip_worldmodel.mahalanobis import distances_and_determinants, gate


@pytest.mark.parametrize("dimension", [1, 2])
def test_distances_and_determinants_agree_with_a_solver(dimension: int) -> None:
    rng = np.random.default_rng(3)
    roots = rng.normal(size=(20, dimension, dimension)) + 2.0 * np.eye(dimension)
    spreads = roots @ roots.transpose(0, 2, 1)
    innovations = rng.normal(size=(20, dimension))
    distances, determinants = distances_and_determinants(innovations, spreads)
    expected = [
        innovation @ np.linalg.solve(spread, innovation)
        for innovation, spread in zip(innovations, spreads, strict=True)
    ]
    assert distances == pytest.approx(np.array(expected))
    assert determinants == pytest.approx(np.linalg.det(spreads))


def test_gate_lets_the_wanted_share_pass() -> None:
    drawn = np.random.default_rng(4).normal(size=(20000, 2))
    inside = np.mean((drawn**2).sum(axis=1) <= gate(0.9, 2))
    assert inside == pytest.approx(0.9, abs=0.01)
