"""The geometry of one picture: pixels, directions and points on the ground.

Directions and points are in base_footprint (x forward, y left, z up, the ground at z = 0).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tulip_vision.lens import Lens
from tulip_vision.pixel_loops import angles_at, nearest_pixels

Array = NDArray[np.float64]
Mask = NDArray[np.uint8]

HORIZON_STEP = 8
"""[px] width of the blocks that tell on which side of the horizon a row lies."""


@dataclass(frozen=True)
class SpreadParameters:
    """How far a measured direction may be off.

    Attributes:
        pixel: Standard deviation of a well-defined edge or middle [px].
        pose_azimuth: Of the camera pose's heading, from joint play and the time between picture and pose [rad].
        pose_elevation: Of the camera pose's tilt, from the IMU and the same causes [rad].
    """

    # Measured by bench vision, standing and walking: 0.1 to 0.5 px, 0.01 to 0.07 deg, 0.02 deg. Another 0.1 deg is left
    # for how well a camera's mount can be calibrated, which no error of the simulated sensors stands for.
    pixel: float = 0.5  # [px] blur and colour borders
    pose_azimuth: float = math.radians(0.1)  # [rad] encoders, and time between picture and pose
    pose_elevation: float = math.radians(0.1)  # [rad] the mount, and soles that do not lie quite flat

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is negative or not finite.
        """
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; expected a finite number >= 0")


