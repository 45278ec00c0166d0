"""A body foretells postures that it was not fitted to, and an invented covariance is caught."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import Held, com_by_pinocchio, measure

from tulip_description.robot import load_robot
from tulip_motion.identification.body_comparison import base_values, com_rows, rms
from tulip_motion.identification.com_identification import ComIdentification, IdentificationSettings, identify_com
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.static_measurement import StaticMeasurement
from tulip_motion.identification.validation import Validation, validate
from tulip_sim.secret_body import secret_body

ROBOT = load_robot()
SETTINGS = IdentificationSettings()
Case = tuple[ComIdentification, list[StaticMeasurement]]


@pytest.fixture(scope="module")
def case(held: Held) -> Case:
    """Return a fit to three quarters of the postures, and the rest as measured on another day."""
    truth = secret_body(ROBOT, np.random.default_rng(5))
    fitted = [posture for index, posture in enumerate(held) if index % 4]
    found = identify_com(ROBOT, measure(truth, fitted, np.random.default_rng(1)))
    return found, measure(truth, held[::4], np.random.default_rng(2))


def check(found: ComIdentification, measurements: list[StaticMeasurement], values: np.ndarray) -> Validation:
    return validate(ROBOT, values, found.covariance, found.model_error, measurements, SETTINGS)


def test_identified_body_foretells_other_postures_ten_times_better_and_knows_how_well(case: Case) -> None:
    found, measurements = case
    result = check(found, measurements, found.values)
    assert result.rms < 0.1 * result.prior_rms
    assert not result.too_sure


def test_a_body_that_is_off_by_more_than_its_covariance_says_is_too_sure(case: Case) -> None:
    found, measurements = case
    shifted = found.values.copy()
    shifted[0] += 2e-3  # the trunk's CoM 2 mm forwards
    assert check(found, measurements, shifted).too_sure


def test_without_postures_there_is_nothing_to_validate_with(case: Case) -> None:
    with pytest.raises(IdentificationError, match="no postures"):
        check(case[0], [], case[0].values)


def test_rows_times_base_parameters_are_pinocchios_com() -> None:
    rng = np.random.default_rng(3)
    body = secret_body(ROBOT, rng)
    rows = com_rows(ROBOT, 4, np.random.default_rng(7))
    joints = np.random.default_rng(7).uniform(*ROBOT.position_limits, (4, len(ROBOT.joint_names)))
    for index, posture in enumerate(joints):
        com = com_by_pinocchio(body, ("left", "right")[index % 2], posture)
        assert rows[index] @ base_values(body) == pytest.approx(com[:2], abs=1e-12)


def test_rms_is_taken_axis_by_axis() -> None:
    assert rms(np.array([[3.0, 0.0], [-3.0, 2.0]])) == pytest.approx([3.0, np.sqrt(2.0)])
