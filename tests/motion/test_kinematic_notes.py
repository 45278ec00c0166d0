"""Motion control says when inverse kinematics cannot do what it is asked."""

from __future__ import annotations

import numpy as np
import pytest

from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.gait import FootMotion
from tulip_motion.interface import MotionState, Side
from tulip_motion.inverse_kinematics import InverseKinematics, TaskTarget
from tulip_motion.motion import Motion, with_fixed_head
from tulip_motion.parameters import MotionParameters


def stand(com_height: float) -> MotionState:
    """Stand for four seconds on a robot that never moves; motion control brings its CoM to a height."""
    robot = load_robot()
    motion = Motion(MotionParameters(com_height=com_height), robot)
    posture = standing_posture(robot).joint_positions
    level = np.array([0.0, 0.0, 0.0, 1.0])
    sensors = Sensors(
        0, posture, np.zeros(14), np.zeros(14), level, np.zeros(3), np.array([0.0, 0.0, 9.81]), np.full((2, 4), 28.0)
    )
    for _ in range(1000):
        command = motion.tick(sensors)
        assert np.all(np.abs(command.velocity) <= robot.velocity_limits[:12])
    return motion.state()


def test_standing_as_usual_has_nothing_to_say() -> None:
    assert stand(MotionParameters().com_height).notes == ()


def test_com_above_the_reach_of_the_legs_is_told_by_the_inverse_kinematics() -> None:
    robot = with_fixed_head(load_robot())
    posture = standing_posture(load_robot())
    kinematics = InverseKinematics(floating_model(robot), 20.0, 20.0, robot.position_limits[:, :12])
    kinematics.reset(np.eye(3), np.array([0.0, 0.0, posture.base_height]), posture.joint_positions[:12])
    left, right = (sole.copy() for sole in kinematics.sole_positions)
    anchor, other = Pose2D(float(left[0]), float(left[1])), Pose2D(float(right[0]), float(right[1]))
    com = np.array([left[0] + 0.04, 0.5 * (left[1] + right[1]), 0.95])
    limits = load_robot().velocity_limits[:12] + 1e-9  # at a limit rounding remains
    target = TaskTarget(com, np.zeros(3), np.eye(3), np.zeros(3), FootMotion.resting(other))
    for _ in range(1000):
        kinematics.update_jacobian(Side.LEFT)
        kinematics.solve_velocity(target)
        assert np.all(np.abs(kinematics.joint_velocities) <= limits)
        kinematics.integrate(0.004, anchor)
    notes = kinematics.notes
    assert any(note.startswith("CoM target out of reach") for note in notes)
    assert any("knee" in note for note in notes)


def test_a_com_height_above_the_reach_of_the_legs_is_refused_with_the_highest_possible() -> None:
    with pytest.raises(ValueError, match=r"com_height is 0\.95 m; expected less than 0\.7\d\d m"):
        Motion(MotionParameters(com_height=0.95), load_robot())


def test_com_as_high_as_the_legs_permit_is_reached_though_near_a_singular_posture() -> None:
    notes = stand(0.765).notes
    assert notes and all(note.startswith("near a singular posture") for note in notes)