class View:
    """What a camera with a known lens sees from a known place.

    Attributes:
        lens: The lens.
        rotation: (3, 3) of camera_optical_frame in base_footprint.
        position: (3,) the optical centre in base_footprint [m].
        spread: How far directions may be off.
    """

    def __init__(self, lens: Lens, camera_in_footprint: Any, spread: SpreadParameters) -> None:
        """Make the view.

        Args:
            lens: The lens.
            camera_in_footprint: (4, 4) transform of camera_optical_frame in base_footprint.
            spread: How far directions may be off.

        Raises:
            ValueError: if the transform is not a rigid one, or the camera is not above the ground.
        """
        transform = np.asarray(camera_in_footprint, dtype=np.float64)
        if transform.shape != (4, 4) or not np.isfinite(transform).all():
            raise ValueError(f"camera_in_footprint has shape {transform.shape}; expected (4, 4) finite numbers")
        rotation = transform[:3, :3]
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-6 or np.linalg.det(rotation) < 0.0:
            raise ValueError("camera_in_footprint holds no rotation; expected an orthonormal, right-handed 3 x 3 part")
        if transform[2, 3] <= 0.0:
            raise ValueError(f"camera is {transform[2, 3]:.3f} m high; expected > 0 m above the ground")
        self.lens = lens
        self.rotation = rotation
        self.position = transform[:3, 3].copy()
        self.spread = spread
        self._coarse_sines: dict[int, NDArray[np.float32]] = {}

    @cached_property
    def middle_sines(self) -> Array:
        """(height,) sine of the elevation seen in the picture's middle column; negative below the horizon."""
        seen: Array = self.lens.ray_table()[:, self.lens.width // 2].astype(np.float64) @ self.rotation[2]
        return seen

    def coarse_sines(self, step: int) -> NDArray[np.float32]:
        """Return (rows, columns) sine of the elevation seen at the pixels of `Lens.coarse_ray_table`."""
        if step not in self._coarse_sines:
            rays = self.lens.coarse_ray_table(step)
            sines: NDArray[np.float32] = rays.reshape(-1, 3) @ self.rotation[2].astype(np.float32)
            self._coarse_sines[step] = sines.reshape(rays.shape[:2])
        return self._coarse_sines[step]

    @cached_property
    def below_horizon(self) -> Mask:
        """(height, width) 255 where a pixel looks below the horizon, else 0."""
        # Most rows lie on one side of the horizon as a whole, as one pixel in a block tells: only the rest is work.
        coarse = self.coarse_sines(HORIZON_STEP)
        margin = HORIZON_STEP / float(self.lens.camera_matrix[1, 1])  # twice what sines change within a block
        side = np.zeros(self.lens.height, dtype=np.int8)  # -1 below, 1 above, 0 not known
        blocks = (coarse.min(axis=1) > margin).astype(np.int8) - (coarse.max(axis=1) < -margin)
        rows = np.repeat(blocks, HORIZON_STEP)[: len(side)]
        side[: len(rows)] = rows
        below: Mask = np.zeros((self.lens.height, self.lens.width), dtype=np.uint8)
        below[side < 0] = 255
        mixed = np.flatnonzero(side == 0)
        if len(mixed):
            part = slice(int(mixed[0]), int(mixed[-1]) + 1)
            sines = cv2.transform(self.lens.ray_table()[part], self.rotation[2:].astype(np.float32))
            below[part] = cv2.compare(sines, 0.0, cv2.CMP_LT)
        return below

    def first_row(self, sine: float = 0.0) -> int:
        """Return the picture's first row that may show something lower than an elevation, given by its sine."""
        lowest = np.fmin.reduce(self.coarse_sines(HORIZON_STEP), axis=1)
        margin = HORIZON_STEP / float(self.lens.camera_matrix[1, 1])
        found = np.flatnonzero(lowest < sine + margin)
        return HORIZON_STEP * int(found[0]) if len(found) else self.lens.height

    @cached_property
    def lowest_elevation(self) -> float:
        """Lowest elevation that the lower edge of the picture shows [rad]."""
        seen = self.lens.ray_table()[-1].astype(np.float64) @ self.rotation[2]
        lowest = float(np.fmin.reduce(seen))  # past the black corners of a fisheye's picture, which see nothing
        return math.asin(max(min(lowest, 1.0), -1.0))

    @property
    def height(self) -> float:
        """Of the optical centre above the ground [m]."""
        return float(self.position[2])

    def directions(self, pixels: Array) -> Array:
        """Return (n, 3) unit vectors in base_footprint that are seen at (n, 2) pixels inside the picture."""
        seen: Array = self.lens.rays_inside(pixels) @ self.rotation.T
        return seen

    def directions_at(self, u: NDArray[np.integer[Any]], v: NDArray[np.integer[Any]]) -> Array:
        """Return (n, 3) unit vectors seen at whole pixels inside the picture; much faster than `directions`."""
        seen: Array = self.lens.ray_table()[v, u].astype(np.float64) @ self.rotation.T
        return seen

    def angles_at(self, pixels: NDArray[np.int32]) -> tuple[Array, Array]:
        """Return azimuth and elevation (n,) seen at (n, 2) whole pixels inside the picture [rad]."""
        seen: tuple[Array, Array] = angles_at(self.lens.ray_table(), self.rotation, pixels)
        return seen

    def ground(self, directions: Array) -> Array:
        """Return where directions meet the ground.

        Args:
            directions: (n, 3) in base_footprint.

        Returns:
            (n, 2) x, y in base_footprint [m]; NaN where the direction does not point below the horizon.
        """
        down = directions[:, 2]
        reach = -self.height / np.where(down < -1e-6, down, np.nan)
        met: Array = self.position[:2] + directions[:, :2] * reach[:, None]
        return met

    def pixels(self, points: Array) -> Array:
        """Return (n, 2) pixels of (n, 3) points in base_footprint; NaN for points that are not in front."""
        return self.lens.project((np.asarray(points, dtype=np.float64) - self.position) @ self.rotation)

    def pixels_of_directions(self, directions: Array) -> Array:
        """Return (n, 2) pixels at which (n, 3) directions in base_footprint are seen; NaN behind the camera."""
        return self.lens.project(np.asarray(directions, dtype=np.float64) @ self.rotation)

    def pixels_on_ground(self, points: Array) -> Array:
        """Return (n, 2) pixels of (n, 2) points on the ground, x and y in base_footprint [m]."""
        flat = np.asarray(points, dtype=np.float64)
        return self.pixels(np.concatenate([flat, np.zeros((len(flat), 1))], axis=1))

    def angle_per_pixel(self, direction: Array) -> float:
        """Return how much one pixel sees around a direction (3,) in base_footprint [rad]."""
        return self.lens.angle_per_pixel(float(self.rotation[:, 2] @ direction))

    def spreads(self, direction: Array, pixels: float = 1.0) -> tuple[float, float]:
        """Return the standard deviations of azimuth and elevation of a direction [rad].

        Pixel noise and pose error are independent, so their variances add. Close to the vertical an angle
        across the ray becomes a larger azimuth.

        Args:
            direction: (3,) unit vector in base_footprint.
            pixels: How many times `SpreadParameters.pixel` the measured place is off.
        """
        noise = self.spread.pixel * pixels * self.angle_per_pixel(direction)
        level = max(math.hypot(float(direction[0]), float(direction[1])), 0.05)
        sideways = self.spread.pose_elevation * abs(float(direction[2])) / level  # a tilt about the line of sight
        azimuth = math.hypot(noise / level, self.spread.pose_azimuth, sideways)
        return azimuth, math.hypot(noise, self.spread.pose_elevation)

    def inside(self, pixels: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        """Return (n,) whether (n, 2) pixels lie in the picture, `margin` pixels from its edges."""
        u, v = pixels.T
        found: NDArray[np.bool_] = (u >= margin) & (u <= self.lens.width - 1 - margin)  # NaN is neither
        found &= (v >= margin) & (v <= self.lens.height - 1 - margin)
        return found

    def sample(self, image: NDArray[Any], pixels: Array) -> tuple[NDArray[Any], NDArray[np.bool_]]:
        """Read an image at (n, 2) pixels.

        Returns:
            (n,) values, those outside the picture read as 0, and (n,) whether each is inside.
        """
        (values,), inside = self.sample_all((image,), pixels)
        return values, inside

    def sample_all(
        self, images: tuple[NDArray[Any], ...], pixels: Array
    ) -> tuple[list[NDArray[Any]], NDArray[np.bool_]]:
        """Read several images at the same (n, 2) pixels, as `sample` does one."""
        index, inside = nearest_pixels(pixels, self.lens.width, self.lens.height)
        read = [image.reshape(-1)[index] for image in images]
        if not inside.all():
            for values in read:
                values[~inside] = 0
        return read, inside

    def coverage(self) -> Array:
        """Return (4,) azimuth of left and right edge, elevation of lower and upper edge, at the middle [rad]."""
        right, bottom = self.lens.width - 1.0, self.lens.height - 1.0
        edges = np.array([[0.0, bottom / 2], [right, bottom / 2], [right / 2, bottom], [right / 2, 0.0]])
        azimuths, elevations = angles(self.directions(edges))
        return np.array([azimuths[0], azimuths[1], elevations[2], elevations[3]])


def angles(directions: Array) -> tuple[Array, Array]:
    """Return azimuth and elevation (n,) of (n, 3) unit vectors [rad]."""
    return np.arctan2(directions[:, 1], directions[:, 0]), np.arcsin(np.clip(directions[:, 2], -1.0, 1.0))


def direction_of(azimuth: float, elevation: float) -> Array:
    """Return the (3,) unit vector with these angles [rad]."""
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def directions_of(azimuths: Array, elevations: Array) -> Array:
    """Return (n, 3) unit vectors with (n,) azimuths and elevations [rad]."""
    level = np.cos(elevations)
    return np.stack([level * np.cos(azimuths), level * np.sin(azimuths), np.sin(elevations)], axis=1)


def fan_of(azimuths: ArrayLike, elevations: ArrayLike) -> Array:
    """Return unit vectors with all pairs of these angles [rad].

    Args:
        azimuths: (m,).
        elevations: (n,).

    Returns:
        (n * m, 3), row by row from the first elevation.
    """
    azimuth, elevation = np.atleast_1d(azimuths), np.atleast_1d(elevations)[:, None]
    level = np.cos(elevation)
    fan = np.empty((elevation.shape[0], azimuth.shape[0], 3))
    fan[..., 0] = level * np.cos(azimuth)
    fan[..., 1] = level * np.sin(azimuth)
    fan[..., 2] = np.sin(elevation)
    return fan.reshape(-1, 3)
