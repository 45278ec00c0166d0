from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tulip_vision.pose_buffer import MissingPose, PoseBuffer, PoseBufferParameters

MS = 1_000_000


def record(height: float, orientation: np.ndarray, pan: float, tilt: float) -> np.ndarray:
    """Stand in for the robot's kinematics: keep what was interpolated readable in the result."""
    result = np.eye(4)
    result[:3, :3] = Rotation.from_quat(orientation).as_matrix()
    result[:3, 3] = pan, tilt, height
    return result


def turned(yaw: float, pitch: float = 0.0, roll: float = 0.0) -> np.ndarray:
    return Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat()


def filled(**parameters: int) -> PoseBuffer:
    buffer = PoseBuffer(PoseBufferParameters(**parameters), record)
    for tick in range(11):
        buffer.add_body(tick * 20 * MS, 0.8 + 0.001 * tick, turned(0.01 * tick, 0.02 * tick))
    for tick in range(51):
        buffer.add_head(tick * 4 * MS, 0.01 * tick, -0.02 * tick)
    return buffer


def test_a_stamp_of_a_reading_gives_that_reading():
    pose = filled().camera_in_footprint(100 * MS)
    assert isinstance(pose, np.ndarray)
    np.testing.assert_allclose(pose[:3, 3], [0.25, -0.5, 0.805], atol=1e-12)
    np.testing.assert_allclose(pose[:3, :3], Rotation.from_quat(turned(0.05, 0.1)).as_matrix(), atol=1e-12)


@given(st.integers(min_value=0, max_value=200 * MS))
def test_heights_and_head_angles_are_interpolated_linearly(stamp: int):
    pose = filled().camera_in_footprint(stamp)
    assert isinstance(pose, np.ndarray)
    seconds = stamp * 1e-9
    np.testing.assert_allclose(pose[:3, 3], [2.5 * seconds, -5.0 * seconds, 0.8 + 0.05 * seconds], atol=1e-9)


def test_orientation_halfway_is_half_the_turn_also_across_the_quaternions_sign():
    buffer = PoseBuffer(PoseBufferParameters(), record)
    buffer.add_body(0, 0.8, turned(0.0))
    buffer.add_body(20 * MS, 0.8, -turned(0.4))  # q and -q are the same orientation
    buffer.add_head(0, 0.0, 0.0)
    buffer.add_head(20 * MS, 0.0, 0.0)
    pose = buffer.camera_in_footprint(10 * MS)
    assert isinstance(pose, np.ndarray)
    np.testing.assert_allclose(pose[:3, :3], Rotation.from_euler("z", 0.2).as_matrix(), atol=1e-12)


def test_a_picture_younger_than_the_newest_reading_may_be_waited_for():
    missing = filled().camera_in_footprint(205 * MS)
    assert isinstance(missing, MissingPose)
    assert missing.may_come
    assert "odometry is 5 ms older" in missing.reason


def test_extrapolation_holds_the_newest_reading_within_its_limit_only():
    buffer = filled(extrapolation=10 * MS)
    assert isinstance(buffer.camera_in_footprint(210 * MS), np.ndarray)
    assert isinstance(buffer.camera_in_footprint(211 * MS), MissingPose)


def test_an_empty_buffer_and_a_too_old_picture_are_told_apart():
    empty = PoseBuffer(PoseBufferParameters(), record).camera_in_footprint(0)
    assert isinstance(empty, MissingPose) and empty.may_come
    old = filled(kept=100 * MS).camera_in_footprint(50 * MS)
    assert isinstance(old, MissingPose) and not old.may_come


def test_a_gap_is_not_bridged():
    buffer = filled()
    buffer.add_body(400 * MS, 0.8, turned(0.0))
    buffer.add_head(400 * MS, 0.0, 0.0)
    missing = buffer.camera_in_footprint(300 * MS)
    assert isinstance(missing, MissingPose)
    assert "gap of 200 ms in odometry" in missing.reason


def test_late_readings_are_dropped_and_a_restart_empties_the_buffer():
    buffer = filled()
    buffer.add_body(150 * MS, 9.0, turned(0.0))  # late: dropped
    pose = buffer.camera_in_footprint(150 * MS)
    assert isinstance(pose, np.ndarray)
    assert pose[2, 3] == pytest.approx(0.8075)
    late = PoseBuffer(PoseBufferParameters(), record)
    late.add_body(10_000 * MS, 0.8, turned(0.0))
    late.add_head(10_000 * MS, 0.1, 0.0)
    late.add_body(0, 0.7, turned(0.0))  # the simulation was reset
    late.add_head(0, 0.2, 0.0)
    pose = late.camera_in_footprint(0)
    assert isinstance(pose, np.ndarray)
    assert pose[2, 3] == 0.7


@pytest.mark.parametrize("orientation", [[0, 0, 0, 0], [0, 0, float("nan"), 1], [0, 0, 1]])
def test_unusable_orientations_are_refused(orientation: list[float]):
    with pytest.raises(ValueError, match="body reading"):
        PoseBuffer(PoseBufferParameters(), record).add_body(0, 0.8, orientation)


def test_unusable_heads_and_parameters_are_refused():
    with pytest.raises(ValueError, match="head reading"):
        PoseBuffer(PoseBufferParameters(), record).add_head(0, float("inf"), 0.0)
    with pytest.raises(ValueError, match="kept is 0 ns"):
        PoseBufferParameters(kept=0)
