"""Quaternions in plain numbers, against Pinocchio."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.planar import wrap_angle
from tulip_description.quaternion import (
    Quaternion,
    pose_on_ground,
    quaternion_matrix,
    quaternion_product,
    quaternion_yaw,
)

vectors = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))


def quaternion(turn: np.ndarray) -> Quaternion:
    x, y, z, w = pin.Quaternion(turn).coeffs().tolist()
    return x, y, z, w


@given(vectors, vectors)
def test_a_product_is_that_of_rotations(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    first, second = pin.exp3(np.array(b)), pin.exp3(np.array(a))
    product = quaternion_product(quaternion(second), quaternion(first))
    np.testing.assert_allclose(quaternion_matrix(product), second @ first, atol=1e-12)


@given(st.floats(-3.0, 3.0), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_the_pose_on_the_ground_has_the_yaw_of_yaw_pitch_and_roll(yaw: float, pitch: float, roll: float) -> None:
    attitude = np.array(quaternion(pin.rpy.rpyToMatrix(roll, pitch, yaw)))
    pose = pose_on_ground((1.0, -2.0, 0.7), attitude)
    assert (pose.x, pose.y) == (1.0, -2.0)
    assert wrap_angle(pose.yaw - yaw) == pytest.approx(0.0, abs=1e-9)
    assert math.isclose(quaternion_yaw(attitude.tolist()), pose.yaw)
