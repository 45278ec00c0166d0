"""What the fit's scale hangs on: the weight, and not the size of the moments' errors."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_motion import changed, still_rows, swaying_log

from tulip_description.model import floating_model
from tulip_description.robot import load_robot
from tulip_motion.identification.dynamic_identification import GAIN_ERROR, identify_dynamics
from tulip_motion.identification.inertial_prior import inertial_prior
from tulip_motion.identification.zmp_regressor import ZmpRegressor, parameters_of
from tulip_motion.identification.zmp_rows import ZmpRows, zmp_rows

BELIEVED = load_robot()
TRUE = changed(BELIEVED, np.random.default_rng(11))
REGRESSOR = ZmpRegressor(BELIEVED)


@pytest.fixture(scope="module")
def moving() -> ZmpRows:
    return zmp_rows(REGRESSOR, swaying_log(TRUE))


@pytest.mark.parametrize("force_error", [0.0, 5.0])
def test_long_still_recordings_weigh_the_robot_as_the_cells_do(force_error: float) -> None:
    # Errors of the force that last leave the moments' equations alone, and those fit best without any mass.
    rows = still_rows(TRUE, np.random.default_rng(1), 40, force_error)
    mass, deviation = identify_dynamics(REGRESSOR, [rows]).mass
    assert mass == pytest.approx(rows.force.mean() / 9.81, rel=1e-3)
    assert abs(mass - TRUE.mass) < 3.0 * deviation < 0.5


def test_noise_of_the_cop_does_not_make_the_robot_lighter(moving: ZmpRows) -> None:
    # 3 mm on each axis, twice what squats leave.
    rng, horizontal = np.random.default_rng(2), moving.rows.copy()
    for axis in range(2):
        horizontal[:, axis] -= rng.normal(scale=3e-3, size=len(moving.force))[:, None] * moving.rows[:, 2]
    found = identify_dynamics(REGRESSOR, [moving._replace(rows=horizontal)])
    assert found.mass[0] == pytest.approx(TRUE.mass, rel=0.5 * GAIN_ERROR)


def test_error_of_the_zmp_does_not_depend_on_the_scale_and_neither_do_its_equations(moving: ZmpRows) -> None:
    parameters = np.append(parameters_of(floating_model(TRUE)), [0.1, 0.1, 0.0])
    heavier = parameters * np.append(np.full(150, 1.7), np.ones(3))
    np.testing.assert_allclose(moving.error(heavier), moving.error(parameters), atol=1e-12)
    near = moving.equations(parameters)
    predicted = (near.design @ heavier - near.target)[:, :2]
    np.testing.assert_allclose(predicted, moving.error(parameters), atol=1e-12)


def test_linear_equations_are_those_of_the_zmp_to_first_order(moving: ZmpRows) -> None:
    parameters = np.append(parameters_of(floating_model(TRUE)), [0.1, 0.1, 0.0])
    deviations = np.sqrt(np.diag(inertial_prior(BELIEVED).covariance))
    step = 1e-5 * np.append(np.random.default_rng(3).normal(size=150) * deviations, [0.1, -0.1, 0.0])
    near = moving.equations(parameters)
    expected = (moving.error(parameters + step) - moving.error(parameters - step)) / 2.0
    np.testing.assert_allclose((near.design @ step)[:, :2], expected, atol=1e-10)
    np.testing.assert_allclose((near.design @ parameters - near.target)[:, :2], moving.error(parameters), atol=1e-12)
