"""The lens: from directions to pixels and back, distortion included.

Pixel (u, v) = (0, 0) is the middle of the upper left pixel; u grows to the right, v downwards. Directions
are in camera_optical_frame: x right, y down, z along the optical axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tulip_vision.lens_models import COEFFICIENTS, EQUIDISTANT, PLUMB_BOB, make_model
from tulip_vision.pixel_loops import project_plumb_bob, rays_between

Array = NDArray[np.float64]

LARGEST_SIDE = 2**14  # [px] of a picture; tables are made of its size
MODEL_NAMES = {"rational_polynomial": PLUMB_BOB, "fisheye": EQUIDISTANT}  # other names in use for the same two models


class Lens:
    """A camera's lens and its picture.

    Attributes:
        width, height: Of the picture [px].
        camera_matrix: (3, 3) fx, fy, cx, cy [px] in their usual places.
        distortion: (n,) coefficients of the model.
        model: "plumb_bob", "equidistant", "equisolid" or "rectilinear"; see `lens_models` for what they mean.
        largest_angle: To the optical axis, up to which the lens sees [rad].
    """

    def __init__(
        self, width: int, height: int, camera_matrix: ArrayLike, distortion: ArrayLike, model: str = PLUMB_BOB
    ) -> None:
        """Make a lens.

        Args:
            width: Of the picture [px].
            height: Of the picture [px].
            camera_matrix: (3, 3) [px].
            distortion: (n,) coefficients; n is 4, 5 or 8 for plumb_bob, 4 for equidistant, and 4 or 0 for equisolid
                and rectilinear.
            model: "plumb_bob" (or "rational_polynomial"), "equidistant" (or "fisheye"), "equisolid", "rectilinear".

        Raises:
            ValueError: if a shape, a number or the model is not one of these.
        """
        model = MODEL_NAMES.get(model, model)
        if model not in COEFFICIENTS:
            raise ValueError(f"lens model is {model!r}; expected one of {', '.join((*COEFFICIENTS, *MODEL_NAMES))}")
        if not 1 <= width <= LARGEST_SIDE or not 1 <= height <= LARGEST_SIDE:
            raise ValueError(f"picture is {width} x {height} px; expected 1 to {LARGEST_SIDE} each")
        matrix = np.array(camera_matrix, dtype=np.float64)
        coefficients = np.array(distortion, dtype=np.float64).reshape(-1)
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all() or min(matrix[0, 0], matrix[1, 1]) <= 0.0:
            raise ValueError(f"camera_matrix is {matrix.tolist()}; expected 3 x 3, finite, with fx, fy > 0 px")
        if matrix[0, 1] != 0.0 or not np.array_equal(matrix[[1, 2, 2, 2], [0, 0, 1, 2]], [0.0, 0.0, 0.0, 1.0]):
            raise ValueError(f"camera_matrix is {matrix.tolist()}; expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
        if coefficients.size not in COEFFICIENTS[model] or not np.isfinite(coefficients).all():
            expected = " or ".join(str(n) for n in COEFFICIENTS[model])
            raise ValueError(f"distortion is {coefficients.tolist()}; expected {expected} finite numbers for {model}")
        matrix.setflags(write=False)
        coefficients.setflags(write=False)
        self.width = int(width)
        self.height = int(height)
        self.camera_matrix = matrix
        self.distortion = coefficients
        self.model = model
        self._model = make_model(model, coefficients)
        self.largest_angle = self._model.largest_angle
        self._coarse_ray_tables: dict[int, NDArray[np.float32]] = {}

    @classmethod
    def from_camera_info(cls, info: Mapping[str, Any]) -> Lens:
        """Make a lens from the entries width, height, distortion_model, d (5,) and k (9,) of a CameraInfo.

        Raises:
            ValueError: if an entry is missing or not usable.
        """
        missing = [key for key in ("width", "height", "distortion_model", "d", "k") if key not in info]
        if missing:
            raise ValueError(f"camera info lacks {', '.join(missing)}; expected width, height, distortion_model, d, k")
        k = np.asarray(info["k"], dtype=np.float64)
        if k.size != 9:
            raise ValueError(f"camera info's k has {k.size} numbers; expected 9 (0 means: not calibrated)")
        return cls(int(info["width"]), int(info["height"]), k.reshape(3, 3), info["d"], str(info["distortion_model"]))

    def to_camera_info(self) -> dict[str, Any]:
        """Return what `from_camera_info` reads, with plain lists of floats."""
        name = "rational_polynomial" if self.distortion.size == 8 else self.model
        return {
            "width": self.width,
            "height": self.height,
            "distortion_model": name,
            "d": [float(value) for value in self.distortion],
            "k": [float(value) for value in self.camera_matrix.reshape(-1)],
        }

    def project(self, points: ArrayLike) -> Array:
        """Return where points appear in the picture, camera matrix times distorted (x / z, y / z).

        Args:
            points: (n, 3) points or directions in camera_optical_frame, any length.

        Returns:
            (n, 2) pixels; NaN for points further from the optical axis than the lens sees: behind the camera,
            or so far outside the picture that the distortion folds back on itself.
        """
        directions = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        if self._plumb_bob is not None:
            found: Array = project_plumb_bob(directions, *self._plumb_bob)
            return found
        x, y, z = directions.T
        aside = x * x + y * y
        if self._largest_tangent is not None:
            visible = (z > 1e-9) & (aside <= (z * self._largest_tangent) ** 2)
        else:
            distance = np.sqrt(aside + z * z)
            visible = (z >= distance * self._least_cosine) & (distance > 1e-9)
        if visible.all():
            return self._to_pixels(self._model.flatten(directions))
        pixels = np.full((len(directions), 2), np.nan)
        if visible.any():
            pixels[visible] = self._to_pixels(self._model.flatten(directions[visible]))
        return pixels

    def rays(self, pixels: ArrayLike) -> Array:
        """Return the directions seen at pixels, the inverse of `project`.

        Args:
            pixels: (n, 2), inside the picture or close to it.

        Returns:
            (n, 3) unit vectors in camera_optical_frame; NaN at pixels to which the lens sends no light, as in the black
            corners round a fisheye's picture.
        """
        points = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        (fx, _, cx), (_, fy, cy), _ = self.camera_matrix.tolist()
        return self._model.unflatten((points - (cx, cy)) / (fx, fy))

    def rays_inside(self, pixels: Array) -> Array:
        """Return the same as `rays` for (n, 2) pixels inside the picture, read from the table: much faster.

        Between the table's pixels rays are interpolated, which errs by less than a thousandth of a pixel.
        """
        rays: Array = rays_between(self._ray_table, pixels)
        return rays

    def ray_table(self) -> NDArray[np.float32]:
        """Return the direction seen at each pixel, computed once.

        Returns:
            (height, width, 3) unit vectors in camera_optical_frame, read-only.
        """
        return self._ray_table

    def coarse_ray_table(self, step: int) -> NDArray[np.float32]:
        """Return the direction seen at one pixel of each block of step x step pixels, computed once for each step.

        Returns:
            (rows, columns, 3) unit vectors in camera_optical_frame, read-only, of the pixels whose row and column are
            step // 2, step // 2 + step, and so on.
        """
        if step not in self._coarse_ray_tables:
            table = np.ascontiguousarray(self._ray_table[step // 2 :: step, step // 2 :: step])
            table.setflags(write=False)
            self._coarse_ray_tables[step] = table
        return self._coarse_ray_tables[step]

    def angle_per_pixel(self, cosine: float) -> float:
        """Return how much one pixel sees, across the way to the picture's middle [rad].

        Args:
            cosine: Of the angle between the pixel's direction and the optical axis.
        """
        cosines, seen = self._angles_per_pixel
        return float(np.interp(cosine, cosines, seen))

    def horizon(self, rotation: ArrayLike, count: int = 33) -> Array:
        """Return the points of the horizon that lie in the picture, from left to right.

        Args:
            rotation: (3, 3) rotation of camera_optical_frame in a level frame (z up), as in base_footprint.
            count: Number of directions tried over the field of view, >= 2.

        Returns:
            (m, 2) pixels, m <= count; empty where the horizon is not in the picture.
        """
        level = np.asarray(rotation, dtype=np.float64).reshape(3, 3)
        forward = level[:, 2]
        middle = math.atan2(forward[1], forward[0])
        azimuths = np.linspace(middle + math.pi / 2.0, middle - math.pi / 2.0, count + 2)[1:-1]
        directions = np.stack([np.cos(azimuths), np.sin(azimuths), np.zeros(count)], axis=1)
        pixels = self.project(directions @ level)
        with np.errstate(invalid="ignore"):
            inside = (pixels >= -0.5).all(axis=1) & (pixels <= (self.width - 0.5, self.height - 0.5)).all(axis=1)
        found: Array = pixels[inside]
        return found

    @property
    def field_of_view(self) -> tuple[float, float]:
        """Angles between the left and right, and the upper and lower edge, through the principal point [rad]."""
        cx, cy = self.camera_matrix[0, 2], self.camera_matrix[1, 2]
        right, bottom = self.width - 0.5, self.height - 0.5
        left_ray, right_ray, upper_ray, lower_ray = self.rays([(-0.5, cy), (right, cy), (cx, -0.5), (cx, bottom)])
        return (
            math.acos(float(np.clip(left_ray @ right_ray, -1.0, 1.0))),
            math.acos(float(np.clip(upper_ray @ lower_ray, -1.0, 1.0))),
        )

    @cached_property
    def _ray_table(self) -> NDArray[np.float32]:
        v, u = np.mgrid[0 : self.height, 0 : self.width]
        table = self.rays(np.stack([u.ravel(), v.ravel()], axis=1)).astype(np.float32)
        table = table.reshape(self.height, self.width, 3)
        table.setflags(write=False)
        return table

    @cached_property
    def _angles_per_pixel(self) -> tuple[Array, Array]:
        """Cosines of angles to the optical axis, rising, and what a pixel sees there, the mean all round it [rad]."""
        angles = np.linspace(self.largest_angle, 0.005, 256)[1:, None]
        turn = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
        step = 1e-3  # [rad] small enough to be linear, large enough for the projection's rounding
        before, after = (
            np.stack([np.sin(angles) * np.cos(way), np.sin(angles) * np.sin(way), np.cos(angles) + 0.0 * way], axis=-1)
            for way in (turn - step / 2.0, turn + step / 2.0)
        )
        moved = np.linalg.norm(self.project(after) - self.project(before), axis=1).reshape(len(angles), len(turn))
        return np.cos(angles[:, 0]), step * np.sin(angles[:, 0]) / moved.mean(axis=1)

    @cached_property
    def _largest_tangent(self) -> float | None:
        """Tangent of the largest angle; None if the lens sees beside itself, where a cosine must tell."""
        return math.tan(self.largest_angle + 1e-12) if self.largest_angle < math.radians(89.0) else None

    @cached_property
    def _pixel_scale(self) -> tuple[Array, Array]:
        """Focal lengths (fx, fy) and middle (cx, cy) [px]."""
        return self.camera_matrix[[0, 1], [0, 1]], self.camera_matrix[:2, 2]

    @cached_property
    def _plumb_bob(self) -> tuple[Array, Array, float] | None:
        """What `project_plumb_bob` takes; None for other lenses."""
        if self.model != PLUMB_BOB or self._largest_tangent is None:
            return None
        coefficients = np.zeros(8)
        coefficients[: self.distortion.size] = self.distortion
        return coefficients, np.concatenate(self._pixel_scale), self._largest_tangent

    @cached_property
    def _least_cosine(self) -> float:
        # Rounding must not cost the last direction, which projects where `rays` came from.
        return math.cos(self.largest_angle) - 1e-12

    def _to_pixels(self, points: Array) -> Array:
        """Return (n, 2) pixels of (n, 2) points of the image plane at distance 1."""
        focal_lengths, middle = self._pixel_scale
        pixels: Array = points * focal_lengths + middle
        return pixels


HEAD_CAMERA_FOCAL_LENGTH = 455.0
"""[px] assumed: no source names TUlip's camera. With the distortion below, 640 x 480 px see about 78 by 59 deg."""
HEAD_CAMERA_DISTORTION: Sequence[float] = (-0.24, 0.06, 0.0005, -0.0004, 0.0)
"""Assumed: the barrel of a cheap wide-angle webcam lens; it pulls the picture's corners in by tens of pixels."""


def head_camera_lens() -> Lens:
    """Return the head camera's lens: 640 x 480 px, barrel distortion. All of it is assumed (see above)."""
    matrix = np.array([[HEAD_CAMERA_FOCAL_LENGTH, 0.0, 321.5], [0.0, HEAD_CAMERA_FOCAL_LENGTH, 238.0], [0.0, 0.0, 1.0]])
    return Lens(640, 480, matrix, HEAD_CAMERA_DISTORTION, PLUMB_BOB)
