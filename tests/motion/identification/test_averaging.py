"""Means of held postures and how sure they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from tulip_description.robot import load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.identification.averaging import (
    AveragingParameters,
    HoldAverage,
    StillnessGate,
    correlation_time,
    covariance_of_mean,
)

ROBOT = load_robot()
PERIOD = 0.004
CELLS = np.array(ROBOT.feet[0].cells)


def reading(tick: int, forces: np.ndarray, joint_speed: float = 0.0, turning: float = 0.0) -> Sensors:
    cells = np.zeros((2, 4))
    cells[0] = forces
    return Sensors(
        stamp=tick * 4_000_000,
        joint_positions=np.full(14, 0.1),
        joint_velocities=np.full(14, joint_speed),
        joint_efforts=np.zeros(14),
        imu_orientation=np.array([0.0, np.sin(0.1), 0.0, np.cos(0.1)]),  # leans forward by 0.2 rad
        imu_angular_velocity=np.full(3, turning),
        imu_linear_acceleration=np.zeros(3),
        foot_cells=cells,
    )


def coloured(rng: np.random.Generator, number: int, memory: float) -> np.ndarray:
    """Return (number, 2) readings, each of which remembers a share of the one before; variance 1."""
    white = rng.standard_normal((number + 500, 2)) @ np.array([[1.0, 0.6], [0.0, 0.8]])
    return lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], white, axis=0)[500:]


@pytest.mark.parametrize(("memory", "tau"), [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)])
def test_correlation_time_of_a_known_process(memory: float, tau: float):
    values = coloured(np.random.default_rng(0), 20_000, memory)[:, 0]
    assert correlation_time(values - values.mean()) == pytest.approx(tau, rel=0.2)  # (1 + a) / (1 - a)


@pytest.mark.parametrize(("memory", "number"), [(0.0, 300), (0.5, 300), (0.9, 1500)])
def test_covariance_of_the_mean_is_honest_on_correlated_noise(memory: float, number: int):
    rng = np.random.default_rng(1)
    errors, claimed = [], []
    for _ in range(600):
        values = coloured(rng, number, memory)
        errors.append(values.mean(axis=0))
        claimed.append(covariance_of_mean(values))
    actual, said = np.cov(np.array(errors).T), np.mean(claimed, axis=0)
    assert said == pytest.approx(actual, rel=0.2, abs=0.1 * actual[0, 0])
    # The inverse of a covariance that is estimated from few independent readings makes the mean of NEES exceed 2.
    nees = np.mean([e @ np.linalg.solve(c, e) for e, c in zip(errors, claimed, strict=True)])
    assert 1.7 < nees < 2.6


def test_means_are_those_of_the_readings():
    rng = np.random.default_rng(2)
    average = HoldAverage(ROBOT, "left")
    forces = np.array([40.0, 50.0, 60.0, 75.0])
    for tick in range(300):
        average.add(reading(tick, forces + rng.normal(0.0, 1.0, 4)))
    found = average.measurement()
    cop = forces @ CELLS / forces.sum()
    sigma = np.sqrt(np.diag(found.cop_covariance))
    assert (np.abs(found.cop - cop) < 4.0 * sigma).all()
    # sqrt(4) cells of 1 N on arms of 0.095 and 0.065 m, 300 readings
    expected = np.array([0.095, 0.065]) * 2.0 / forces.sum() / np.sqrt(300)
    assert sigma == pytest.approx(expected, rel=0.25)
    assert found.normal_force == pytest.approx(forces.sum(), abs=0.5)
    assert found.joint_positions == pytest.approx(np.full(14, 0.1))
    assert found.down == pytest.approx([np.sin(0.2), 0.0, -np.cos(0.2)])  # ahead of a trunk that leans forward


def test_too_few_readings_and_an_unloaded_foot_are_refused():
    average = HoldAverage(ROBOT, "right")
    with pytest.raises(ValueError, match="expected at least 50"):
        average.measurement()
    for tick in range(60):
        average.add(reading(tick, np.full(4, 50.0)))  # on the left foot
    with pytest.raises(ValueError, match="the right foot carried"):
        average.measurement()


@pytest.mark.parametrize("moves", ["nothing", "a joint", "the cop", "the trunk"])
def test_gate_opens_only_when_nothing_moves(moves: str):
    rng = np.random.default_rng(3)
    gate = StillnessGate(AveragingParameters(), PERIOD)
    still = False
    for tick in range(250):
        sway = np.sin(2.0 * np.pi * tick * PERIOD)  # 1 Hz
        cop = rng.normal(0.0, 0.8e-3, 2) + (2e-3 * sway if moves == "the cop" else 0.0)
        speed = rng.normal(0.0, 0.02) + (0.05 if moves == "a joint" else 0.0)
        turning = 0.005 + rng.normal(0.0, 0.005) + (0.02 * sway if moves == "the trunk" else 0.0)  # with a bias
        still = gate.is_still(reading(tick, np.full(4, 50.0), speed, turning), cop)
        assert not (moves != "nothing" and still)
        assert not (still and tick < 124)  # half a second has to be seen first
    assert still == (moves == "nothing")
