"""Inverse kinematics (5)-(11) and feedforward (14)-(15) against finite differences and independent models."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tulip_description.model import floating_model, joint_indices, sole_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.feedforward import distance_share, feedforward
from tulip_motion.gait import FootMotion
from tulip_motion.interface import Side
from tulip_motion.inverse_kinematics import (
    InverseKinematics,
    TaskTarget,
    error_rate_matrix,
    orientation_error,
    rotation_z,
    skew,
    solve_3,
)
from tulip_motion.motion import with_fixed_head

ROBOT = with_fixed_head(load_robot())
MODEL = floating_model(ROBOT)
LIMITS = ROBOT.position_limits[:, :12]
POSTURE = standing_posture(load_robot())
BASE = np.array([POSTURE.base_x, 0.0, POSTURE.base_height])
small_turns = st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))


def solver() -> InverseKinematics:
    kinematics = InverseKinematics(MODEL, 20.0, 20.0, 1e-9, LIMITS)
    kinematics.reset(np.eye(3), BASE, POSTURE.joint_positions[:12])
    return kinematics


def task_state(kinematics: InverseKinematics, stance: Side) -> tuple[np.ndarray, list[pin.SE3]]:
    """CoM, torso and other sole with the stance sole put where it was in the standing posture."""
    data = kinematics.data
    soles = [data.oMf[frame] for frame in kinematics.sole_frames]
    home = pin.SE3(np.eye(3), np.array([0.0, 0.12 if stance is Side.LEFT else -0.12, 0.0]))
    shift = home * soles[stance].inverse()
    return shift.act(data.com[0]), [shift * data.oMi[1], shift * soles[stance.other]]


@pytest.mark.parametrize("stance", Side)
def test_jacobian_agrees_with_finite_differences(stance: Side) -> None:
    rng = np.random.default_rng(1)
    kinematics = solver()
    kinematics.configuration[7:] += rng.uniform(-0.2, 0.2, 12)
    joints = kinematics.joint_positions.copy()
    kinematics.update_jacobian(stance)
    # Express everything in the frame of a level stance sole, as the paper does.
    level = kinematics.data.oMf[kinematics.sole_frames[stance]].rotation.T
    jacobian = np.kron(np.eye(4), level) @ kinematics.jacobian
    numeric = np.empty((12, 12))
    h = 1e-6
    for i in range(12):
        states = []
        for sign in (1.0, -1.0):
            kinematics.configuration[7:] = joints
            kinematics.configuration[7 + i] += sign * h
            kinematics.update_jacobian(stance)
            com, (torso, sole) = task_state(kinematics, stance)
            states.append((com, torso.copy(), sole.copy()))
        (com_p, torso_p, sole_p), (com_m, torso_m, sole_m) = states
        numeric[:3, i] = (com_p - com_m) / (2 * h)
        numeric[3:6, i] = pin.log3(torso_p.rotation @ torso_m.rotation.T) / (2 * h)
        numeric[6:9, i] = (sole_p.translation - sole_m.translation) / (2 * h)
        numeric[9:, i] = pin.log3(sole_p.rotation @ sole_m.rotation.T) / (2 * h)
    np.testing.assert_allclose(jacobian, numeric, atol=1e-8)  # central differences: h^2 and 1e-16 / h


@given(st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3), small_turns)
def test_cramers_rule_solves_as_numpy_does(right: list[float], turn: tuple[float, float, float]) -> None:
    matrix = pin.exp3(np.array(turn)) + 0.3 * np.eye(3)
    np.testing.assert_allclose(solve_3(matrix, np.array(right)), np.linalg.solve(matrix, right), atol=1e-12)


@given(small_turns, small_turns)
def test_orientation_error_and_its_matrix_agree_with_eqs_9_and_11_as_printed(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> None:
    desired, actual = pin.exp3(np.array(a)), pin.exp3(np.array(b))
    columns = [(desired[:, i], actual[:, i]) for i in range(3)]
    np.testing.assert_allclose(
        orientation_error(desired, actual), 0.5 * sum(np.cross(e, d) for d, e in columns), atol=1e-14
    )
    np.testing.assert_allclose(
        error_rate_matrix(desired, actual), -0.5 * sum(skew(d) @ skew(e) for d, e in columns), atol=1e-14
    )


def resting_target(com: np.ndarray, foot: Pose2D) -> TaskTarget:
    return TaskTarget(com, np.zeros(3), np.eye(3), np.zeros(3), FootMotion.resting(foot))


@settings(max_examples=15, deadline=None)
@given(
    st.floats(-0.05, 0.05), st.floats(-0.08, 0.08), st.floats(-0.04, 0.02), st.floats(-0.1, 0.1), st.floats(-0.3, 0.3)
)
def test_closed_loop_converges_on_reachable_targets_and_does_not_drift(
    x: float, y: float, z: float, step: float, yaw: float
) -> None:
    kinematics = solver()
    kinematics.update_jacobian(Side.LEFT)
    target = resting_target(kinematics.data.com[0] + [x, y, z], Pose2D(step, -0.13, yaw))
    for _ in range(400):
        kinematics.update_jacobian(Side.LEFT)
        kinematics.solve_velocity(target)
        kinematics.integrate(0.004, np.array([0.0, 0.12, 0.0]), 0.0)
    kinematics.update_jacobian(Side.LEFT)
    np.testing.assert_allclose(kinematics.data.com[0], target.com, atol=1e-5)
    np.testing.assert_allclose(kinematics.sole_positions[Side.RIGHT], target.foot.position, atol=1e-5)
    np.testing.assert_allclose(kinematics.sole_positions[Side.LEFT], [0.0, 0.12, 0.0], atol=1e-9)
    np.testing.assert_allclose(kinematics.data.oMf[kinematics.sole_frames[1]].rotation, rotation_z(yaw), atol=1e-5)


def test_unreachable_target_keeps_joints_finite_and_inside_their_ranges() -> None:
    kinematics = solver()
    target = resting_target(np.array([0.0, 0.0, 2.0]), Pose2D(1.5, -0.12, 0.0))
    for _ in range(500):
        kinematics.update_jacobian(Side.LEFT)
        kinematics.solve_velocity(target)
        kinematics.integrate(0.004, np.array([0.0, 0.12, 0.0]), 0.0)
    assert np.all(kinematics.joint_positions >= LIMITS[0]) and np.all(kinematics.joint_positions <= LIMITS[1])


@pytest.mark.parametrize("stance", Side)
def test_acceleration_level_solution_gives_the_wanted_task_acceleration(stance: Side) -> None:
    rng = np.random.default_rng(2)
    kinematics = solver()
    kinematics.configuration[7:] += rng.uniform(-0.1, 0.1, 12)
    joint_rates = rng.uniform(-1.0, 1.0, 12)
    wanted = rng.uniform(-3.0, 3.0, 12)
    kinematics.update_jacobian(stance)
    fixed = kinematics.sole_jacobians[stance]
    kinematics.velocity[6:] = joint_rates
    kinematics.velocity[:6] = -np.linalg.solve(fixed[:, :6], fixed[:, 6:] @ joint_rates)
    acceleration = kinematics.solve_acceleration(wanted)
    data = kinematics.data
    pin.forwardKinematics(MODEL, data, kinematics.configuration, kinematics.velocity, acceleration)
    pin.centerOfMass(MODEL, data, kinematics.configuration, kinematics.velocity, acceleration)
    other = kinematics.sole_frames[stance.other]
    sole = pin.getFrameClassicalAcceleration(MODEL, data, other, pin.LOCAL_WORLD_ALIGNED)
    np.testing.assert_allclose(data.acom[0], wanted[:3], atol=1e-6)
    np.testing.assert_allclose(sole.vector, wanted[6:], atol=1e-6)
    rest = pin.getFrameClassicalAcceleration(MODEL, data, kinematics.sole_frames[stance], pin.LOCAL_WORLD_ALIGNED)
    np.testing.assert_allclose(rest.vector, 0.0, atol=1e-8)


@pytest.mark.parametrize("stance", Side)
def test_feedforward_on_one_foot_is_the_inverse_dynamics_of_the_model_rooted_there(stance: Side) -> None:
    rng = np.random.default_rng(3)
    kinematics = solver()
    rates, accelerations = rng.uniform(-1.0, 1.0, 12), rng.uniform(-5.0, 5.0, 12)
    kinematics.update_jacobian(stance)
    fixed = kinematics.sole_jacobians[stance]
    kinematics.velocity[6:] = rates
    kinematics.velocity[:6] = -np.linalg.solve(fixed[:, :6], fixed[:, 6:] @ rates)
    pin.forwardKinematics(MODEL, kinematics.data, kinematics.configuration, kinematics.velocity, np.zeros(18))
    drift = pin.getFrameClassicalAcceleration(
        MODEL, kinematics.data, kinematics.sole_frames[stance], pin.LOCAL_WORLD_ALIGNED
    ).vector
    base = np.linalg.solve(fixed[:, :6], -drift - fixed[:, 6:] @ accelerations)
    aims = (np.array([0.04, 0.12, 0.0]), np.array([0.04, -0.12, 0.0]))
    torques = feedforward(
        MODEL,
        kinematics.data,
        kinematics.configuration,
        kinematics.velocity,
        np.concatenate([base, accelerations]),
        kinematics.sole_positions,
        kinematics.sole_jacobians,
        float(stance),
        aims,
    )
    rooted = sole_model(ROBOT, stance.name.lower())
    order = joint_indices(rooted, ROBOT)
    q, v, a = np.empty(12), np.empty(12), np.empty(12)
    q[order], v[order], a[order] = kinematics.joint_positions, rates, accelerations
    expected = pin.rnea(rooted, rooted.createData(), q, v, a)[order]
    np.testing.assert_allclose(torques, expected, atol=1e-8)


def test_feedforward_on_both_feet_needs_no_tilting_moment_at_the_ankles() -> None:
    kinematics = solver()
    kinematics.update_jacobian(Side.LEFT)
    zero = np.zeros(18)
    aims = (np.array([0.04, 0.12, 0.0]), np.array([0.04, -0.12, 0.0]))
    torques = feedforward(
        MODEL,
        kinematics.data,
        kinematics.configuration,
        zero,
        zero,
        kinematics.sole_positions,
        kinematics.sole_jacobians,
        0.5,
        aims,
    )
    # The feet weigh little and stand under their ankles: only their own CoM offset loads the roll axes.
    assert np.abs(torques[[5, 11]]).max() < 0.1


def test_eq_15_as_printed_blends_the_torques_of_the_models_rooted_in_either_foot() -> None:
    kinematics = solver()
    kinematics.update_jacobian(Side.LEFT)
    zero = np.zeros(18)
    alpha = 0.3
    torques = feedforward(
        MODEL,
        kinematics.data,
        kinematics.configuration,
        zero,
        zero,
        kinematics.sole_positions,
        kinematics.sole_jacobians,
        alpha,
    )
    expected = np.zeros(12)
    for side, share in ((Side.LEFT, 1.0 - alpha), (Side.RIGHT, alpha)):
        rooted = sole_model(ROBOT, side.name.lower())
        order = joint_indices(rooted, ROBOT)
        q = np.empty(12)
        q[order] = kinematics.joint_positions
        expected += share * pin.rnea(rooted, rooted.createData(), q, np.zeros(12), np.zeros(12))[order]
    np.testing.assert_allclose(torques, expected, atol=1e-8)


def test_alpha_from_distances_is_one_over_the_right_foot_and_zero_over_the_left() -> None:
    left, right = np.array([0.0, 0.12, 0.0]), np.array([0.0, -0.12, 0.0])
    assert distance_share(right, left, right) == 1.0
    assert distance_share(left, left, right) == 0.0
    assert distance_share(np.array([0.0, 0.0, 0.7]), left, right) == pytest.approx(0.5)
