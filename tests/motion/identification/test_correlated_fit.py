"""Least squares (D7) on made-up equations: exact without errors, honest with errors that last."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

from tulip_motion.identification.correlated_fit import Prior, Series, correlation_time, fit

TRUE = np.array([2.0, -1.0, 0.5, 3.0])
WIDE = Prior(np.zeros(4), 100.0 * np.eye(4))


def equations(rng: np.random.Generator, errors: np.ndarray, slow: float = 0.0) -> Series:
    """Return a series of two kinds of equations with errors (t, 2); their rows change as slowly as wanted."""
    design = lfilter([1.0], [1.0, -slow], rng.normal(size=(len(errors), 2, 4)), axis=0)
    return Series(design, design @ TRUE + errors)


def test_without_errors_the_parameters_are_exact() -> None:
    rng = np.random.default_rng(0)
    found = fit([equations(rng, np.zeros((80, 2))), equations(rng, np.zeros((40, 2)))], WIDE)
    np.testing.assert_allclose(found.parameters, TRUE, rtol=1e-9)
    assert found.learned == pytest.approx(4.0, abs=1e-6)


def test_what_no_equation_shows_keeps_its_prior() -> None:
    rng = np.random.default_rng(1)
    series = equations(rng, rng.normal(size=(100, 2)))
    blind = Series(series.design * np.array([1.0, 1.0, 1.0, 0.0]), series.target - series.design[..., 3] * TRUE[3])
    prior = Prior(np.array([0.0, 0.0, 0.0, 7.0]), np.diag([100.0, 100.0, 100.0, 4.0]))
    found = fit([blind], prior)
    assert found.parameters[3] == pytest.approx(7.0)
    assert found.covariance[3, 3] == pytest.approx(4.0)
    assert found.learned == pytest.approx(3.0, abs=0.01)


def test_covariance_is_honest_when_errors_and_rows_last_for_many_samples() -> None:
    rng, memory, trials = np.random.default_rng(2), 0.9, 60
    squares = []
    for _ in range(trials):
        errors = lfilter([1.0], [1.0, -memory], rng.normal(size=(2000, 2)), axis=0) * np.array([0.3, 1.0])
        found = fit([equations(rng, errors, slow=0.98)], WIDE)
        error = found.parameters - TRUE
        squares.append(float(error @ np.linalg.solve(found.covariance, error)))
    # Rows that are a little less slow than the errors make the stated covariance a little large.
    assert np.sum(squares) < chi2.ppf(0.999, 4 * trials)
    assert np.mean(squares) > 0.5 * 4


def test_correlation_time_is_that_of_a_known_process() -> None:
    rng, memory = np.random.default_rng(3), 0.8
    noise = lfilter([1.0], [1.0, -memory], rng.normal(size=100_000))
    assert correlation_time([noise]) == pytest.approx((1.0 + memory) / (1.0 - memory), rel=0.1)
    assert correlation_time([rng.normal(size=100_000)]) == pytest.approx(1.0, abs=0.1)


def test_too_few_samples_and_a_prior_without_doubt_are_refused() -> None:
    rng = np.random.default_rng(4)
    with pytest.raises(ValueError, match="20 samples; expected at least 50"):
        fit([equations(rng, np.zeros((20, 2)))], WIDE)
    with pytest.raises(ValueError, match="not positive definite"):
        fit([equations(rng, np.zeros((80, 2)))], Prior(np.zeros(4), np.diag([1.0, 1.0, 1.0, 0.0])))
