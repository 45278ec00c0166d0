"""The ZMP equation (D1)-(D5) against Pinocchio's inverse dynamics."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from synthetic_motion import changed, swaying_log

from tulip_description.model import floating_model
from tulip_description.robot import load_robot
from tulip_motion.identification.zmp_regressor import (
    PARAMETER_NAMES,
    BodyMotion,
    Ground,
    ZmpRegressor,
    horizontal_axes,
    parameters_of,
    with_parameters,
)

ROBOT = load_robot()
REGRESSOR = ZmpRegressor(ROBOT)


@pytest.mark.parametrize("seed", range(5))
def test_regressor_times_parameters_is_the_ground_wrench_of_rnea_moved_to_the_cop(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = changed(ROBOT, rng)
    model = floating_model(true)
    q = np.concatenate([rng.normal(size=3), pin.Quaternion(pin.exp3(rng.normal(size=3))).coeffs(), rng.normal(size=14)])
    v, a = rng.normal(size=20), rng.normal(size=20)
    expected = pin.rnea(model, model.createData(), q, v, a)
    rotation = pin.Quaternion(q[3:7]).matrix()
    up, cop = rotation[2], rng.normal(size=3)
    felt = a[:3] + np.cross(v[3:6], v[:3]) + 9.81 * up
    motion = BodyMotion(q[7:], v[6:], a[6:], v[3:6], a[3:6], felt)
    parameters = parameters_of(model)
    np.testing.assert_allclose(REGRESSOR.inverse_dynamics(motion) @ parameters, expected, rtol=0.0, atol=1e-10)

    ground = Ground(up, horizontal_axes(up), cop, cop, np.zeros((3, 2)), 1.0)
    moment = np.cross(up, expected[3:6] - np.cross(cop, expected[:3]))
    rows = REGRESSOR.rows(motion, ground) @ parameters
    forward, left = ground.horizontal
    np.testing.assert_allclose(rows, [forward @ moment, left @ moment, up @ expected[:3]], rtol=0.0, atol=1e-10)


def test_zmp_of_a_robot_at_rest_lies_below_its_com() -> None:
    true = changed(ROBOT, np.random.default_rng(1))
    model = floating_model(true)
    q = np.random.default_rng(2).uniform(*true.position_limits)
    up, still, none = np.array([0.0, 0.0, 1.0]), np.zeros(14), np.zeros(3)
    ground = Ground(up, horizontal_axes(up), none, none, np.zeros((3, 2)), 1.0)
    rows = REGRESSOR.rows(BodyMotion(q, still, still, none, none, 9.81 * up), ground)
    x, y, force = rows @ parameters_of(model)
    com = pin.centerOfMass(model, model.createData(), np.concatenate([[0, 0, 0, 0, 0, 0, 1], q]))
    np.testing.assert_allclose([x / force, y / force], com[:2], atol=1e-12)
    assert force == pytest.approx(9.81 * true.mass)


def test_cells_of_both_feet_count_as_one_cop() -> None:
    q = np.zeros(14)  # straight legs: soles level, hips 0.26738 m apart
    cells = np.array([[10.0, 10.0, 30.0, 30.0], [0.0, 0.0, 20.0, 20.0]])
    ground = REGRESSOR.ground(q, np.array([0.0, 0.0, 1.0]), cells)
    (left, right), _ = REGRESSOR.soles(q)
    heel, toe = ROBOT.feet[0].cells[0][0], ROBOT.feet[0].cells[2][0]
    assert ground.force == 120.0
    np.testing.assert_allclose(ground.soles, (80.0 * left + 40.0 * right) / 120.0, atol=1e-12)
    assert ground.cop[0] - left[0] == pytest.approx((20.0 * heel + 100.0 * toe) / 120.0)
    assert ground.cop[1] == pytest.approx((80.0 * left[1] + 40.0 * right[1]) / 120.0)


def test_spreads_make_up_for_cells_that_sit_too_far_in() -> None:
    spreads = (0.11, 0.15)
    log = swaying_log(ROBOT, seconds=2.0, joint_amplitude=0.02, trunk_amplitude=0.0, spreads=spreads)
    posture, up = log.joint_positions[0], log.base_rotations[0][2]
    ground = REGRESSOR.ground(posture, up, log.foot_cells[0])
    none = np.zeros(3)
    motion = BodyMotion(posture, np.zeros(14), np.zeros(14), none, none, 9.81 * up)
    away = (REGRESSOR.rows(motion, ground) @ parameters_of(floating_model(ROBOT)))[:2] / ground.force
    assert np.abs(away).max() > 5e-3  # [m]
    np.testing.assert_allclose(away, ground.horizontal @ ground.ways @ spreads, atol=1e-9)


def test_parameters_go_into_a_model_and_out_again() -> None:
    parameters = parameters_of(floating_model(changed(ROBOT, np.random.default_rng(4))))
    assert len(parameters) == len(PARAMETER_NAMES) * len(REGRESSOR.body_names)
    np.testing.assert_allclose(
        parameters_of(with_parameters(floating_model(ROBOT), parameters)), parameters, atol=1e-12
    )
