from __future__ import annotations

import numpy as np
import pytest

from tulip_worldmodel.rolling import rest, slowed, slowing


def test_ball_comes_to_rest_where_and_when_small_steps_bring_it() -> None:
    position, velocity, seconds = np.zeros(2), np.array([1.2, -0.9]), 0.0
    where, when = rest(position, velocity, 0.3)
    while np.any(velocity):
        after = np.array(slowed(*velocity.tolist(), 0.3 * 1e-3))
        position = position + 0.5e-3 * (velocity + after)
        velocity, seconds = after, seconds + 1e-3
    assert where == pytest.approx(position, abs=2e-3)
    assert when == pytest.approx(seconds, abs=2e-3)


@pytest.mark.parametrize(
    ("velocity", "spread"), [((2.0, 0.5), 0.1), ((0.1, 0.0), 0.2), ((0.0, 0.0), 0.5), ((0.3, -0.3), 0.05)]
)
def test_moments_after_friction_are_those_of_a_cloud_of_balls(velocity: tuple[float, float], spread: float) -> None:
    covariance = spread**2 * np.array([[1.0, 0.3], [0.3, 0.6]])
    before = np.random.default_rng(0).multivariate_normal(velocity, covariance, 200_000)
    cloud = before * np.maximum(0.0, 1.0 - 0.3 * 0.1 / np.linalg.norm(before, axis=1))[:, None]
    found = slowing(np.array(velocity), covariance, 0.3, 0.1)
    mean = found.keep @ velocity + found.drop
    after = found.keep @ covariance @ found.keep.T + found.noise
    assert mean == pytest.approx(cloud.mean(axis=0), abs=0.005)
    assert after == pytest.approx(np.cov(cloud.T), abs=0.15 * spread**2)


def test_velocity_known_exactly_loses_exactly_what_friction_takes() -> None:
    found = slowing(np.array([3.0, 4.0]), np.zeros((2, 2)), 0.3, 1.0)
    assert found.keep @ [3.0, 4.0] + found.drop == pytest.approx([2.82, 3.76], abs=1e-6)
