"""The simulated sensors without physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.robot import load_robot
from tulip_sim.parameters import SensorParameters, WorldParameters
from tulip_sim.sensors import BodyState, SensorModel, cell_forces

ROBOT = load_robot()
EXACT = WorldParameters.exact().sensors


def state(
    stamp: int = 0, rpy: tuple[float, float, float] = (0, 0, 0), velocity: tuple[float, float, float] = (0, 0, 0),
    angular: tuple[float, float, float] = (0, 0, 0),
) -> BodyState:  # fmt: skip
    rotation = pin.rpy.rpyToMatrix(*rpy)
    return BodyState(
        stamp=stamp,
        joint_positions=np.linspace(-0.3, 0.4, 14),
        joint_velocities=np.zeros(14),
        joint_efforts=np.zeros(14),
        base_position=np.zeros(3),
        base_orientation=pin.Quaternion(rotation).coeffs(),
        base_rotation=rotation,
        base_linear_velocity=np.array(velocity, dtype=float),
        base_angular_velocity=np.array(angular, dtype=float),
        foot_cells=np.full((2, 4), 28.3),
    )


@given(
    st.lists(
        st.tuples(st.floats(-0.05, 0.14), st.floats(-0.065, 0.065), st.floats(1.0, 300.0)), min_size=1, max_size=6
    ),
    st.sampled_from([0, 1]),
)
def test_cells_keep_force_and_cop_inside_their_rectangle(contacts: list[tuple[float, float, float]], side: int) -> None:
    foot = ROBOT.feet[side]
    forces = np.array(cell_forces(foot, contacts))
    loads = np.array([force for _, _, force in contacts])
    assert forces.sum() == pytest.approx(loads.sum())
    cop = forces @ np.array(foot.cells) / forces.sum()
    expected = loads @ np.array([(x, y) for x, y, _ in contacts]) / loads.sum()
    np.testing.assert_allclose(cop, expected, atol=1e-9)


def test_contact_outside_the_cells_loads_the_nearest_ones_fully() -> None:
    assert cell_forces(ROBOT.feet[0], [(0.149, -0.075, 100.0)]) == [0.0, 0.0, 100.0, 0.0]  # left toe, inner corner
    assert cell_forces(ROBOT.feet[1], [(0.149, -0.075, 100.0)]) == [0.0, 0.0, 0.0, 100.0]  # right toe, outer corner


def test_imu_at_rest_reads_gravity_upwards_in_its_own_axes() -> None:
    model = SensorModel(ROBOT, EXACT, np.random.default_rng(0), state())
    reading = model.measure(state(stamp=4_000_000, rpy=(0.0, 0.3, 0.0)))
    np.testing.assert_allclose(
        reading.imu_linear_acceleration, 9.81 * np.array([-np.sin(0.3), 0.0, np.cos(0.3)]), atol=1e-12
    )


def test_accelerometer_averages_over_the_period_and_feels_the_lever_arm() -> None:
    model = SensorModel(ROBOT, EXACT, np.random.default_rng(0), state())
    reading = model.measure(state(stamp=4_000_000, velocity=(0.0, 0.02, 0.0), angular=(0.0, 0.1, 0.0)))
    x, _, z = ROBOT.imu.origin
    expected = np.array([0.1 * z / 0.004, 5.0, -0.1 * x / 0.004 + 9.81])
    np.testing.assert_allclose(reading.imu_linear_acceleration, expected, atol=1e-9)


def test_orientation_is_relative_to_the_heading_at_the_start() -> None:
    start = state(rpy=(0.0, 0.0, 2.0))
    model = SensorModel(ROBOT, EXACT, np.random.default_rng(0), start)
    rotation = pin.Quaternion(*model.measure(start).imu_orientation[[3, 0, 1, 2]]).toRotationMatrix()
    np.testing.assert_allclose(rotation, np.eye(3), atol=1e-12)
    turned = model.measure(state(rpy=(0.1, 0.2, 2.5))).imu_orientation
    rotation = pin.Quaternion(*turned[[3, 0, 1, 2]]).toRotationMatrix()
    np.testing.assert_allclose(pin.rpy.matrixToRpy(rotation), [0.1, 0.2, 0.5], atol=1e-12)


def test_yaw_drifts_at_a_constant_rate_and_roll_and_pitch_do_not() -> None:
    p = replace(EXACT, yaw_drift=0.01)
    model = SensorModel(ROBOT, p, np.random.default_rng(3), state())
    angles = []
    for seconds in (10, 20):
        q = model.measure(state(stamp=seconds * 10**9)).imu_orientation
        angles.append(pin.rpy.matrixToRpy(pin.Quaternion(*q[[3, 0, 1, 2]]).toRotationMatrix()))
    assert angles[1][2] == pytest.approx(2 * angles[0][2])
    assert abs(angles[0][2]) > 0.001
    np.testing.assert_allclose(np.array(angles)[:, :2], 0.0, atol=1e-12)


def test_noise_has_the_given_spread_and_values_the_given_resolution() -> None:
    p = SensorParameters(encoder_noise=0.002, encoder_step=1e-3, cell_noise=3.0, cell_step=0.5)
    model = SensorModel(ROBOT, p, np.random.default_rng(0), state())
    readings = [model.measure(state(stamp=4_000_000 * k)) for k in range(1, 1500)]
    positions = np.array([reading.joint_positions for reading in readings])
    assert np.std(positions - state().joint_positions) == pytest.approx(np.hypot(0.002, 1e-3 / np.sqrt(12)), rel=0.03)
    np.testing.assert_allclose(positions / 1e-3, np.round(positions / 1e-3), atol=1e-6)
    cells = np.array([reading.foot_cells for reading in readings])
    assert np.std(cells) == pytest.approx(np.hypot(3.0, 0.5 / np.sqrt(12)), rel=0.03)
    gyro = np.array([reading.imu_angular_velocity for reading in readings])
    assert np.std(gyro, axis=0) == pytest.approx(np.full(3, p.gyro_noise), rel=0.06)


def test_cells_never_pull() -> None:
    model = SensorModel(ROBOT, SensorParameters(cell_noise=5.0), np.random.default_rng(0), state())
    empty = replace(state(), foot_cells=np.zeros((2, 4)))
    assert min(model.measure(replace(empty, stamp=k)).foot_cells.min() for k in range(50)) == 0.0


@pytest.mark.parametrize(("name", "value"), [("gyro_noise", -1.0), ("yaw_drift", np.inf), ("period", 0)])
def test_sensor_parameters_are_checked(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} is {value}"):
        SensorParameters(**{name: value})
