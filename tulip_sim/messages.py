"""Messages that the simulator's driver sends beside those of the body: pictures, lens, ground truth."""

from __future__ import annotations

import array
import json
import math
from collections.abc import Sequence

import cv2
import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, CompressedImage
from std_msgs.msg import String

from tulip_description import frames
from tulip_description.planar import Pose2D
from tulip_description.short_numbers import fixed_point
from tulip_msgs.msg import GroundTruth
from tulip_ros.time import header, stamp_of
from tulip_sim.judging import Verdict
from tulip_sim.match_report import MatchReport
from tulip_sim.truth import Truth
from tulip_vision.lens import Lens

Array = NDArray[np.float64]
JPEG_QUALITY = 35  # a quarter of the bytes of quality 85, and vision finds as much (docs/decisions/0008)
PNG_LEVEL = 1  # of zlib: noise hardly gets smaller by a higher one


def jpeg_to_message(picture: NDArray[np.uint8], stamp: int, quality: int = JPEG_QUALITY) -> CompressedImage:
    """Return a (H, W, 3) BGR picture as a compressed message: a ninetieth of the size, for recordings and viewers."""
    options = (cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_OPTIMIZE, 1)
    return _compressed(picture, stamp, "jpeg", options)


def png_to_message(picture: NDArray[np.uint8], stamp: int) -> CompressedImage:
    """Return a (H, W, 3) BGR picture as a compressed message that loses nothing: half of the size."""
    return _compressed(picture, stamp, "png", (cv2.IMWRITE_PNG_COMPRESSION, PNG_LEVEL))


def _compressed(picture: NDArray[np.uint8], stamp: int, kind: str, options: Sequence[int]) -> CompressedImage:
    _, data = cv2.imencode(f".{kind}", picture, options)
    message = CompressedImage(header=header(stamp, frames.CAMERA_OPTICAL), format=kind)
    message.data = array.array("B", data.tobytes())
    return message


def lens_to_message(lens: Lens, stamp: int) -> CameraInfo:
    """Return a lens as a message, without rectification."""
    message = CameraInfo(header=header(stamp, frames.CAMERA_OPTICAL), **lens.to_camera_info())
    matrix = np.hstack([lens.camera_matrix, np.zeros((3, 1))])
    message.r, message.p = np.eye(3).ravel(), matrix.ravel()
    return message


def report_to_message(report: MatchReport) -> String:
    """Return all that the referee of a match has said, as JSON."""
    return String(data=json.dumps(report.as_dict()))


def report_from_message(message: String) -> MatchReport:
    """Return the report of a message."""
    return MatchReport.from_dict(json.loads(message.data))


def truth_to_message(truth: Truth, verdict: Verdict) -> GroundTruth:
    """Return what really is, with what the referee says about it; another robot stands for the keeper."""
    own, opponent = verdict.score
    keeper = truth.keeper if truth.keeper is not None or not truth.others else truth.others[0].footprint
    message = GroundTruth(
        header=header(truth.stamp, frames.MAP),
        robot=_pose(truth.base_position, truth.base_orientation),
        robot_twist=_twist(truth.base_linear_velocity, truth.base_angular_velocity),
        joint_positions=fixed_point(truth.joint_positions),
        ball=_pose(truth.ball_position, truth.ball_orientation),
        ball_twist=_twist(truth.ball_linear_velocity, truth.ball_angular_velocity),
        keeper_present=keeper is not None,
        robot_fallen=verdict.lying,
        touches=sum(truth.foot_touches) + truth.body_touches,
        falls=verdict.falls,
        own_score=own,
        opponent_score=opponent,
        outcome=verdict.outcome,
        trial_time=verdict.played,
    )
    if keeper is not None:
        message.keeper = _standing(keeper)
    message.obstacles = [_standing(each) for each in truth.obstacles]
    return message


def truth_from_message(message: GroundTruth, poles: bool) -> Truth:
    """Return what really is, as far as the message tells: joint velocities are zero, no path and no touches are known.

    Args:
        message: From `truth_to_message`.
        poles: Whether the landmark poles stand.
    """
    keeper = _on_ground(message.keeper) if message.keeper_present else None
    return Truth(
        stamp=stamp_of(message),
        base_position=_vector(message.robot.position),
        base_orientation=_quaternion(message.robot.orientation),
        base_linear_velocity=_vector(message.robot_twist.linear),
        base_angular_velocity=_vector(message.robot_twist.angular),
        joint_positions=np.array(message.joint_positions, dtype=np.float64),
        joint_velocities=np.zeros(len(message.joint_positions)),
        ball_position=_vector(message.ball.position),
        ball_orientation=_quaternion(message.ball.orientation),
        ball_linear_velocity=_vector(message.ball_twist.linear),
        ball_angular_velocity=_vector(message.ball_twist.angular),
        keeper=keeper,
        keeper_path=(),
        foot_touches=(0, 0),
        body_touches=0,
        keeper_touches=0,
        poles=poles,
        obstacles=tuple(_on_ground(each) for each in message.obstacles),
    )


def _vector(message: Point | Vector3) -> Array:
    return np.array([message.x, message.y, message.z])


def _quaternion(message: Quaternion) -> Array:
    return np.array([message.x, message.y, message.z, message.w])


def _pose(position: Array, orientation: Array) -> Pose:
    pose = Pose()
    pose.position.x, pose.position.y, pose.position.z = fixed_point(position).tolist()
    turn = pose.orientation
    turn.x, turn.y, turn.z, turn.w = fixed_point(orientation).tolist()
    return pose


def _standing(place: Pose2D) -> Pose:
    """Return a pose on the ground as a message."""
    half = place.yaw / 2.0
    return _pose(np.array([place.x, place.y, 0.0]), np.array([0.0, 0.0, math.sin(half), math.cos(half)]))


def _on_ground(pose: Pose) -> Pose2D:
    """Return where on the ground a pose of a message stands."""
    return Pose2D(pose.position.x, pose.position.y, 2.0 * math.atan2(pose.orientation.z, pose.orientation.w))


def _twist(linear: Array, angular: Array) -> Twist:
    twist = Twist()
    twist.linear.x, twist.linear.y, twist.linear.z = fixed_point(linear).tolist()
    twist.angular.x, twist.angular.y, twist.angular.z = fixed_point(angular).tolist()
    return twist
