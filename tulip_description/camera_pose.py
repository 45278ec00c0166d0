"""Where the head camera is, from the joint angles of the head and the attitude of the trunk."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tulip_description.camera_mount import MountOffsets
from tulip_description.model import OPTICAL_ROTATION
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot

Array = NDArray[np.float64]

AS_DRAWN = MountOffsets()
"""The camera sits exactly as robot.yaml says."""


def camera_in_footprint(
    robot: Robot,
    base_height: float,
    base_orientation_xyzw: ArrayLike,
    pan: float,
    tilt: float,
    mount: MountOffsets = AS_DRAWN,
) -> Array:
    """Return the (4, 4) transform of camera_optical_frame in base_footprint.

    Args:
        robot: A robot with a head.
        base_height: Height of base_link above the ground [m].
        base_orientation_xyzw: (4,) unit quaternion of base_link in any level frame; its yaw does not matter.
        pan: Angle of head_pan [rad].
        tilt: Angle of head_tilt, positive looks down [rad].
        mount: How the camera sits on the head, beside what the robot file says.

    Raises:
        ValueError: if the robot has no head or the quaternion is not of length one.
    """
    if robot.camera is None:
        raise ValueError(f"variant {robot.variant!r} has no camera; expected the playing variant")
    rotation = _level_rotation(base_orientation_xyzw)
    neck, head = robot.joint("head_pan"), robot.joint("head_tilt")
    pan, tilt = pan + mount.pan, tilt + mount.tilt
    cp, sp, ct, st = math.cos(pan), math.sin(pan), math.cos(tilt), math.sin(tilt)
    head_in_neck = np.array([[ct, 0.0, st], [0.0, 1.0, 0.0], [-st, 0.0, ct]])
    neck_in_base = np.array([[cp, -sp, 0.0], [sp, cp, 0.0], [0.0, 0.0, 1.0]])
    head_in_base = neck_in_base @ head_in_neck
    position = (
        np.array(neck.origin)
        + neck_in_base @ np.array(head.origin)
        + head_in_base @ (np.array(robot.camera.origin) + np.array((0.0, 0.0, mount.height)))
    )
    transform = np.eye(4)
    transform[:3, :3] = rotation @ head_in_base @ mount.rotation @ OPTICAL_ROTATION
    transform[:3, 3] = rotation @ position
    transform[2, 3] += base_height
    return transform


def _level_rotation(quaternion: ArrayLike) -> Array:
    """Return the rotation matrix of a quaternion (x, y, z, w) with its yaw taken away."""
    q = np.asarray(quaternion, dtype=float)
    if q.shape != (4,) or not abs(float(q @ q) - 1.0) < 1e-3:
        raise ValueError(f"base_orientation_xyzw is {q}; expected a unit quaternion of shape (4,)")
    rotation = quaternion_matrix((q / math.sqrt(float(q @ q))).tolist())
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    level: Array = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    return level
