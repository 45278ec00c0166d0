"""Motion control says when inverse kinematics cannot do what it is asked."""

from __future__ import annotations

import numpy as np

from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.interface import MotionState
from tulip_motion.motion import Motion
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


def test_com_above_the_reach_of_the_legs_is_told() -> None:
    notes = stand(0.95).notes
    assert any(note.startswith("CoM target out of reach") for note in notes)
    assert any("knee" in note for note in notes)
