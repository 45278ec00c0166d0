"""Broken sensors are told from sound ones by their readings alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tulip_description.robot_io import Sensors
from tulip_motion.parameters import MotionParameters
from tulip_motion.sensor_check import SensorCheck

PARAMETERS = MotionParameters()
TICK = PARAMETERS.control_period
KNEE = 3


def readings(seconds: float, swing: float = 0.5, noise: bool = True) -> Iterator[Sensors]:
    """Yield what a leg reads whose knees swing once a second, on feet that carry."""
    rng = np.random.default_rng(1)
    for tick in range(round(seconds / TICK)):
        phase = 2.0 * math.pi * tick * TICK
        position, velocity = np.zeros(14), np.zeros(14)
        position[KNEE], velocity[KNEE] = swing * math.sin(phase), 2.0 * math.pi * swing * math.cos(phase)
        errors = rng.standard_normal(31) if noise else np.zeros(31)
        yield Sensors(
            stamp=round(tick * TICK * 1e9),
            joint_positions=position + 1e-4 * errors[:14],
            joint_velocities=velocity + 0.02 * errors[14:28],
            joint_efforts=np.zeros(14),
            imu_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
            imu_angular_velocity=0.005 * errors[28:],
            imu_linear_acceleration=np.array([0.0, 0.0, 9.81]),
            foot_cells=np.full((2, 4), 30.0),
        )


def test_nothing_is_said_of_sound_sensors() -> None:
    check = SensorCheck(PARAMETERS)
    assert {check.update(sensors) for sensors in readings(20.0)} == {""}
    assert check.dead_cells == ()


def test_an_encoder_that_sticks_is_named_when_its_joint_has_moved_by_little_more_than_the_limit() -> None:
    check, stuck = SensorCheck(PARAMETERS), 0.0
    for sensors in readings(5.0):
        if sensors.stamp < 1_000_000_000:
            stuck = float(sensors.joint_positions[KNEE])
            assert check.update(sensors) == ""
            continue
        position = sensors.joint_positions.copy()
        really, position[KNEE] = float(position[KNEE]), stuck
        if check.update(replace(sensors, joint_positions=position)):
            break
    assert abs(really - stuck) < 1.5 * PARAMETERS.encoder_check_limit
    # Known from now on, even if the joint rests.
    assert check.update(replace(sensors, stamp=sensors.stamp + 1)).startswith("the encoder of left_knee sticks")


def test_a_light_joint_that_chatters_faster_than_it_is_read_is_not_taken_for_a_stuck_one() -> None:
    check, rng = SensorCheck(PARAMETERS), np.random.default_rng(2)
    for sensors in readings(5.0, swing=0.0):
        position, velocity = sensors.joint_positions.copy(), sensors.joint_velocities.copy()
        position[5] = 2.0**-13 * round(1e-4 * rng.standard_normal() * 2**13)  # rests, but for noise
        velocity[5] = 0.5  # always read in the same phase
        assert check.update(replace(sensors, joint_positions=position, joint_velocities=velocity)) == ""


def test_a_frozen_imu_is_told_after_its_time_and_forgiven_when_it_reads_again() -> None:
    check, frozen = SensorCheck(PARAMETERS), np.array([0.01, -0.02, 0.003])
    told = [check.update(replace(sensors, imu_angular_velocity=frozen)) for sensors in readings(0.2)]
    first = next(index for index, words in enumerate(told) if words)
    assert first * TICK <= PARAMETERS.imu_check_time + TICK
    assert told[-1].startswith("the IMU is frozen")
    *_, last = readings(0.2)
    assert check.update(replace(last, stamp=last.stamp + 4_000_000)) == ""


def test_an_ideal_imu_at_rest_and_one_of_50_hz_are_not_frozen() -> None:
    ideal, slow = SensorCheck(PARAMETERS), SensorCheck(PARAMETERS)
    rates = np.zeros(3)
    for tick, sensors in enumerate(readings(2.0)):
        assert ideal.update(replace(sensors, imu_angular_velocity=np.zeros(3))) == ""
        rates = sensors.imu_angular_velocity if tick % 5 == 0 else rates
        assert slow.update(replace(sensors, imu_angular_velocity=rates)) == ""


def test_a_dead_cell_is_named_and_cells_of_a_foot_in_the_air_are_not() -> None:
    check = SensorCheck(PARAMETERS)
    cells = np.full((2, 4), 30.0)
    cells[0, 3], cells[1, :] = 0.0, 0.0
    for sensors in readings(PARAMETERS.cell_check_time + 0.1):
        assert check.update(replace(sensors, foot_cells=cells)) == ""
    assert check.dead_cells == ("left toe outer",)
    cells = cells.copy()
    cells[0, 3] = 5.0
    check.update(replace(sensors, stamp=sensors.stamp + 4_000_000, foot_cells=cells))
    assert check.dead_cells == ()


def test_readings_far_apart_say_nothing_about_encoders() -> None:
    check = SensorCheck(PARAMETERS)
    before, *_, after = readings(1.0)
    check.update(before)
    assert check.update(replace(after, joint_positions=before.joint_positions)) == ""
