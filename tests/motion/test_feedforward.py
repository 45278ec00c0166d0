"""Feedforward (14)-(15) against the inverse dynamics of models rooted in the feet."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from tulip_description.model import floating_model, joint_indices, sole_model
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.feedforward import distance_share, feedforward, inverse_dynamics
from tulip_motion.interface import Side
from tulip_motion.inverse_kinematics import InverseKinematics
from tulip_motion.motion import with_fixed_head

ROBOT = with_fixed_head(load_robot())
MODEL = floating_model(ROBOT)
POSTURE = standing_posture(load_robot())
BASE = np.array([POSTURE.base_x, 0.0, POSTURE.base_height])


def solver() -> InverseKinematics:
    kinematics = InverseKinematics(MODEL, 20.0, 20.0, ROBOT.position_limits[:, :12])
    kinematics.reset(np.eye(3), BASE, POSTURE.joint_positions[:12])
    return kinematics


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
    dynamics = inverse_dynamics(kinematics, kinematics.velocity, np.concatenate([base, accelerations]))
    torques = feedforward(kinematics, dynamics, float(stance), aims)
    rooted = sole_model(ROBOT, stance.name.lower())
    order = joint_indices(rooted, ROBOT)
    q, v, a = np.empty(12), np.empty(12), np.empty(12)
    q[order], v[order], a[order] = kinematics.joint_positions, rates, accelerations
    expected = pin.rnea(rooted, rooted.createData(), q, v, a)[order]
    np.testing.assert_allclose(torques, expected, atol=1e-8)


def test_feedforward_on_both_feet_needs_no_tilting_moment_at_the_ankles() -> None:
    kinematics = solver()
    kinematics.update_jacobian(Side.LEFT)
    aims = (np.array([0.04, 0.12, 0.0]), np.array([0.04, -0.12, 0.0]))
    torques = feedforward(kinematics, inverse_dynamics(kinematics, np.zeros(18), np.zeros(18)), 0.5, aims)
    # The feet weigh little and stand under their ankles: only their own CoM offset loads the roll axes.
    assert np.abs(torques[[5, 11]]).max() < 0.1


def test_eq_15_as_printed_blends_the_torques_of_the_models_rooted_in_either_foot() -> None:
    kinematics = solver()
    kinematics.update_jacobian(Side.LEFT)
    alpha = 0.3
    torques = feedforward(kinematics, inverse_dynamics(kinematics, np.zeros(18), np.zeros(18)), alpha)
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
