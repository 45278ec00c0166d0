"""Clearance between the robot's parts."""

from __future__ import annotations

import numpy as np
import pytest

from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.identification.self_collision import SelfCollision

ROBOT = load_robot()
STANDING = standing_posture(ROBOT).joint_positions


def turned(**joints: float) -> np.ndarray:
    posture = STANDING.copy()
    for name, angle in joints.items():
        posture[ROBOT.joint_names.index(name)] = angle
    return posture


def test_standing_feet_are_as_far_apart_as_their_boxes():
    distance, _ = SelfCollision(ROBOT).clearance(STANDING)
    assert 0.0 < distance <= 0.24 - 0.15 + 1e-9  # soles 0.24 m apart, 0.15 m wide


@pytest.mark.parametrize(
    "joints",
    [
        {"left_hip_roll": -0.45, "right_hip_roll": 0.45},  # legs crossed
        {"left_hip_yaw": -1.0, "right_hip_yaw": 1.0},  # toes turned in, feet 0.24 m apart
    ],
)
def test_known_colliding_postures_have_no_clearance_and_name_both_legs(joints: dict[str, float]):
    distance, names = SelfCollision(ROBOT).clearance(turned(**joints))
    assert distance <= 0.0
    assert "left_" in names
    assert "right_" in names


def test_clearance_of_the_thighs_grows_with_the_angle_between_them():
    collision = SelfCollision(ROBOT)
    distances = [collision.clearance(turned(left_hip_roll=a, right_hip_roll=-a))[0] for a in (-0.2, -0.1, 0.0)]
    assert distances[0] < distances[1] < distances[2]


def test_what_the_head_does_makes_no_difference():
    collision = SelfCollision(ROBOT)
    moved, still = (collision.clearance(each)[0] for each in (turned(head_pan=1.0, head_tilt=0.5), STANDING))
    assert moved == pytest.approx(still, abs=1e-12)
