from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tulip_description.robot import load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.state_estimator import Sole
from tulip_motion.tilt_filter import TiltFilter

PERIOD = 0.004


def sensors_with(orientation: Rotation, rate: np.ndarray) -> Sensors:
    number = len(load_robot().moving)
    return Sensors(
        stamp=0,
        joint_positions=np.zeros(number),
        joint_velocities=np.zeros(number),
        joint_efforts=np.zeros(number),
        imu_orientation=orientation.as_quat(),
        imu_angular_velocity=rate,
        imu_linear_acceleration=np.zeros(3),
        foot_cells=np.zeros((2, 4)),
    )


def soles_of(true: Rotation, believed: Rotation) -> tuple[Sole, Sole]:
    """Soles flat on the ground, as a body that takes its IMU's attitude for true sees them."""
    sole = Sole((0.0, 0.0, 0.0), (believed * true.inv()).as_matrix().tolist())
    return sole, sole


def tilt_error(found: np.ndarray, true: Rotation) -> float:
    return float(np.degrees(np.linalg.norm(found[2] - true.as_matrix()[2])))


@pytest.mark.parametrize("left_weight", [0.0, 0.5, 1.0])
def test_mounting_error_and_noise_leave_a_hundredth_of_a_degree_after_two_seconds(left_weight):
    rng = np.random.default_rng(3)
    mounting = Rotation.from_euler("xyz", [0.004, -0.003, 0.0])
    tilt = TiltFilter(PERIOD, 2.0, 0.01)
    for tick in range(500):
        swing = 0.05 * np.sin(6.0 * tick * PERIOD)
        true = Rotation.from_euler("xyz", [swing, 0.02, 0.7])
        rate = np.array([0.3 * np.cos(6.0 * tick * PERIOD), 0.0, 0.0])
        noise = Rotation.from_rotvec(0.001 * rng.standard_normal(3))
        believed = true * mounting * noise
        tilt.update(
            sensors_with(believed, rate), believed.as_matrix(), soles_of(true, believed), (115.0, 115.0), left_weight
        )
    assert tilt_error(believed.as_matrix(), true) > 0.2  # what a single reading is off
    assert tilt_error(tilt.corrected(believed.as_matrix()), true) < 0.03


def test_a_foot_that_hardly_carries_teaches_nothing():
    mounting = Rotation.from_euler("xyz", [0.005, 0.0, 0.0])
    tilt = TiltFilter(PERIOD, 2.0, 0.01)
    for _ in range(500):
        tilt.update(
            sensors_with(mounting, np.zeros(3)),
            mounting.as_matrix(),
            soles_of(Rotation.identity(), mounting),
            (200.0, 20.0),
            0.5,
        )
    assert tilt_error(tilt.corrected(mounting.as_matrix()), mounting) < 1e-9


def test_heading_stays_and_the_result_is_a_rotation():
    believed = Rotation.from_euler("xyz", [0.05, 0.1, 2.0]).as_matrix()
    tilt = TiltFilter(PERIOD, 2.0, 0.01)
    level = Rotation.from_euler("xyz", [0.052, 0.098, 2.0])
    tilt.update(sensors_with(level, np.zeros(3)), believed, soles_of(level, level), (0.0, 0.0), 0.5)
    found = tilt.corrected(believed)
    assert found @ found.T == pytest.approx(np.eye(3), abs=1e-12)
    assert found[2] == pytest.approx(level.as_matrix()[2], abs=1e-12)
    assert np.arctan2(found[1, 0], found[0, 0]) == pytest.approx(np.arctan2(believed[1, 0], believed[0, 0]), abs=1e-3)


def test_lying_on_the_ground_nothing_is_corrected():
    lying = Rotation.from_euler("xyz", [0.0, 1.4, 0.0])
    tilt = TiltFilter(PERIOD, 2.0, 0.01)
    tilt.update(sensors_with(lying, np.zeros(3)), lying.as_matrix(), soles_of(lying, lying), (0.0, 0.0), 0.5)
    assert tilt.corrected(lying.as_matrix()) == pytest.approx(lying.as_matrix())
