"""Quaternions in plain numbers, against Pinocchio."""

from __future__ import annotations

import math
import os

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.planar import wrap_angle
from tulip_description.quaternion import (
    Quaternion,
    matrix_quaternion,
    pose_on_ground,
    quaternion_matrix,
    quaternion_product,
    quaternion_yaw,
)
from tulip_sim.bench.soaking.resources import MEMORY, resources

IDENTITY = np.eye(3)
vectors = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))


def quaternion(turn: np.ndarray) -> Quaternion:
    x, y, z, w = pin.Quaternion(turn).coeffs().tolist()
    return x, y, z, w


@given(vectors, vectors)
def test_a_product_is_that_of_rotations(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    first, second = pin.exp3(np.array(b)), pin.exp3(np.array(a))
    product = quaternion_product(quaternion(second), quaternion(first))
    np.testing.assert_allclose(quaternion_matrix(product), second @ first, atol=1e-12)


@given(vectors)
def test_a_matrix_as_quaternion_is_the_same_turn(turn: tuple[float, ...]) -> None:
    matrix = pin.exp3(np.array(turn))
    np.testing.assert_allclose(quaternion_matrix(matrix_quaternion(matrix)), matrix, atol=1e-12)


def test_quaternions_of_matrices_hold_no_memory() -> None:
    """Pinocchio's own leaks: a robot that told its odometry for eight hours held 120 MB of them."""
    before = resources(os.getpid())[MEMORY]
    for _ in range(50_000):
        matrix_quaternion(IDENTITY)
    assert resources(os.getpid())[MEMORY] - before < 1.0


@given(st.floats(-3.0, 3.0), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_the_pose_on_the_ground_has_the_yaw_of_yaw_pitch_and_roll(yaw: float, pitch: float, roll: float) -> None:
    attitude = np.array(quaternion(pin.rpy.rpyToMatrix(roll, pitch, yaw)))
    pose = pose_on_ground((1.0, -2.0, 0.7), attitude)
    assert (pose.x, pose.y) == (1.0, -2.0)
    assert wrap_angle(pose.yaw - yaw) == pytest.approx(0.0, abs=1e-9)
    assert math.isclose(quaternion_yaw(attitude.tolist()), pose.yaw)
