"""Joints that give all the torque they have."""

from __future__ import annotations

import numpy as np
import pytest

from tulip_description.robot import JOINTS, load_robot
from tulip_motion.saturation import Saturation

ROBOT = load_robot()


def test_joints_at_their_limit_are_named_with_their_share_and_counted_anew_after_that() -> None:
    saturation = Saturation(ROBOT)
    for reading in range(10):
        efforts = 0.9 * ROBOT.effort_limits
        efforts[JOINTS.index("left_knee")] = -ROBOT.effort_limits[JOINTS.index("left_knee")]
        if reading < 3:
            efforts[JOINTS.index("right_ankle_pitch")] = ROBOT.effort_limits[JOINTS.index("right_ankle_pitch")]
        saturation.add(efforts)
    assert saturation.take() == {"left_knee": 1.0, "right_ankle_pitch": pytest.approx(0.3)}
    assert saturation.take() == {}


def test_a_single_peak_of_a_second_is_not_worth_a_word() -> None:
    saturation = Saturation(ROBOT)
    saturation.add(ROBOT.effort_limits)
    for _ in range(49):
        saturation.add(np.zeros(len(JOINTS)))
    assert saturation.take() == {}
