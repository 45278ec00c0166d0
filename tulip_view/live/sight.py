"""What the camera saw last, with the features that vision found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tulip_description.camera_mount import MountOffsets
from tulip_description.robot import HEAD_JOINTS, Robot
from tulip_ros import topics
from tulip_ros.time import NANOSECONDS, stamp_of
from tulip_view.body_pose import pose_row
from tulip_view.camera_picture import HeadPose, Picture, decoded, lens_of, seen, with_features
from tulip_view.live.buffers import Buffers

SAME = 0.001  # [s] features carry the stamp of their picture
NEAR = 0.05  # [s] attitude and neck of a picture, at 50 Hz


@dataclass(frozen=True)
class Sight:
    """A picture.

    Attributes:
        stamp: Of the picture [s].
        picture: (height, width, 3) BGR.
        words: What was found in it.
    """

    stamp: float
    picture: Picture
    words: str


def newest_picture(buffers: Buffers) -> tuple[topics.Topic, float] | None:
    """Return which topic's picture `look` would show, and its stamp [s], without decoding it."""
    annotated = buffers.newest(topics.VISION_PICTURE)
    if annotated is not None:
        return topics.VISION_PICTURE, stamp_of(annotated) / NANOSECONDS
    for topic in (topics.CAMERA_COMPRESSED, topics.CAMERA_IMAGE):
        row = buffers.kept(topic)
        # Features come some 50 ms after their picture: rather the picture before than one without.
        found = next((stamp for stamp, _ in reversed(row) if buffers.nearest(topics.FEATURES, stamp, SAME)), None)
        if found is not None or row:
            return topic, found if found is not None else row[-1][0]
    return None


def look(buffers: Buffers, robot: Robot, mount: MountOffsets) -> Sight | None:
    """Return the picture to show: vision's own, or the camera's with the features of the same stamp.

    Args:
        buffers: What came.
        robot: Carries the camera.
        mount: How the camera sits on it.
    """
    found = newest_picture(buffers)
    if found is None:
        return None
    topic, stamp = found
    message = buffers.newest(topic) if topic is topics.VISION_PICTURE else buffers.nearest(topic, stamp, SAME)
    picture = decoded(message)
    if picture is None:
        return None
    if topic is topics.VISION_PICTURE:
        return Sight(stamp, picture, "as vision drew it; red: refused, and why")
    features = buffers.nearest(topics.FEATURES, stamp, SAME)
    if features is None:
        return Sight(stamp, picture, "no features of this picture")
    words = ", ".join(seen(features)) or "nothing found"
    lens, _ = lens_of(buffers.newest(topics.CAMERA_INFO))
    drawn = with_features(picture, features, _head(buffers, stamp), lens, robot, mount)
    if drawn is None:
        return Sight(stamp, picture, f"{words} (not drawn: attitude or lens of this picture is not known)")
    return Sight(stamp, drawn, words)


def _head(buffers: Buffers, stamp: float) -> HeadPose | None:
    odometry = buffers.nearest(topics.ODOMETRY, stamp, NEAR)
    joints = buffers.nearest(topics.JOINT_STATES, stamp, NEAR)
    if odometry is None or joints is None or not set(HEAD_JOINTS) <= set(joints.name):
        return None
    pose = pose_row(odometry.pose.pose)
    pan, tilt = (float(joints.position[list(joints.name).index(name)]) for name in HEAD_JOINTS)
    return HeadPose(pose[2], np.array(pose[3:]), pan, tilt)
