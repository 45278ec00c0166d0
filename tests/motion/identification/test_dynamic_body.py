"""From what motion told to a body file: the combinations of static identification, with honest errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2
from synthetic_motion import changed, still_rows

from tulip_description.model import floating_model
from tulip_description.robot import load_robot
from tulip_motion.identification.body_comparison import base_values, com_rows, rms
from tulip_motion.identification.dynamic_body import MovingCom, com_of
from tulip_motion.identification.dynamic_identification import DynamicIdentification, identify_dynamics
from tulip_motion.identification.physical_consistency import most_probable_body
from tulip_motion.identification.zmp_regressor import ZmpRegressor, parameters_of

BELIEVED = load_robot()
TRUE = changed(BELIEVED, np.random.default_rng(11))


@pytest.fixture(scope="module")
def identified() -> DynamicIdentification:
    return identify_dynamics(ZmpRegressor(BELIEVED), [still_rows(TRUE, np.random.default_rng(1), 60, 1.0)])


@pytest.fixture(scope="module")
def found(identified: DynamicIdentification) -> MovingCom:
    return com_of(identified)


def test_bodies_of_the_robot_file_have_its_base_parameters(identified: DynamicIdentification) -> None:
    exact = DynamicIdentification(
        BELIEVED,
        parameters_of(floating_model(TRUE)),
        identified.cells,
        identified.covariance,
        (),
        identified.fit,
    )
    assert com_of(exact).values == pytest.approx(base_values(TRUE), abs=1e-12)
    assert com_of(exact).mass == pytest.approx(TRUE.mass)


def test_covariance_of_base_parameters_is_honest_and_that_of_the_whole_mass_zero(found: MovingCom) -> None:
    error = (found.values - base_values(TRUE))[found.base.unknown]
    square = float(error @ np.linalg.solve(found.covariance[found.base.unknown, found.base.unknown], error))
    assert square < chi2.ppf(0.999, len(error))
    assert found.values[-1] == pytest.approx(1.0) and found.covariance[-1] == pytest.approx(0.0, abs=1e-15)


def test_most_probable_body_has_the_com_that_motion_told(found: MovingCom) -> None:
    body = most_probable_body(found).robot
    rows = com_rows(BELIEVED, 200, np.random.default_rng(1))
    before, after = (rms(rows @ (base_values(each) - base_values(TRUE))) for each in (BELIEVED, body))
    assert (after < 1e-3).all() and (after < 0.1 * before).all()
    assert body.mass == pytest.approx(TRUE.mass, rel=0.005)
