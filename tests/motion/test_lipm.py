"""The pendulum: eq. (3) and DCM plans."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_motion.lipm import DcmPlan, LipmState, advance_lipm, orbital_energy, time_constant

TC = time_constant(0.71)
coordinates = st.floats(-1.0, 1.0)


@given(coordinates, coordinates, coordinates, st.floats(0.0, 1.0))
def test_orbital_energy_is_conserved(position: float, velocity: float, zmp: float, dt: float) -> None:
    before = LipmState(position, velocity)
    after = advance_lipm(before, zmp, TC, dt)
    scale = 1.0 + after.velocity**2  # exact solution: only rounding of the terms that cancel remains
    assert orbital_energy(after, zmp, TC) == pytest.approx(orbital_energy(before, zmp, TC), abs=1e-11 * scale)


def test_advance_agrees_with_eq_3_as_printed() -> None:
    state = advance_lipm(LipmState(0.03, -0.2), 0.0, TC, 0.3)
    assert state.position == pytest.approx(0.03 * math.cosh(0.3 / TC) + TC * -0.2 * math.sinh(0.3 / TC), rel=1e-14)


def test_negative_time_is_refused_with_the_value() -> None:
    with pytest.raises(ValueError, match=r"dt is -0\.1 s"):
        advance_lipm(LipmState(0.0, 0.0), 0.0, TC, -0.1)


def test_time_constant_refuses_a_height_that_is_not_positive() -> None:
    with pytest.raises(ValueError, match="com_height"):
        time_constant(0.0)


def test_dcm_of_a_plan_obeys_its_differential_equation_and_ends_on_the_last_zmp() -> None:
    plan = DcmPlan([0.0, 0.1, 0.5, 0.6, 1.0], [(0, 0), (0.1, 0.12), (0.1, 0.12), (0.3, -0.12), (0.3, -0.12)], TC)
    h = 1e-6
    for time in (0.05, 0.3, 0.55, 0.8):
        zmp, dcm = plan.evaluate(time)
        _, later = plan.evaluate(time + h)
        _, earlier = plan.evaluate(time - h)
        rate = (np.array(later) - earlier) / (2 * h)
        # Central differences of a smooth function: error h^2 plus rounding 1e-16 / h.
        np.testing.assert_allclose(rate, (np.array(dcm) - zmp) / TC, atol=1e-8)
    assert plan.evaluate(1.0) == ((0.3, -0.12), (0.3, -0.12))
    assert plan.evaluate(9.0) == ((0.3, -0.12), (0.3, -0.12))


def test_dcm_of_a_plan_is_continuous_at_its_knots() -> None:
    plan = DcmPlan([0.0, 0.2, 0.6, 0.7], [(0, 0), (0, 0.1), (0, 0.1), (0.2, -0.1)], TC)
    for knot in (0.2, 0.6):
        np.testing.assert_allclose(plan.evaluate(knot - 1e-9)[1], plan.evaluate(knot + 1e-9)[1], atol=1e-7)


def test_plan_refuses_times_that_do_not_increase() -> None:
    with pytest.raises(ValueError, match="do not increase"):
        DcmPlan([0.0, 0.0], [(0, 0), (0, 0)], TC)
