"""Inverse kinematics (5)-(11) against finite differences, the printed definitions, and its own inverse."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.gait import FootMotion
from tulip_motion.interface import Side
from tulip_motion.inverse_kinematics import (
    MAX_ORIENTATION_ERROR,
    MAX_POSITION_ERROR,
    InverseKinematics,
    TaskTarget,
    angular_rate,
    error_rate_matrix,
    linear_rate,
    orientation_error,
    rotation_z,
    skew,
    turn_from_yaw,
)
from tulip_motion.motion import with_fixed_head

ROBOT = with_fixed_head(load_robot())
MODEL = floating_model(ROBOT)
LIMITS = ROBOT.position_limits[:, :12]
SPEED_LIMITS = ROBOT.velocity_limits[:12]
POSTURE = standing_posture(load_robot())
BASE = np.array([POSTURE.base_x, 0.0, POSTURE.base_height])
FEET = (Pose2D(0.0, 0.12, 0.0), Pose2D(0.0, -0.12, 0.0))
DT = 0.004
small_turns = st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
rates = st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3)


def solver() -> InverseKinematics:
    kinematics = InverseKinematics(MODEL, 20.0, 20.0, LIMITS)
    kinematics.reset(np.eye(3), BASE, POSTURE.joint_positions[:12])
    return kinematics


def anchor(kinematics: InverseKinematics, stance: Side) -> None:
    """Put the stance sole where it was in the standing posture, level, whatever the joints are."""
    kinematics.velocity[:] = 0.0
    kinematics.update_jacobian(stance)
    kinematics.integrate(0.0, FEET[stance])
    kinematics.update_jacobian(stance)


def task(kinematics: InverseKinematics, stance: Side) -> tuple[np.ndarray, pin.SE3, pin.SE3]:
    """CoM, torso and other sole of the configuration, by functions that the solver does not use."""
    data = MODEL.createData()
    pin.framesForwardKinematics(MODEL, data, kinematics.configuration)
    com = pin.centerOfMass(MODEL, data, kinematics.configuration)
    return com, data.oMf[MODEL.getFrameId("base_link")], data.oMf[kinematics.sole_frames[stance.other]]


def follow(kinematics: InverseKinematics, stance: Side, target: TaskTarget, ticks: int) -> None:
    for _ in range(ticks):
        kinematics.update_jacobian(stance)
        kinematics.solve_velocity(target)
        kinematics.integrate(DT, FEET[stance])
    kinematics.update_jacobian(stance)


def resting_target(com: np.ndarray, foot: Pose2D, torso: np.ndarray | None = None) -> TaskTarget:
    return TaskTarget(com, np.zeros(3), np.eye(3) if torso is None else torso, np.zeros(3), FootMotion.resting(foot))


@pytest.mark.parametrize("stance", Side)
@pytest.mark.parametrize("seed", range(6))
def test_jacobian_of_a_random_posture_agrees_with_finite_differences(stance: Side, seed: int) -> None:
    rng = np.random.default_rng([seed, stance])
    kinematics = solver()
    joints = rng.uniform(LIMITS[0], LIMITS[1])
    kinematics.configuration[7:] = joints
    anchor(kinematics, stance)
    jacobian, base = kinematics.jacobian, kinematics.configuration[:7].copy()
    numeric = np.empty((12, 12))
    h = 1e-6
    for i in range(12):
        states = []
        for sign in (1.0, -1.0):
            kinematics.configuration[:7] = base
            kinematics.configuration[7:] = joints
            kinematics.configuration[7 + i] += sign * h
            # The sole is put back by hand: the limits of integrate() would undo the difference.
            data = MODEL.createData()
            pin.framesForwardKinematics(MODEL, data, kinematics.configuration)
            home = pin.SE3(np.eye(3), np.array([FEET[stance].x, FEET[stance].y, 0.0]))
            moved = home * data.oMf[kinematics.sole_frames[stance]].inverse() * data.oMi[1]
            kinematics.configuration[:7] = pin.SE3ToXYZQUAT(moved)
            states.append(task(kinematics, stance))
        (com_p, torso_p, sole_p), (com_m, torso_m, sole_m) = states
        numeric[:3, i] = (com_p - com_m) / (2 * h)
        numeric[3:6, i] = pin.log3(torso_p.rotation @ torso_m.rotation.T) / (2 * h)
        numeric[6:9, i] = (sole_p.translation - sole_m.translation) / (2 * h)
        numeric[9:, i] = pin.log3(sole_p.rotation @ sole_m.rotation.T) / (2 * h)
    np.testing.assert_allclose(jacobian, numeric, atol=1e-8)  # central differences: h^2 and 1e-16 / h


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


@given(small_turns, small_turns, rates)
def test_orientation_rows_of_eq_10_are_what_inverting_l_gives(
    a: tuple[float, float, float], b: tuple[float, float, float], wanted: list[float]
) -> None:
    desired, actual = pin.exp3(np.array(a)), pin.exp3(np.array(b))
    assume(np.linalg.norm(pin.log3(desired @ actual.T)) < 0.99 * MAX_ORIENTATION_ERROR)
    matrix, error = error_rate_matrix(desired, actual), orientation_error(desired, actual)
    expected = np.linalg.solve(matrix, matrix.T @ wanted + 20.0 * error)
    np.testing.assert_allclose(angular_rate((actual @ desired.T).tolist(), wanted, 20.0), expected, atol=1e-11)


@given(small_turns, small_turns, rates, rates)
def test_l_is_the_rate_of_the_orientation_error(
    a: tuple[float, float, float], b: tuple[float, float, float], wanted: list[float], real: list[float]
) -> None:
    # e_o' = L^T w_d - L w_e, eq. (11), which is why eq. (10) makes e_o decay
    desired, actual, h = pin.exp3(np.array(a)), pin.exp3(np.array(b)), 1e-5
    w_d, w_e = np.array(wanted), np.array(real)
    after, before = (
        orientation_error(pin.exp3(t * w_d) @ desired, pin.exp3(t * w_e) @ actual) for t in (0.5 * h, -0.5 * h)
    )
    matrix = error_rate_matrix(desired, actual)
    np.testing.assert_allclose((after - before) / h, matrix.T @ w_d - matrix @ w_e, atol=1e-7)  # h^2 w^3


@given(st.floats(-4.0, 4.0), small_turns)
def test_turn_from_yaw_is_the_product_of_the_rotations(yaw: float, turn: tuple[float, float, float]) -> None:
    actual = pin.exp3(np.array(turn))
    np.testing.assert_allclose(turn_from_yaw(yaw, actual), actual @ rotation_z(yaw).T, atol=1e-15)


@given(st.floats(1.01, np.pi - 1e-6), rates.filter(lambda axis: np.linalg.norm(axis) > 0.1))
def test_orientation_feedback_is_bounded_and_turns_the_shorter_way(angle: float, axis: list[float]) -> None:
    direction = np.array(axis) / np.linalg.norm(axis)
    rate = np.array(angular_rate(pin.exp3(-angle * direction).tolist(), (0.0, 0.0, 0.0), 20.0))
    np.testing.assert_allclose(rate, 20.0 * np.tan(MAX_ORIENTATION_ERROR) * direction, atol=1e-4)  # log3 near pi


@given(rates, rates)
def test_position_feedback_points_at_the_target_and_is_bounded(desired: list[float], actual: list[float]) -> None:
    error = np.array(desired) - np.array(actual)
    length = float(np.linalg.norm(error))
    rate = np.array(linear_rate(np.array(desired), np.array(actual), np.ones(3), 20.0)) - 1.0
    expected = 20.0 * error * min(1.0, MAX_POSITION_ERROR / length) if length > 0.0 else np.zeros(3)
    np.testing.assert_allclose(rate, expected, atol=1e-12)


@settings(max_examples=15)
@given(
    st.floats(-0.05, 0.05), st.floats(-0.08, 0.08), st.floats(-0.04, 0.02), st.floats(-0.1, 0.1), st.floats(-0.3, 0.3)
)
def test_closed_loop_converges_on_reachable_targets_and_does_not_drift(
    x: float, y: float, z: float, step: float, yaw: float
) -> None:
    kinematics = solver()
    kinematics.update_jacobian(Side.LEFT)
    target = resting_target(kinematics.data.com[0] + [x, y, z], Pose2D(step, -0.13, yaw))
    follow(kinematics, Side.LEFT, target, 400)
    np.testing.assert_allclose(kinematics.data.com[0], target.com, atol=1e-5)
    np.testing.assert_allclose(kinematics.sole_positions[Side.RIGHT], target.foot.position, atol=1e-5)
    np.testing.assert_allclose(kinematics.sole_positions[Side.LEFT], [0.0, 0.12, 0.0], atol=1e-9)
    np.testing.assert_allclose(kinematics.data.oMf[kinematics.sole_frames[1]].rotation, rotation_z(yaw), atol=1e-5)
    assert kinematics.notes == ()


def levelled(joints: np.ndarray, stance: Side) -> np.ndarray:
    """Turn the other ankle such that its sole is level, as targets of feet are, above a level stance sole."""
    kinematics = solver()
    kinematics.configuration[7:] = joints
    anchor(kinematics, stance)
    _, _, sole = task(kinematics, stance)
    pitch, roll = 6 * stance.other + 4, 6 * stance.other + 5
    turn = pin.exp3(np.array([0.0, joints[pitch], 0.0])) @ pin.exp3(np.array([joints[roll], 0.0, 0.0]))
    up_in_shank = (sole.rotation @ turn.T)[2]  # must become R_y(pitch) R_x(roll) e_z
    result = joints.copy()
    result[pitch], result[roll] = np.arctan2(up_in_shank[0], up_in_shank[2]), -np.arcsin(up_in_shank[1])
    return result


@settings(max_examples=25)
@given(
    st.sampled_from(Side),
    st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12),
    st.lists(st.floats(-0.08, 0.08), min_size=12, max_size=12),
)
def test_inverse_of_forward_kinematics_gives_the_posture_back(
    stance: Side, spread: list[float], start: list[float]
) -> None:
    # Postures with bent knees: through a straight one the solution could change over to the other bend.
    centre = POSTURE.joint_positions[:12]
    posture = levelled(centre + np.tile([0.3, 0.2, 0.3, 0.3, 0.3, 0.2], 2) * spread, stance)
    assume(np.all(posture > LIMITS[0] + 0.1) and np.all(posture < LIMITS[1] - 0.1))
    kinematics = solver()
    kinematics.configuration[7:] = posture
    anchor(kinematics, stance)
    com, torso, sole = task(kinematics, stance)
    yaw = float(np.arctan2(sole.rotation[1, 0], sole.rotation[0, 0]))
    np.testing.assert_allclose(sole.rotation, rotation_z(yaw), atol=1e-12)
    foot = FootMotion(sole.translation, np.zeros(3), np.zeros(3), yaw)
    target = TaskTarget(com, np.zeros(3), torso.rotation, np.zeros(3), foot)
    kinematics.configuration[7:] = posture + start
    anchor(kinematics, stance)
    follow(kinematics, stance, target, 600)
    np.testing.assert_allclose(kinematics.joint_positions, posture, atol=1e-5)


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
    data = MODEL.createData()
    pin.forwardKinematics(MODEL, data, kinematics.configuration, kinematics.velocity, acceleration)
    pin.centerOfMass(MODEL, data, kinematics.configuration, kinematics.velocity, acceleration)
    other = kinematics.sole_frames[stance.other]
    sole = pin.getFrameClassicalAcceleration(MODEL, data, other, pin.LOCAL_WORLD_ALIGNED)
    torso = pin.getFrameClassicalAcceleration(MODEL, data, MODEL.getFrameId("base_link"), pin.LOCAL_WORLD_ALIGNED)
    np.testing.assert_allclose(data.acom[0], wanted[:3], atol=1e-6)
    np.testing.assert_allclose(torso.angular, wanted[3:6], atol=1e-6)
    np.testing.assert_allclose(sole.vector, wanted[6:], atol=1e-6)
    rest = pin.getFrameClassicalAcceleration(MODEL, data, kinematics.sole_frames[stance], pin.LOCAL_WORLD_ALIGNED)
    np.testing.assert_allclose(rest.vector, 0.0, atol=1e-8)


@pytest.mark.parametrize("stance", Side)
def test_solved_velocities_leave_the_stance_sole_at_rest_and_move_the_task_as_asked(stance: Side) -> None:
    rng = np.random.default_rng([3, stance])
    kinematics = solver()
    anchor(kinematics, stance)
    com, torso, sole = task(kinematics, stance)
    velocities = rng.uniform(-0.3, 0.3, (3, 3))
    foot = FootMotion(sole.translation, velocities[1], np.zeros(3), 0.0, 0.4)
    kinematics.solve_velocity(TaskTarget(com, velocities[0], torso.rotation, velocities[2], foot))
    data, q, v = MODEL.createData(), kinematics.configuration, kinematics.velocity
    pin.forwardKinematics(MODEL, data, q, v)
    pin.centerOfMass(MODEL, data, q, v)
    frame_velocities = [
        pin.getFrameVelocity(MODEL, data, frame, pin.LOCAL_WORLD_ALIGNED)
        for frame in (kinematics.sole_frames[stance], kinematics.sole_frames[stance.other])
    ]
    np.testing.assert_allclose(frame_velocities[0].vector, 0.0, atol=1e-12)
    np.testing.assert_allclose(frame_velocities[1].linear, velocities[1], atol=1e-5)  # the standing sole, level to 1e-7
    np.testing.assert_allclose(frame_velocities[1].angular, [0.0, 0.0, 0.4], atol=1e-5)
    np.testing.assert_allclose(data.vcom[0], velocities[0], atol=1e-5)


def unreachable_targets() -> dict[str, TaskTarget]:
    com = np.array([0.04, 0.0, 0.7])
    return {
        "CoM too high": resting_target(np.array([0.04, 0.0, 1.0]), FEET[Side.RIGHT]),
        "CoM far ahead": resting_target(np.array([1.04, 0.0, 0.7]), FEET[Side.RIGHT]),
        "foot too far ahead": resting_target(com, Pose2D(1.5, -0.12, 0.0)),
        "foot too far sideways": resting_target(com, Pose2D(0.0, -1.5, 0.0)),
        "foot and CoM far away": resting_target(np.array([0.0, 0.0, 2.0]), Pose2D(1.5, -0.12, 0.0)),
        "foot turned round": resting_target(com, Pose2D(0.0, -0.12, 3.0)),
        "torso upside down": resting_target(com, FEET[Side.RIGHT], pin.exp3(np.array([np.pi, 0.0, 0.0]))),
    }


@pytest.mark.parametrize("name", unreachable_targets())
def test_unreachable_target_is_reported_while_joints_keep_their_ranges_and_speeds(name: str) -> None:
    kinematics, target = solver(), unreachable_targets()[name]
    for _ in range(750):
        kinematics.update_jacobian(Side.LEFT)
        kinematics.solve_velocity(target)
        kinematics.integrate(DT, FEET[Side.LEFT])
        assert np.all(np.abs(kinematics.joint_velocities) <= SPEED_LIMITS * (1.0 + 1e-12))
        assert np.all(kinematics.joint_positions >= LIMITS[0]) and np.all(kinematics.joint_positions <= LIMITS[1])
    assert any("out of reach" in note for note in kinematics.notes)


@pytest.mark.parametrize("name", ["CoM too high", "foot too far ahead", "foot too far sideways", "foot turned round"])
def test_unreachable_target_brings_the_body_to_rest_as_near_as_it_comes(name: str) -> None:
    kinematics, target = solver(), unreachable_targets()[name]
    follow(kinematics, Side.LEFT, target, 1500)
    before = kinematics.joint_positions.copy()
    follow(kinematics, Side.LEFT, target, 250)
    assert np.abs(kinematics.joint_positions - before).max() < 0.02  # [rad] in a second


@pytest.mark.parametrize("stance", Side)
def test_straight_legs_are_reported_and_a_reachable_target_leads_out_of_them(stance: Side) -> None:
    kinematics = solver()
    com = kinematics_com(kinematics)
    kinematics.configuration[7:] = 0.0  # both knees straight
    anchor(kinematics, stance)
    for _ in range(20):  # the estimate of the singular value takes some ticks from a cold start
        kinematics.update_jacobian(stance)
    assert kinematics.singular_value < 1e-3
    assert any("singular" in note and "knee" in note for note in kinematics.notes)
    target = resting_target(com, FEET[stance.other])
    for _ in range(1000):
        kinematics.update_jacobian(stance)
        kinematics.solve_velocity(target)
        kinematics.integrate(DT, FEET[stance])
        assert np.all(np.abs(kinematics.joint_velocities) <= SPEED_LIMITS * (1.0 + 1e-12))
    kinematics.update_jacobian(stance)
    np.testing.assert_allclose(kinematics.data.com[0], com, atol=1e-3)
    assert kinematics.notes == ()


def kinematics_com(kinematics: InverseKinematics) -> np.ndarray:
    com: np.ndarray = pin.centerOfMass(MODEL, MODEL.createData(), kinematics.configuration).copy()
    return com


@settings(max_examples=40)
@given(st.sampled_from(Side), st.integers(0, 2**32 - 1))
def test_estimated_singular_value_settles_on_the_real_one(stance: Side, seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinematics = solver()
    kinematics.configuration[7:] = rng.uniform(LIMITS[0], LIMITS[1])
    for _ in range(60):
        kinematics.update_jacobian(stance)
    values = np.linalg.svd(kinematics.jacobian, compute_uv=False)
    assume(values[-2] > 1.2 * values[-1])
    assert kinematics.singular_value == pytest.approx(values[-1], rel=1e-3, abs=1e-4)


@settings(max_examples=60)
@given(st.sampled_from(Side), st.integers(0, 2**32 - 1))
def test_no_posture_and_no_target_asks_for_more_than_the_joints_speed(stance: Side, seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinematics = solver()
    kinematics.configuration[7:] = rng.uniform(LIMITS[0], LIMITS[1]) * rng.integers(0, 2, 12)
    anchor(kinematics, stance)
    target = resting_target(
        rng.normal(0.0, 2.0, 3), Pose2D(*rng.normal(0.0, 2.0, 3)), pin.exp3(rng.normal(0.0, 2.0, 3))
    )
    kinematics.solve_velocity(target)
    assert np.all(np.abs(kinematics.joint_velocities) <= SPEED_LIMITS * (1.0 + 1e-12))
