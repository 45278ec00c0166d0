"""From directions to pixels: loops of `lens` and `view`, compiled, as numpy takes a dozen passes for a few points."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def project_plumb_bob(directions: Array, coefficients: Array, scale: Array, largest_tangent: float) -> Array:
    """Return (n, 2) pixels of (n, 3) directions through a plumb-bob lens; NaN beyond the largest tangent.

    Args:
        directions: Of any length, z along the optical axis.
        coefficients: (8,) k1, k2, p1, p2, k3, k4, k5, k6.
        scale: (4,) fx, fy, cx, cy [px].
        largest_tangent: Of the angle to the optical axis.
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = coefficients
    pixels = np.empty((len(directions), 2))
    for i in range(len(directions)):
        z = directions[i, 2]
        if z > 1e-9:
            x, y = directions[i, 0] / z, directions[i, 1] / z
            squared = x * x + y * y
            if squared <= largest_tangent * largest_tangent:
                stretch = 1.0 + squared * (k1 + squared * (k2 + squared * k3))
                stretch /= 1.0 + squared * (k4 + squared * (k5 + squared * k6))
                u = x * stretch + 2.0 * p1 * x * y + p2 * (squared + 2.0 * x * x)
                v = y * stretch + p1 * (squared + 2.0 * y * y) + 2.0 * p2 * x * y
                pixels[i, 0], pixels[i, 1] = scale[0] * u + scale[2], scale[1] * v + scale[3]
                continue
        pixels[i, 0] = pixels[i, 1] = math.nan
    return pixels


@njit(cache=True)
def nearest_pixels(pixels: Array, width: int, height: int) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return (n,) the index of the pixel nearest to each of (n, 2) places, and (n,) whether that is inside."""
    index = np.zeros(len(pixels), dtype=np.intp)
    inside = np.zeros(len(pixels), dtype=np.bool_)
    for i in range(len(pixels)):
        u, v = pixels[i, 0], pixels[i, 1]
        if 0.0 <= u <= width - 1 and 0.0 <= v <= height - 1:
            inside[i] = True
            index[i] = int(v + 0.5) * width + int(u + 0.5)
    return index, inside


@njit(cache=True)
def rays_between(table: NDArray[np.float32], pixels: Array) -> Array:
    """Return (n, 3) unit vectors at (n, 2) places inside the picture, between those of a table (height, width, 3)."""
    height, width = table.shape[:2]
    rays = np.empty((len(pixels), 3))
    for i in range(len(pixels)):
        u, v = min(int(pixels[i, 0]), width - 2), min(int(pixels[i, 1]), height - 2)
        right, down = pixels[i, 0] - u, pixels[i, 1] - v
        squared = 0.0
        for axis in range(3):
            upper = table[v, u, axis] * (1.0 - right) + table[v, u + 1, axis] * right
            lower = table[v + 1, u, axis] * (1.0 - right) + table[v + 1, u + 1, axis] * right
            rays[i, axis] = upper * (1.0 - down) + lower * down
            squared += rays[i, axis] * rays[i, axis]
        rays[i] /= math.sqrt(squared)
    return rays


@njit(cache=True)
def angles_at(table: NDArray[np.float32], rotation: Array, pixels: NDArray[np.int32]) -> tuple[Array, Array]:
    """Return azimuth and elevation (n,) that are seen at (n, 2) whole pixels [rad].

    Args:
        table: (height, width, 3) rays.
        rotation: (3, 3) of the camera in the level frame.
        pixels: u and v, inside the picture.
    """
    azimuths, elevations = np.empty(len(pixels)), np.empty(len(pixels))
    for i in range(len(pixels)):
        x, y, z = table[pixels[i, 1], pixels[i, 0]]
        forward = rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z
        left = rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z
        up = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z
        azimuths[i] = math.atan2(left, forward)
        elevations[i] = math.asin(min(max(up, -1.0), 1.0))
    return azimuths, elevations
