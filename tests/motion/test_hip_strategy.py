"""The hip strategy: how far the torso gives way, and that the feet stay flat by it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.feedforward import Dynamics, inverse_dynamics
from tulip_motion.footsteps import Footstep
from tulip_motion.hip_strategy import turn_for_balance
from tulip_motion.interface import Side
from tulip_motion.inverse_kinematics import InverseKinematics
from tulip_motion.motion import with_fixed_head
from tulip_motion.parameters import MotionParameters
from tulip_motion.stabilizer import SupportArea

P = MotionParameters()
ROBOT = with_fixed_head(load_robot())
FEET = (Footstep(Side.LEFT, Pose2D(0.0, 0.14, 0.0)), Footstep(Side.RIGHT, Pose2D(0.0, -0.14, 0.0)))
ON_LEFT, ON_BOTH = SupportArea.of(P, FEET[0], None), SupportArea.of(P, *FEET)
AIM = (P.zmp_forward, FEET[0].pose.y)
WEIGHT = 226.0  # [N]


def wrench(x: float, y: float, force: float = WEIGHT) -> np.ndarray:
    """Return what the ground supplies through a ZMP [m]."""
    return np.array([0.0, 0.0, force, y * force, -x * force, 0.0])


def zmp_of(dynamics: Dynamics) -> Any:
    _, _, force, moment_x, moment_y, _ = dynamics.wrench
    return np.array([-moment_y, moment_x]) / force


def on_left_foot(task_acceleration: np.ndarray) -> Dynamics:
    """Return the dynamics of a robot at rest on both feet that accelerates."""
    posture = standing_posture(load_robot())
    kinematics = InverseKinematics(floating_model(ROBOT), 20.0, 20.0, ROBOT.position_limits[:, :12])
    kinematics.reset(np.eye(3), np.array([posture.base_x, 0.0, posture.base_height]), posture.joint_positions[:12])
    kinematics.update_jacobian(Side.LEFT)
    return inverse_dynamics(kinematics, np.zeros(18), kinematics.solve_acceleration(task_acceleration))


def test_inside_the_soles_the_torso_is_left_alone() -> None:
    assert turn_for_balance(wrench(AIM[0] + 0.05, AIM[1] - 0.05), ON_LEFT) == (0.0, 0.0)
    assert turn_for_balance(wrench(AIM[0], 0.0), ON_BOTH) == (0.0, 0.0)
    assert turn_for_balance(wrench(AIM[0], 0.0), ON_LEFT) != (0.0, 0.0)


def test_in_the_air_there_is_nothing_to_push_against() -> None:
    assert turn_for_balance(wrench(1.0, 1.0, force=1.0), ON_LEFT) == (0.0, 0.0)


@pytest.mark.parametrize("beyond", [(0.02, 0.0), (-0.02, 0.0), (0.0, 0.02), (0.0, -0.02), (0.02, -0.02)])
def test_the_torso_brings_the_zmp_back_to_the_edge_of_the_sole(beyond: tuple[float, float]) -> None:
    edge = np.array(AIM)
    for axis, (low, high) in enumerate(((P.zmp_limit_heel, P.zmp_limit_toe), (P.zmp_limit_side, P.zmp_limit_side))):
        edge[axis] += high if beyond[axis] > 0.0 else -low if beyond[axis] < 0.0 else 0.0
    foot = np.array([*edge, 0.0])
    rest = on_left_foot(np.zeros(12))
    # The CoM accelerates as a pendulum on a point beyond the edge; at rest its ZMP lies below it.
    acceleration = np.zeros(12)
    acceleration[:2] = 9.81 / 0.71 * (zmp_of(rest) - edge - beyond)
    asked = on_left_foot(acceleration)
    turn = turn_for_balance(asked.wrench, ON_LEFT)
    acceleration[3:5] = turn
    given = on_left_foot(acceleration)
    before, after = zmp_of(asked) - foot[:2], zmp_of(given) - foot[:2]
    moved = np.array(beyond) != 0.0
    assert np.all(np.abs(after[moved]) < 0.2 * np.abs(before[moved]))
    np.testing.assert_allclose(asked.wrench[:3], given.wrench[:3], atol=1e-6)  # the CoM is pushed as before


def test_no_more_is_given_up_than_the_greatest_lean() -> None:
    most = P.torso_stiffness * P.max_lean
    assert turn_for_balance(wrench(9.0, 9.0), ON_LEFT) == (-most, most)
    assert turn_for_balance(wrench(-9.0, -9.0), ON_LEFT) == (most, -most)
