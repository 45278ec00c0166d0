"""Rotations as quaternions x, y, z, w, in plain numbers: for a single one, making an object takes longer than the sum.

For many at once, and for interpolation, `scipy.spatial.transform.Rotation` is the tool.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.planar import Pose2D

Quaternion = tuple[float, float, float, float]
"""x, y, z, w; of unit length."""
ORIGIN = np.zeros(3)


def quaternion_product(a: Sequence[float], b: Sequence[float]) -> Quaternion:
    """Return a b, the rotation b followed by a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def quaternion_yaw(a: Sequence[float]) -> float:
    """Return the heading of the rotated x axis [rad]."""
    x, y, z, w = a
    return math.atan2(2.0 * (x * y + w * z), w * w + x * x - y * y - z * z)


def quaternion_matrix(a: Sequence[float]) -> NDArray[np.float64]:
    """Return the (3, 3) rotation matrix."""
    x, y, z, w = a
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def matrix_quaternion(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quaternion (4,) of a rotation matrix (3, 3)."""
    quaternion: NDArray[np.float64] = pin.SE3ToXYZQUAT(pin.SE3(matrix, ORIGIN))[3:]
    return quaternion


def pose_on_ground(
    position: Sequence[float] | NDArray[np.float64], orientation: Sequence[float] | NDArray[np.float64]
) -> Pose2D:
    """Return where a body lies seen from above, with its yaw alone: base_footprint of base_link.

    Args:
        position: x, y and perhaps more [m].
        orientation: (4,) quaternion.
    """
    return Pose2D(float(position[0]), float(position[1]), quaternion_yaw([float(value) for value in orientation]))
