"""Reduction of eq. (2) to independent columns: how many, which, and always the same."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from synthetic import com_by_pinocchio

from tulip_description.model import Side
from tulip_description.robot import VARIANTS, load_robot
from tulip_motion.identification.base_parameters import base_parameters, preference, reduce_columns
from tulip_motion.identification.com_regressor import ComRegressor, standard_parameters
from tulip_motion.motion import with_fixed_head
from tulip_sim.secret_body import secret_body

ROBOT = load_robot()


def stacked(seed: int) -> np.ndarray:
    """Return x and y rows of 100 random postures on both feet."""
    rng = np.random.default_rng(seed)
    left, right = ComRegressor(ROBOT, "left"), ComRegressor(ROBOT, "right")
    return np.vstack([foot.com(rng.uniform(*ROBOT.position_limits))[:2] for foot in (left, right) for _ in range(50)])


@pytest.mark.parametrize(("robot", "joints"), [(ROBOT, 14), (load_robot("table"), 12), (with_fixed_head(ROBOT), 12)])
def test_trunk_gives_three_moments_each_joint_two_and_all_masses_one(robot: object, joints: int) -> None:
    assert len(base_parameters(robot).names) == 3 + 2 * joints + 1  # type: ignore[arg-type]


@given(st.sampled_from(VARIANTS), st.sampled_from(["left", "right"]), st.integers(0, 2**32 - 1))
def test_reduced_rows_times_base_parameters_give_pinocchios_com_in_all_three_axes(
    variant: str, side: Side, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    robot = secret_body(load_robot(variant), rng)
    base = base_parameters(load_robot(variant))
    joints = rng.uniform(*robot.position_limits)
    rows = base.rows(ComRegressor(robot, side).com(joints))
    found = rows @ (base.combinations @ standard_parameters(robot))
    assert found == pytest.approx(com_by_pinocchio(robot, side, joints), abs=1e-12)


@given(st.integers(0, 2**32 - 1), st.randoms(use_true_random=False))
def test_columns_in_another_order_and_other_postures_give_the_same_combinations(seed: int, random: object) -> None:
    expected = base_parameters(ROBOT)
    stack = stacked(seed)
    order = list(range(stack.shape[1]))
    random.shuffle(order)  # type: ignore[attr-defined]
    place = {column: index for index, column in enumerate(order)}
    found = reduce_columns(stack[:, order], [place[column] for column in preference(ROBOT)])
    assert tuple(order[column] for column in found.columns) == expected.columns
    back = found.combinations[:, [place[column] for column in range(len(order))]]
    np.testing.assert_allclose(back, expected.combinations, atol=1e-10)


def test_bodies_that_differ_in_no_base_parameter_have_their_com_at_one_place() -> None:
    base, rng = base_parameters(ROBOT), np.random.default_rng(3)
    hidden = scipy.linalg.null_space(base.combinations)
    assert hidden.shape[1] == 4 * len(ROBOT.links) - len(base.names)
    other = standard_parameters(ROBOT) + 0.1 * hidden @ rng.standard_normal(hidden.shape[1])
    for side in ("left", "right"):
        joints = rng.uniform(*ROBOT.position_limits)
        com = ComRegressor(ROBOT, side).com(joints) @ other
        assert com == pytest.approx(com_by_pinocchio(ROBOT, side, joints), abs=1e-12)


def test_combinations_are_named_by_what_they_sum() -> None:
    names = base_parameters(load_robot("table")).names
    assert "m c_z(left_shank) - 0.32 m(left_ankle_axle, left_foot)" in names
    assert "m c_z(left_thigh) - 0.275 m(left_shank and below)" in names
    assert "m c_x(left_ankle_axle) + m c_x(left_foot)" in names
    assert names[-1] == "m(base_link) + m(left_hip_motor and below, right_hip_motor and below)"


def test_a_column_that_is_barely_independent_is_not_taken_for_either() -> None:
    columns = np.random.default_rng(0).standard_normal((20, 3))
    columns[:, 2] = columns[:, 0] * (1.0 + 1e-9) + 1e-9 * columns[:, 1]
    assert len(reduce_columns(columns, (0, 1, 2)).columns) == 2
