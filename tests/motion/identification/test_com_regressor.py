"""Eq. (2) unreduced against Pinocchio's CoM, and the CoP against geometry."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import base_rotation, com_by_pinocchio

from tulip_description.model import Side
from tulip_description.robot import VARIANTS, load_robot
from tulip_motion.identification.com_regressor import ComRegressor, regressor_of, standard_parameters
from tulip_sim.secret_body import secret_body

SIDES = st.sampled_from(["left", "right"])
SEEDS = st.integers(0, 2**32 - 1)


@given(st.sampled_from(VARIANTS), SIDES, SEEDS)
def test_regressor_times_parameters_is_pinocchios_com_on_random_bodies_and_postures(
    variant: str, side: Side, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    robot = secret_body(load_robot(variant), rng, 0.9, 0.2)
    joints = rng.uniform(*robot.position_limits)
    found = regressor_of(load_robot(variant), side).com(joints) @ standard_parameters(robot)
    assert found == pytest.approx(com_by_pinocchio(robot, side, joints), abs=1e-12)


@given(SIDES, SEEDS)
def test_cop_lies_on_the_sole_below_the_com_along_gravity(side: Side, seed: int) -> None:
    robot, rng = load_robot(), np.random.default_rng(seed)
    joints = rng.uniform(*robot.position_limits)
    tilt = rng.uniform(-0.3, 0.3, 2)
    down = np.array([*tilt, -1.0]) / np.linalg.norm([*tilt, -1.0])
    rows = regressor_of(robot, side).cop(joints, base_rotation(robot, side, joints).T @ down).cop
    com = com_by_pinocchio(robot, side, joints)
    on_sole = com - down * com[2] / down[2]
    assert on_sole[2] == pytest.approx(0.0, abs=1e-12)
    assert rows @ standard_parameters(robot) == pytest.approx(on_sole[:2], abs=1e-12)


@given(SIDES, SEEDS)
def test_change_of_slope_by_the_imus_mounting_equals_finite_differences(side: Side, seed: int) -> None:
    robot, rng = load_robot(), np.random.default_rng(seed)
    joints = rng.uniform(-0.5, 0.5, 14)
    turn = base_rotation(robot, side, joints)
    down = turn.T @ np.array([0.0, 0.0, -1.0])
    found = regressor_of(robot, side).cop(joints, down).slope_change
    step = 1e-6
    for axis in range(2):
        angles = step * np.eye(3)[axis]
        ends = [turn @ pin.exp3(sign * angles) @ down for sign in (1.0, -1.0)]
        slopes = [end[:2] / end[2] for end in ends]
        assert found[:, axis] == pytest.approx((slopes[0] - slopes[1]) / (2.0 * step), abs=1e-8)


def test_shares_of_mass_add_up_to_1() -> None:
    assert standard_parameters(load_robot())[::4].sum() == pytest.approx(1.0, abs=1e-15)


def test_posture_of_another_length_and_unknown_side_are_refused() -> None:
    with pytest.raises(ValueError, match=r"joint_positions has shape \(12,\); expected \(14,\)"):
        regressor_of(load_robot(), "left").com(np.zeros(12))
    with pytest.raises(ValueError, match="side is 'middle'; expected left or right"):
        ComRegressor(load_robot(), "middle")  # type: ignore[arg-type]
