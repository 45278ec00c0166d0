"""Bodies that can be, (D9)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from tulip_description.model import floating_model
from tulip_description.robot import load_robot
from tulip_motion.identification.inertial_prior import inertial_prior
from tulip_motion.identification.realizable_parameters import can_be, log_cholesky, most_probable_bodies
from tulip_motion.identification.zmp_regressor import parameters_of

BELIEVED = parameters_of(floating_model(load_robot()))
PRIOR = inertial_prior(load_robot())


def test_logarithms_give_the_body_back() -> None:
    for body in BELIEVED.reshape(-1, 10):
        again = pin.LogCholeskyParameters(log_cholesky(body)).toDynamicParameters()
        np.testing.assert_allclose(again, body, atol=1e-12)


def test_a_body_cannot_have_negative_mass_or_a_moment_greater_than_the_other_two() -> None:
    ball = np.array([2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0])
    assert can_be(ball)
    assert not can_be(-ball)
    assert not can_be(ball * [1, 1, 1, 1, 2.1, 1, 1, 1, 1, 1])
    assert not can_be(
        ball + np.array([0, 2, 0, 0, 0, 0, 0, 0, 0, 0])
    )  # so far a CoM asks for more moment about the joint
    with pytest.raises(ValueError, match="no body has the parameters"):
        log_cholesky(-ball)


def test_possible_bodies_stay_and_an_impossible_one_gives_way_where_it_is_doubtful() -> None:
    assert most_probable_bodies(BELIEVED, PRIOR.covariance, BELIEVED) is BELIEVED
    wrong = BELIEVED.copy()
    thigh = slice(30, 40)
    wrong[39] = 0.05  # Izz, more than Ixx and Iyy, which differ by less than that from one another
    assert not can_be(wrong[thigh])
    known = PRIOR.covariance.copy()
    known[30, :] *= 1e-3  # its mass is well known
    known[:, 30] *= 1e-3
    found = most_probable_bodies(wrong, known, BELIEVED)
    assert all(can_be(body) for body in found.reshape(-1, 10))
    deviations = np.sqrt(np.diag(PRIOR.covariance))
    assert abs(found[30] - wrong[30]) < 0.01 * deviations[30]
    assert found[39] != pytest.approx(wrong[39])
    np.testing.assert_allclose(found[:10], wrong[:10], atol=0.01)  # another body
