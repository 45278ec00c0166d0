"""Everything that the camera sees behind the things on the field: carpet, lines, floor and the hall's wall.

Rays, rotated by the camera's pose, meet the ground z = 0 or the wall of a round hall. That is worked out for one pixel
in 4 x 4; between them the meeting points are interpolated (at 6 m that errs by 2 mm, a sixth of what a pixel sees).
A pixel far away sees a long and narrow piece of ground: the ground's picture is taken at the resolution of its
width, and several samples along its length are averaged. Lines stay whole then, and do not flicker.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_sim.field_texture import FLOOR, Ground
from tulip_vision.lens import Lens

Bytes = NDArray[np.uint8]
Float = NDArray[np.float32]

BLOCK = 4  # [px] between two rays
STRIP = 20  # [px], a multiple of BLOCK; fewest rows that share one resolution of the ground
SHARPNESS = 1.4  # width of a ground pixel over that of a camera pixel: more blurs, less flickers
SPACING = 2.0  # [ground pixels] between samples: bilinear reading is about that wide
MOST_SAMPLES = 6  # along the ground that one pixel sees
LOWEST = 0.03  # [m] a camera that lies on the ground is drawn as if this high
WALL_GAP = 0.5  # [m] least distance to the wall from which it is drawn, for a camera outside the hall too
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
        # One ray in the middle of each block, and one more block all round, so that interpolation reaches the edges.
        rows, columns = -(-lens.height // BLOCK) + 2, -(-lens.width // BLOCK) + 2
        v, u = np.mgrid[0:rows, 0:columns]
        pixels = np.stack([u.ravel(), v.ravel()], axis=1) * BLOCK - BLOCK / 2.0 - 0.5
        self._shape = (rows, columns)
        self._rays = np.ascontiguousarray(lens.rays(pixels).T.astype(np.float32))

    def draw(self, camera_in_map: NDArray[np.float64]) -> Bytes:
        """Return the (H, W, 3) BGR picture of ground and wall.

        Args:
            camera_in_map: (4, 4) transform of camera_optical_frame in map.
        """
        x, y = float(camera_in_map[0, 3]), float(camera_in_map[1, 3])
        height = max(float(camera_in_map[2, 3]), LOWEST)
        directions = (camera_in_map[:3, :3].astype(np.float32) @ self._rays).reshape(3, *self._shape)
        steepness = -directions[2]
        reach = np.float32(height) / np.maximum(steepness, np.float32(STEEPEST))
        ground_x, ground_y = directions[0] * reach + np.float32(x), directions[1] * reach + np.float32(y)
        sees_ground = steepness > STEEPEST
        if math.hypot(x, y) < self._wall_radius - WALL_GAP:  # else the wall stands in no ray's way
            within = np.float32((self._wall_radius + WALL_GAP) ** 2)
            sees_ground &= ground_x * ground_x + ground_y * ground_y < within
        ground = ground_x - np.float32(self._ground.left), ground_y - np.float32(self._ground.lower)
        index = np.zeros((self._height, self._width), np.uint8)
        for first, last, level, samples in self._strips(sees_ground.any(axis=1), steepness.mean(axis=1), height):
            blocks = slice(first // BLOCK, -(-last // BLOCK) + 2)
            self._draw_ground(index[first:last], ground[0][blocks], ground[1][blocks], level, samples)
        picture = np.asarray(cv2.applyColorMap(index, self._palette), np.uint8)
        self._draw_wall(picture, directions, (x, y, height))
        return picture

    def _strips(self, sees_ground: NDArray[np.bool_], ahead: Float, height: float) -> list[tuple[int, int, int, int]]:
        """Divide the rows that see ground into strips to be drawn alike.

        Args:
            sees_ground: (blocks,) whether any ray meets the ground before the wall.
            ahead: (blocks,) mean downward part of the rays.
            height: Of the camera [m].

        Returns:
            For each strip its first row, the row after its last, the level of the ground's picture to read, and the
            number of samples along the ground for each row.
        """
        seen, means = sees_ground.tolist(), ahead.tolist()
        strips: list[tuple[int, int, int, int]] = []
        count = STRIP // BLOCK + 2
        for row in range(0, self._height, STRIP):
            blocks = slice(row // BLOCK, row // BLOCK + count)
            if not any(seen[blocks]):
                continue
            level, samples = self._resolution(height, sum(means[blocks]) / len(means[blocks]))
            last = min(row + STRIP, self._height)
            if strips and strips[-1][1:] == (row, level, samples):
                strips[-1] = (strips[-1][0], last, level, samples)
            else:
                strips.append((row, last, level, samples))
        return strips

    def _resolution(self, height: float, ahead: float) -> tuple[int, int]:
        """Return the level of the ground's picture to read, and how many samples along the ground a pixel needs.

        Args:
            height: Of the camera [m].
            ahead: Downward part of the ray in the middle of some rows.
        """
        reach = height / max(ahead, 0.02)  # [m] range to the ground in the middle of the strip
        across = reach / self._focal  # [m] ground that one pixel sees, sideways
        along = across * reach / height  # and away from the camera
        level = round(math.log2(max(SHARPNESS * across / self._ground.resolution(0), 1.0)))
        level = min(level, len(self._ground.levels) - 1)
        samples = min(max(math.ceil(along / (SPACING * self._ground.resolution(level))), 1), MOST_SAMPLES)
        return level, samples

    def _draw_ground(self, index: Bytes, x: Float, y: Float, level: int, samples: int) -> None:
        """Fill rows of the index picture.

        Args:
            index: The rows, drawn into.
            x: (blocks, columns) where rays meet the ground [m], from the corner of its pictures.
            y: The same, (blocks, columns).
            level: Of the ground's picture to read.
            samples: For each row.
        """
        pixel = np.float32(self._ground.resolution(level))
        u, v = (self._finer(place / pixel - np.float32(0.5), BLOCK * samples, BLOCK) for place in (x, y))
        rows = index.shape[0]
        part = slice(rows * samples), slice(self._width)
        read = cv2.remap(
            self._ground.levels[level],
            u[part],
            v[part],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=FLOOR,
        )
        if samples == 1:
            index[:] = read
        else:
            index[:] = cv2.resize(read, (self._width, rows), interpolation=cv2.INTER_AREA)

    def _draw_wall(self, picture: Bytes, directions: Float, camera: tuple[float, float, float]) -> None:
        """Draw the wall at half the resolution: it is a blurred background, and only its foot needs to be sharp."""
        x, y, height = camera
        inside = min(1.0, (self._wall_radius - WALL_GAP) / max(math.hypot(x, y), 1e-6))
        x, y = x * inside, y * inside
        # Rays that reach the ground before the wall can stand in their way are of no interest.
        nearest = self._wall_radius - math.hypot(x, y)
        rows = np.flatnonzero(directions[2].max(axis=1) * nearest + height > 0.0)
        if not len(rows):
            return
        # Three rows of blocks at least, since the outer ones are left out in the end.
        first = max(min(int(rows[0]) - 1, self._shape[0] - 3), 0)
        last = max(min(int(rows[-1]) + 2, self._shape[0]), first + 3)
        dx, dy, dz = directions[:, first:last]
        # Where the ray meets the cylinder x^2 + y^2 = R^2: the greater root of a quadratic in the range.
        a = np.maximum(dx * dx + dy * dy, np.float32(1e-6))
        b = dx * np.float32(x) + dy * np.float32(y)
        c = np.float32(x * x + y * y - self._wall_radius**2)
        reach = (np.sqrt(b * b - a * c) - b) / a
        z = reach * dz + np.float32(height)
        above = np.flatnonzero(z.max(axis=1) > 0.0)
        if not len(above):
            return
        last = int(above[-1]) + 4  # what is left out sees the ground only
        dx, dy, z, reach = dx[:last], dy[:last], z[:last], reach[:last]
        wall_x, wall_y = dx * reach + np.float32(x), dy * reach + np.float32(y)
        # Counted from the middle of the view, so that the jump by a whole turn lies behind the camera.
        middle = math.atan2(float(wall_y.mean()), float(wall_x.mean()))
        cosine, sine = math.cos(middle), math.sin(middle)
        angle = np.arctan2(cosine * wall_y - sine * wall_x, cosine * wall_x + sine * wall_y) + np.float32(middle)
        u = angle * np.float32(self._wall.shape[1] / (2.0 * math.pi))
        v = np.clip(z * np.float32(1.0 / self._wall_pixel), 0.0, self._wall.shape[0] - 1.0).astype(np.float32)
        places = self._finer(np.stack([u, v], axis=2), BLOCK // 2, BLOCK // 2)
        wall = cv2.remap(self._wall, places, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        foot = self._finer(np.minimum(z, np.float32(1.0)), BLOCK, BLOCK)
        sharp = cv2.resize(wall, foot.shape[::-1], interpolation=cv2.INTER_LINEAR)
        part = picture[first * BLOCK : first * BLOCK + foot.shape[0]]
        seen = cv2.compare(foot, 0.0, cv2.CMP_GE)[: part.shape[0], : part.shape[1]]
        cv2.copyTo(sharp[: part.shape[0], : part.shape[1]], seen, part)

    @staticmethod
    def _finer(blocks: Float, rows: int, columns: int) -> Float:
        """Interpolate between the middles of blocks, rows x columns values a block, and leave out the outer blocks."""
        size = (blocks.shape[1] * columns, blocks.shape[0] * rows)
        fine = cv2.resize(blocks, size, interpolation=cv2.INTER_LINEAR)
        return np.asarray(fine[rows:-rows, columns:-columns], np.float32)
