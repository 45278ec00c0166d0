"""What ends the experiment early."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tulip_description.robot import load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.identification.experiment_safety import SafetyParameters, Watch
from tulip_motion.identification.one_foot_control import BodyOnFeet
from tulip_motion.identification.passages import Doing, Passage
from tulip_motion.identification.weight_shift import weight_shift
from tulip_motion.interface import Side

ROBOT = load_robot()
LIFTED = weight_shift(ROBOT, "left").lift.points[-1]
HOLD = Passage(Doing.HOLD, Side.LEFT, None, 8.0)
TICKS = round(SafetyParameters().lasting / 0.004)


def on_the_left_foot(**changes: np.ndarray) -> Sensors:
    cells = np.zeros((2, 4))
    cells[0] = ROBOT.mass * 9.81 / 4.0
    sensors = Sensors(
        stamp=0,
        joint_positions=LIFTED.copy(),
        joint_velocities=np.zeros(14),
        joint_efforts=np.zeros(14),
        imu_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        imu_angular_velocity=np.zeros(3),
        imu_linear_acceleration=np.zeros(3),
        foot_cells=cells,
    )
    return replace(sensors, **changes)


def joints(index: int, angle: float) -> np.ndarray:
    changed = LIFTED.copy()
    changed[index] = angle
    return changed


def efforts(index: int, torque: float) -> np.ndarray:
    values = np.zeros(14)
    values[index] = torque
    return values


def cells(left: list[float], right: list[float]) -> np.ndarray:
    return np.array([left, right])


def faults(sensors: Sensors, ticks: int) -> list[str]:
    watch, body = Watch(ROBOT, SafetyParameters(), 0.004), BodyOnFeet(ROBOT, 0.1)
    body.update(sensors, Side.LEFT)
    return [watch.fault(sensors, body, HOLD, LIFTED) for _ in range(ticks)]


def test_a_robot_that_stands_well_has_no_fault():
    assert set(faults(on_the_left_foot(), 3 * TICKS)) == {""}


@pytest.mark.parametrize(
    ("sensors", "words"),
    [
        (on_the_left_foot(joint_positions=joints(3, 2.45)), "left_knee reads 2.45 rad, out of its range"),
        (on_the_left_foot(joint_positions=joints(8, -0.3)), "right_hip_pitch is 0.37 rad away"),
        (on_the_left_foot(joint_efforts=efforts(5, -24.5)), "left_ankle_roll takes 24 N m, its limit"),
        (on_the_left_foot(imu_orientation=np.array([np.sin(0.1), 0.0, 0.0, np.cos(0.1)])), "leans 0.20 rad more"),
        (on_the_left_foot(foot_cells=cells([10.0] * 4, [0.0] * 4)), "the feet carry 40 N"),
        (on_the_left_foot(foot_cells=cells([0.0, 0.0, 110.0, 110.0], [0.0] * 4)), "10 mm from the edge"),
        (on_the_left_foot(foot_cells=cells([55.0] * 4, [7.0] * 4)), "touches something with 28 N"),
    ],
)
def test_each_sign_counts_when_it_has_lasted_and_is_told_in_words(sensors: Sensors, words: str):
    found = faults(sensors, TICKS)
    assert set(found[:-1]) == {""}
    assert words in found[-1]


@pytest.mark.parametrize(
    ("change", "falls"),
    [
        (lambda: on_the_left_foot(), False),
        (lambda: on_the_left_foot(imu_orientation=np.array([0.0, np.sin(0.2), 0.0, np.cos(0.2)])), True),
        (lambda: on_the_left_foot(imu_angular_velocity=np.array([0.0, 6.0, 0.0])), True),
    ],
    ids=["stands", "sole lost", "turns over"],
)
def test_a_fall_is_a_lost_sole_or_a_trunk_that_turns_over(change: Callable[[], Sensors], falls: bool):
    sensors = change()
    body = BodyOnFeet(ROBOT, 0.1)
    body.update(sensors, Side.LEFT)
    assert Watch(ROBOT, SafetyParameters(), 0.004).is_falling(sensors, body) == falls
