"""Everything that the camera sees behind the things on the field: carpet, lines, floor and the hall's wall.

Each pixel's ray, rotated by the camera's pose, meets the ground z = 0 or the wall of a round hall.
A pixel far away sees a long and narrow piece of ground: the ground's picture is taken at the resolution of its
width, and several samples along its length are averaged. Lines stay whole then, and do not flicker.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_sim.field_texture import Ground
from tulip_vision.lens import Lens

Bytes = NDArray[np.uint8]
Float = NDArray[np.float32]

STRIP = 20  # [px] rows that share one resolution of the ground
SHARPNESS = 1.4  # width of a ground pixel over that of a camera pixel: more blurs, less flickers
MOST_SAMPLES = 8  # along the ground that one pixel sees
LOWEST = 0.03  # [m] a camera that lies on the ground is drawn as if this high
STEEPEST = 1e-3  # smallest downward part of a ray that is followed to the ground


class Backdrop:
    """Draws ground and wall for one lens."""

    def __init__(self, lens: Lens, ground: Ground, palette: Bytes, wall: Bytes, wall_radius: float, wall_pixel: float):
        """Prepare the rays.

        Args:
            lens: The camera's lens.
            ground: From `paint_ground`.
            palette: (256, 1, 3) from `ground_palette`.
            wall: From `paint_wall`.
            wall_radius: Radius of the hall round the field's centre [m].
            wall_pixel: Width of one pixel of the wall's picture [m].
        """
        self._width, self._height = lens.width, lens.height
        self._ground = ground
        self._palette = palette
        self._wall = wall
        self._wall_radius = wall_radius
        self._wall_pixel = wall_pixel
        self._focal = float(lens.camera_matrix[1, 1])
        rays = lens.ray_table()
        self._strips = [
            (row, np.ascontiguousarray(rays[row : row + STRIP].reshape(-1, 3).T)) for row in range(0, lens.height, STRIP)
        ]

    def draw(self, camera_in_map: NDArray[np.float64]) -> Bytes:
        """Return the (H, W, 3) BGR picture of ground and wall.

        Args:
            camera_in_map: (4, 4) transform of camera_optical_frame in map.
        """
        rotation = camera_in_map[:3, :3].astype(np.float32)
        x, y = float(camera_in_map[0, 3]), float(camera_in_map[1, 3])
        height = max(float(camera_in_map[2, 3]), LOWEST)
        index = np.zeros((self._height, self._width), np.uint8)
        walls: list[tuple[slice, Bytes, NDArray[np.bool_]]] = []
        # Rays of range t meet the floor where the wall stands nearest; below it no pixel can see the wall.
        wall_distance = max(self._wall_radius - math.hypot(x, y), 0.5)
        for row, rays in self._strips:
            direction = rotation @ rays
            down = -direction[2]
            rows = slice(row, row + rays.shape[1] // self._width)
            steepness = down[:: self._width // 8 - 1]
            ahead = float(np.median(steepness))
            if float(steepness.max()) > 0.0 or float(down.max()) > STEEPEST:
                self._ground_strip(index[rows], direction, down, (x, y, height), ahead)
            if float(down.min()) * wall_distance < height * 1.05:
                picture, seen = self._wall_strip(direction, (x, y, height))
                if seen.any():
                    walls.append((rows, picture, seen))
        picture = np.asarray(cv2.applyColorMap(index, self._palette), np.uint8)
        for rows, wall, seen in walls:
            if seen.all():
                picture[rows] = wall
            else:
                cv2.copyTo(wall, seen.astype(np.uint8), picture[rows])
        return picture

    def _ground_strip(
        self, index: Bytes, direction: Float, down: Float, camera: tuple[float, float, float], ahead: float
    ) -> None:
        x, y, height = camera
        reach = height / max(ahead, 0.02)  # [m] range to the ground in the middle of the strip
        across = reach / self._focal  # [m] ground that one pixel sees, sideways
        along = across * reach / height  # and away from the camera
        level = round(math.log2(max(SHARPNESS * across / self._ground.resolution(0), 1.0)))
        level = min(level, len(self._ground.levels) - 1)
        pixel = self._ground.resolution(level)
        samples = min(max(math.ceil(along / (1.5 * pixel)), 1), MOST_SAMPLES)
        distance = np.float32(height / pixel) / np.maximum(down, np.float32(STEEPEST))
        start_u = np.float32((x - self._ground.left) / pixel - 0.5)
        start_v = np.float32((y - self._ground.lower) / pixel - 0.5)
        rows = index.shape[0]
        if samples == 1:
            u = (direction[0] * distance + start_u).reshape(rows, -1)
            v = (direction[1] * distance + start_v).reshape(rows, -1)
            index[:] = self._read(level, u, v)
            return
        # d(range) / d(pixel) = range^2 / (height focal): the samples lie evenly over one pixel's height.
        offsets = ((np.arange(samples, dtype=np.float32) + np.float32(0.5)) / np.float32(samples) - np.float32(0.5))
        stretch = distance * np.float32(pixel / (height * self._focal))
        factor = distance.reshape(rows, 1, -1) * (1.0 + stretch.reshape(rows, 1, -1) * offsets[None, ::-1, None])
        u = (factor * direction[0].reshape(rows, 1, -1) + start_u).reshape(rows * samples, -1)
        v = (factor * direction[1].reshape(rows, 1, -1) + start_v).reshape(rows * samples, -1)
        cv2.resize(self._read(level, u, v), (self._width, rows), dst=index, interpolation=cv2.INTER_AREA)

    def _read(self, level: int, u: Float, v: Float) -> Bytes:
        picture = cv2.remap(self._ground.levels[level], u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(picture, np.uint8)

    def _wall_strip(
        self, direction: Float, camera: tuple[float, float, float]
    ) -> tuple[Bytes, NDArray[np.bool_]]:
        """Return the wall's picture (rows, W, 3) and where it is seen (rows, W)."""
        x, y, height = camera
        inside = min(1.0, (self._wall_radius - 0.5) / max(math.hypot(x, y), 1e-6))
        x, y = x * inside, y * inside
        dx, dy, dz = direction
        # Where the ray meets the cylinder x^2 + y^2 = R^2: the greater root of a quadratic in the range.
        a = np.maximum(dx * dx + dy * dy, np.float32(1e-6))
        b = dx * np.float32(x) + dy * np.float32(y)
        c = np.float32(x * x + y * y - self._wall_radius**2)
        reach = (np.sqrt(b * b - a * c) - b) / a
        z = reach * dz + np.float32(height)
        angle = cv2.phase(dx * reach + np.float32(x), dy * reach + np.float32(y))
        u = angle.reshape(-1, self._width) * np.float32((self._wall.shape[1] - 1) / (2.0 * math.pi))
        v = (z * np.float32(1.0 / self._wall_pixel)).reshape(-1, self._width)
        picture = cv2.remap(self._wall, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(picture, np.uint8), (v >= 0.0)
