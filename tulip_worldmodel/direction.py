"""Directions: the two angles under which the camera sees a point, with their derivatives.

For an offset o from the optical centre to the point, in level axes:

    azimuth   = atan2(o_y, o_x)
    elevation = atan2(o_z, sqrt(o_x^2 + o_y^2))
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HORIZON = np.radians(-2.0)  # rays above it meet the ground more than 30 m away: useless, and singular at 0


def wrap(angles: Array) -> Array:
    """Return angles [rad] brought into [-pi, pi)."""
    return np.asarray((angles + np.pi) % (2.0 * np.pi) - np.pi, dtype=np.float64)


def half_turn(angles: Array) -> Array:
    """Return directions of undirected lines [rad] brought into [-pi/2, pi/2)."""
    return np.asarray((angles + np.pi / 2.0) % np.pi - np.pi / 2.0)


def directions(offsets: Array) -> tuple[Array, Array]:
    """Return azimuth and elevation of points and how they change with the points.

    Args:
        offsets: (n, 3) from the optical centre to the points [m].

    Returns:
        (n, 2) azimuth and elevation [rad], and (n, 2, 3) their derivatives by the offsets [rad/m].
    """
    x, y, z = offsets[:, 0], offsets[:, 1], offsets[:, 2]
    ground = np.maximum(np.hypot(x, y), 1e-6)
    ground_squared = ground**2
    whole = ground_squared + z**2
    angles = np.empty((len(offsets), 2))
    angles[:, 0] = np.arctan2(y, x)
    angles[:, 1] = np.arctan2(z, ground)
    sink = -z / (ground * whole)
    jacobian = np.zeros((len(offsets), 2, 3))
    jacobian[:, 0, 0] = -y / ground_squared
    jacobian[:, 0, 1] = x / ground_squared
    jacobian[:, 1, 0] = x * sink
    jacobian[:, 1, 1] = y * sink
    jacobian[:, 1, 2] = ground / whole
    return angles, jacobian


def rays(angles: Array) -> tuple[Array, Array]:
    """Return unit rays of directions and their derivatives.

    Args:
        angles: (n, 2) azimuth and elevation [rad].

    Returns:
        (n, 3) rays, and (n, 3, 2) their derivatives by azimuth and elevation.
    """
    azimuth, elevation = angles[:, 0], angles[:, 1]
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    unit = np.empty((len(angles), 3))
    unit[:, 0], unit[:, 1], unit[:, 2] = ce * ca, ce * sa, se
    jacobian = np.zeros((len(angles), 3, 2))
    jacobian[:, 0, 0] = -unit[:, 1]
    jacobian[:, 1, 0] = unit[:, 0]
    jacobian[:, 0, 1] = -se * ca
    jacobian[:, 1, 1] = -se * sa
    jacobian[:, 2, 1] = ce
    return unit, jacobian


def meet_plane(unit_rays: Array, camera_position: Array, height: float = 0.0) -> tuple[Array, Array]:
    """Return where rays from the camera meet a level plane.

    Args:
        unit_rays: (n, 3), all pointing from the camera towards the plane.
        camera_position: (3,) optical centre [m].
        height: Of the plane above the ground [m].

    Returns:
        (n, 2) points [m], and (n, 2, 3) their derivatives by the rays.
    """
    z = unit_rays[:, 2]
    reach = (height - camera_position[2]) / z  # factor by which a ray is to be stretched
    from_camera = reach[:, None] * unit_rays[:, :2]
    jacobian = np.zeros((len(unit_rays), 2, 3))
    jacobian[:, 0, 0] = jacobian[:, 1, 1] = reach
    jacobian[:, :, 2] = -from_camera / z[:, None]
    return camera_position[:2] + from_camera, jacobian
