from __future__ import annotations

import math
import time

import cv2
import numpy as np
import pytest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image, JointState

from tulip_description import frames
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.posture import standing_posture
from tulip_description.robot import JOINTS, load_robot
from tulip_ros import topics
from tulip_ros.run import session
from tulip_ros.time import header, stamp_of
from tulip_vision.features import FeatureClass
from tulip_vision.lens import head_camera_lens
from tulip_vision.messages import features_to_message, picture_from_message, picture_to_message
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.vision_node import VisionNode

pytestmark = pytest.mark.ros

STEP = 20_000_000
TILT = 0.5


def ball_on_carpet() -> np.ndarray:
    """Return a picture of an orange disk where a ball 1.5 m ahead is seen."""
    robot, lens = load_robot(), head_camera_lens()
    pose = camera_in_footprint(robot, standing_posture(robot).base_height, (0.0, 0.0, 0.0, 1.0), 0.0, TILT)
    ray = (np.array([1.5, 0.0, 0.0935]) - pose[:3, 3]) @ pose[:3, :3]
    pixel = lens.project(ray[None])[0]
    radius = round(455.0 * 0.0935 / float(np.linalg.norm(ray)))
    picture = np.full((480, 640, 3), (44, 128, 58), np.uint8)
    cv2.circle(picture, (round(pixel[0]), round(pixel[1])), radius, (20, 100, 230), -1)
    return picture


def odometry(stamp: int) -> Odometry:
    message = Odometry(header=header(stamp, frames.ODOM))
    message.pose.pose.position.z = standing_posture(load_robot()).base_height
    message.pose.pose.orientation.w = 1.0
    return message


def joints(stamp: int) -> JointState:
    positions = [0.0] * 13 + [TILT]
    return JointState(header=header(stamp), name=list(JOINTS), position=positions)


def wait(spin, condition, seconds: float = 10.0) -> None:
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        spin(0.02)


def test_node_waits_for_the_pose_of_a_pictures_stamp_and_draws_only_for_listeners(ros_domain: int) -> None:
    found: list[object] = []
    drawn: list[Image] = []
    with session(VisionNode, arguments=["test"]) as (node, spin):
        topics.FEATURES.subscribe_from(node, found.append)
        pictures = topics.CAMERA_IMAGE.publish_from(node)
        bodies = topics.ODOMETRY.publish_from(node)
        heads = topics.JOINT_STATES.publish_from(node)
        lens = topics.CAMERA_INFO.publish_from(node)
        lens.publish(CameraInfo(header=header(0), **head_camera_lens().to_camera_info()))
        wait(spin, lambda: node._vision is not None)
        for stamp in (STEP, 2 * STEP):
            bodies.publish(odometry(stamp))
            heads.publish(joints(stamp))
        picture = ball_on_carpet()
        pictures.publish(picture_to_message(picture, 2 * STEP + STEP // 2))
        for _ in range(20):
            spin(0.02)
        assert found == []  # readings after the picture are still to come
        heads.publish(joints(3 * STEP))
        bodies.publish(odometry(3 * STEP))
        wait(spin, lambda: bool(found))
        assert stamp_of(found[0]) == 2 * STEP + STEP // 2
        ball = next(each for each in found[0].features if each.kind == FeatureClass.BALL)
        assert ball.azimuth == pytest.approx(0.0, abs=math.radians(0.2))
        topics.VISION_PICTURE.subscribe_from(node, drawn.append)
        wait(spin, lambda: node._drawn.get_subscription_count() > 0)
        pictures.publish(picture_to_message(picture, 3 * STEP))
        wait(spin, lambda: bool(drawn))
    assert (drawn[0].height, drawn[0].width) == (480, 640)
    assert np.any(picture_from_message(drawn[0]) != picture)


def test_pictures_without_a_pose_are_counted_and_unreadable_ones_do_no_harm(ros_domain: int) -> None:
    found: list[object] = []
    with session(VisionNode, arguments=["test"]) as (node, spin):
        topics.FEATURES.subscribe_from(node, found.append)
        pictures = topics.CAMERA_IMAGE.publish_from(node)
        bodies = topics.ODOMETRY.publish_from(node)
        heads = topics.JOINT_STATES.publish_from(node)
        topics.CAMERA_INFO.publish_from(node).publish(
            CameraInfo(header=header(0), **head_camera_lens().to_camera_info())
        )
        wait(spin, lambda: node._vision is not None)
        for stamp in (100 * STEP, 101 * STEP):
            bodies.publish(odometry(stamp))
            heads.publish(joints(stamp))
        for _ in range(10):
            spin(0.02)
        old = picture_to_message(ball_on_carpet(), STEP)  # older than all readings
        unreadable = Image(header=header(100 * STEP), height=480, width=640, step=1920, encoding="yuv422")
        for count, message in enumerate((old, unreadable), start=1):
            pictures.publish(message)
            wait(spin, lambda count=count: sum(node.health._events.values()) == count)
        pictures.publish(picture_to_message(ball_on_carpet(), 101 * STEP))
        wait(spin, lambda: bool(found))
        events = dict(node.health._events)
    assert [stamp_of(each) for each in found] == [101 * STEP]
    assert events == {"pictures without pose": 1, "unusable pictures": 1}


def test_features_survive_the_message() -> None:
    robot = load_robot()
    pose = camera_in_footprint(robot, standing_posture(robot).base_height, (0.0, 0.0, 0.0, 1.0), 0.0, TILT)
    features = Vision(VisionParameters(), head_camera_lens()).process(ball_on_carpet(), 7, pose)
    message = features_to_message(features)
    assert stamp_of(message) == 7
    assert message.header.frame_id == frames.BASE_FOOTPRINT
    assert list(message.camera_position) == list(features.camera_position)
    for sent, feature in zip(message.features, features.features, strict=True):
        for name in ("kind", "azimuth", "elevation", "azimuth_spread", "confidence", "angular_radius"):
            assert getattr(sent, name) == pytest.approx(getattr(feature, name), nan_ok=True)


@pytest.mark.parametrize(("encoding", "step"), [("bgr8", 5), ("yuv422", 6), ("rgb8", 7)])
def test_pictures_that_do_not_fit_their_description_are_refused(encoding: str, step: int) -> None:
    message = Image(height=2, width=2, encoding=encoding, step=step, data=bytes(12))
    with pytest.raises(ValueError, match="expected"):
        picture_from_message(message)


def test_rgb_and_padded_pictures_are_read_as_bgr() -> None:
    padded = Image(height=1, width=2, encoding="rgb8", step=8, data=bytes([1, 2, 3, 4, 5, 6, 0, 0]))
    assert picture_from_message(padded).tolist() == [[[3, 2, 1], [6, 5, 4]]]
    grey = Image(height=1, width=2, encoding="mono8", step=2, data=bytes([7, 8]))
    assert picture_from_message(grey).tolist() == [[[7, 7, 7], [8, 8, 8]]]
