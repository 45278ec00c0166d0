"""What the estimator computes with plain numbers, against matrices and Pinocchio."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import Side
from tulip_motion.motion import with_fixed_head
from tulip_motion.parameters import MotionParameters
from tulip_motion.state_estimator import Estimate, StateEstimator, centre_of_pressure

ROBOT = load_robot()
MODEL = floating_model(with_fixed_head(ROBOT))
CELLS = np.array([foot.cells for foot in ROBOT.feet])
POSTURE = standing_posture(ROBOT).joint_positions
vectors = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))


def quaternion(turn: np.ndarray) -> np.ndarray:
    xyzw: np.ndarray = pin.Quaternion(turn).coeffs()
    return xyzw


def sensors(seed: int, imu: np.ndarray) -> Sensors:
    rng = np.random.default_rng(seed)
    joints = POSTURE + rng.uniform(-0.2, 0.2, 14)
    cells = rng.uniform(20.0, 80.0, (2, 4))
    return Sensors(0, joints, rng.uniform(-1, 1, 14), np.zeros(14), imu, rng.uniform(-1, 1, 3), np.zeros(3), cells)


def estimate(
    reading: Sensors,
    left_weight: float,
    mount: np.ndarray,
    anchors: tuple[Pose2D, Pose2D],
    shift: tuple[float, float] = (0.0, 0.0),
    pivots: Sequence[tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0)),
) -> Estimate:
    estimator = StateEstimator(MotionParameters(), MODEL, CELLS, mount)
    level = Sensors(**{**vars(reading), "imu_orientation": quaternion(mount)})  # base_link as in odom
    estimator.update(level, 0.5, np.zeros(3))
    for side in Side:
        estimator.anchor(Footstep(side, anchors[side]))
    estimator.shift, estimator.pivots = shift, list(pivots)
    return estimator.update(reading, left_weight, np.zeros(3))


@given(vectors, vectors)
def test_attitude_is_that_of_the_imu_less_its_mounting(turn: tuple[float, ...], mounting: tuple[float, ...]) -> None:
    base, mount = pin.exp3(np.array(turn)), pin.exp3(np.array(mounting))
    seen = estimate(sensors(1, quaternion(base @ mount)), 1.0, mount, (Pose2D(), Pose2D()))
    np.testing.assert_allclose(seen.base_rotation, base, atol=1e-12)
    assert seen.tilt == pytest.approx(np.arccos(np.clip(base[2, 2], -1.0, 1.0)), abs=1e-7)


def test_heading_counts_from_the_start() -> None:
    estimator = StateEstimator(MotionParameters(imu_bias_limit=0.0), MODEL, CELLS, np.eye(3))
    tilt = pin.exp3(np.array([0.05, 0.1, 0.0]))
    turns = [pin.exp3(np.array([0.0, 0.0, heading])) @ tilt for heading in (2.0, 2.5, -1.0)]
    first = np.arctan2(turns[0][1, 0], turns[0][0, 0])
    for turn in turns:
        rotation = estimator.update(sensors(2, quaternion(turn)), 1.0, np.zeros(3)).base_rotation
        np.testing.assert_allclose(rotation, pin.exp3(np.array([0.0, 0.0, -first])) @ turn, atol=1e-12)


@pytest.mark.parametrize("left_weight", [1.0, 0.0, 0.3])
def test_base_lies_and_moves_such_that_the_feet_that_carry_stay_on_the_ground(left_weight: float) -> None:
    anchors = (Pose2D(0.3, 0.2, 0.1), Pose2D(0.25, -0.05, 0.0))
    shift, pivots = (0.01, -0.02), [(0.1, 0.03), (0.05, 0.0)]
    reading = sensors(3, quaternion(pin.exp3(np.array([0.03, -0.05, 0.4]))))
    seen = estimate(reading, left_weight, np.eye(3), anchors, shift, pivots)
    data = MODEL.createData()
    q = np.concatenate([seen.base_position, quaternion(seen.base_rotation), reading.joint_positions[:12]])
    v = np.concatenate(
        [seen.base_rotation.T @ seen.base_velocity, reading.imu_angular_velocity, reading.joint_velocities[:12]]
    )
    pin.forwardKinematics(MODEL, data, q, v)
    pin.updateFramePlacements(MODEL, data)
    frames = [MODEL.getFrameId(name) for name in ("l_sole", "r_sole")]
    off, moving = np.zeros(3), np.zeros(3)
    for side, weight in ((0, left_weight), (1, 1.0 - left_weight)):
        sole, motion = data.oMf[frames[side]], pin.getFrameVelocity(MODEL, data, frames[side], pin.LOCAL_WORLD_ALIGNED)
        pressed = sole.rotation @ [*np.average(CELLS[side], axis=0, weights=reading.foot_cells[side]), 0.0]
        pivot = sole.rotation @ [*pivots[side], 0.0]
        anchor = (anchors[side].x + shift[0], anchors[side].y + shift[1], -pressed[2])
        off += weight * (sole.translation - anchor)
        roll, twist = motion.angular * (1.0, 1.0, 0.0), motion.angular * (0.0, 0.0, 1.0)
        twist *= MotionParameters().observer_twist_share
        moving += weight * (motion.linear + np.cross(roll, pressed) + np.cross(twist, pivot))
    np.testing.assert_allclose(off, 0.0, atol=1e-12)
    np.testing.assert_allclose(moving, 0.0, atol=1e-12)
    np.testing.assert_allclose(seen.angular_velocity, seen.base_rotation @ reading.imu_angular_velocity, atol=1e-12)
    for sole, frame in zip(seen.soles, frames, strict=True):
        np.testing.assert_allclose(sole.transform, data.oMf[frame].homogeneous, atol=1e-12)


def test_centre_of_pressure_is_the_mean_of_the_cells_weighted_by_their_forces() -> None:
    reading = sensors(4, quaternion(pin.exp3(np.array([0.0, 0.0, 0.7]))))
    seen = estimate(reading, 0.5, np.eye(3), (Pose2D(0.3, 0.2), Pose2D(0.25, -0.05)))
    soles = [sole.transform[:2] for sole in seen.soles]
    places = np.concatenate([cells @ sole[:, :2].T + sole[:, 3] for cells, sole in zip(CELLS, soles, strict=True)])
    centre = centre_of_pressure(seen, 10.0)
    np.testing.assert_allclose(centre, np.average(places, axis=0, weights=reading.foot_cells.ravel()), atol=1e-12)
    np.testing.assert_allclose(seen.loads, reading.foot_cells.sum(axis=1), atol=1e-12)


def test_without_contact_there_is_no_centre_of_pressure() -> None:
    reading = Sensors(**{**vars(sensors(5, np.array([0.0, 0.0, 0.0, 1.0]))), "foot_cells": np.ones((2, 4))})
    seen = estimate(reading, 0.5, np.eye(3), (Pose2D(), Pose2D()))
    assert np.isnan(centre_of_pressure(seen, 10.0)).all()
