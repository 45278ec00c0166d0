"""Pictures of a board as a camera with a given lens would take them, for trying out a calibration.

The directions that pixels see are found here by OpenCV or by closed forms, not by our own lens, so that a calibration
with our lens that gets the numbers back says something.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tulip_vision.calibration.boards import MARGIN, Board
from tulip_vision.lens import Lens
from tulip_vision.lens_models import EQUIDISTANT, EQUISOLID, PLUMB_BOB

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

SUPERSAMPLING = 3  # rays a pixel, each way
TEXTURE = 60  # [px] of the board's image for a square
FULLEST = (0.35, 0.75)  # share of the picture's height that the board's height fills
TILT = (10.0, 40.0)  # [deg] off facing the camera
PAPER, INK = 225.0, 25.0  # grey levels
LARGEST_ANGLE = math.radians(80.0)  # off the optical axis, of the board's middle
EXACT = (cv2.TERM_CRITERIA_MAX_ITER + cv2.TERM_CRITERIA_EPS, 60, 1e-10)


@dataclass(frozen=True)
class PictureParameters:
    """How the pictures are taken.

    Attributes:
        blur: Standard deviation of the lens's blur [px].
        noise: Standard deviation of each pixel's noise [grey levels].
    """

    blur: float = 0.7
    noise: float = 4.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        if not (0.0 <= self.blur <= 10.0 and 0.0 <= self.noise <= 60.0):
            raise ValueError(f"blur is {self.blur} px, noise {self.noise}; expected 0 to 10 px and 0 to 60 grey levels")


class BoardCamera:
    """Takes pictures of a board."""

    def __init__(self, lens: Lens, board: Board, parameters: PictureParameters) -> None:
        self._lens, self._board, self._parameters = lens, board, parameters
        offsets = (np.arange(SUPERSAMPLING) + 0.5) / SUPERSAMPLING - 0.5
        u = (np.arange(lens.width)[:, None] + offsets).ravel()
        v = (np.arange(lens.height)[:, None] + offsets).ravel()
        grid = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
        self._rays = independent_rays(lens, grid).reshape(len(v), len(u), 3).astype(np.float32)
        image = board.image(TEXTURE).astype(np.float32)
        self._texture = INK + image * ((PAPER - INK) / 255.0)

    def take(self, target: tuple[float, float], rng: np.random.Generator) -> Picture:
        """Return the (height, width) grey picture of the board, its middle near a place in the picture.

        Args:
            target: u, v as a share of the picture, 0 to 1; the board is kept in the picture as well as it fits.
            rng: Draws the board's pose, and the noise.
        """
        rotation, place = self._pose(target, rng)
        # The ray d meets the board where n (t d - place) = 0, with n the board's normal.
        normal = rotation[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = float(normal @ place) / (self._rays @ normal.astype(np.float32))
        reach = np.where(reach > 0.0, reach, np.nan).astype(np.float32)
        margin = MARGIN * self._board.square
        scale = TEXTURE / self._board.square
        on_board = []
        for axis in (rotation[:, 0], rotation[:, 1]):
            along = reach * (self._rays @ axis.astype(np.float32)) - np.float32(axis @ place)
            on_board.append(np.nan_to_num((along + margin) * scale - 0.5, nan=-1e4, posinf=-1e4, neginf=-1e4))
        wall = float(rng.uniform(90.0, 150.0))
        seen = cv2.remap(
            self._texture,
            np.clip(on_board[0], -1e4, 1e4).astype(np.float32),
            np.clip(on_board[1], -1e4, 1e4).astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=wall,
        )
        height, width = self._lens.height, self._lens.width
        picture = seen.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING).mean(axis=(1, 3))
        slope = np.linspace(rng.uniform(0.8, 1.0), rng.uniform(0.8, 1.0), width)  # light from one side
        picture = picture * slope
        if self._parameters.blur > 0.0:
            picture = cv2.GaussianBlur(picture, (0, 0), self._parameters.blur)
        picture = picture + self._parameters.noise * rng.standard_normal(picture.shape)
        taken: Picture = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
        return taken

    def _pose(self, target: tuple[float, float], rng: np.random.Generator) -> tuple[Array, Array]:
        """Return the rotation (3, 3) and the first corner (3,) of a board whose corners are all in the picture."""
        lens, (wide, high) = self._lens, self._board.size
        corners = np.array([[x, y, 0.0] for x in (0.0, wide) for y in (0.0, high)])
        middle = np.array([wide / 2.0, high / 2.0, 0.0])
        share = 1.0
        for _ in range(400):
            # Each failed attempt brings the board a little closer to the middle of the picture.
            spot = [
                (0.5 + share * (part - 0.5)) * size
                for part, size in zip(target, (lens.width, lens.height), strict=True)
            ]
            share *= 0.99
            ray = independent_rays(lens, np.array([spot]))[0]
            if not (np.isfinite(ray).all() and ray[2] > math.cos(LARGEST_ANGLE)):
                continue
            fill = float(rng.uniform(*FULLEST))
            per_pixel = lens.angle_per_pixel(float(ray[2]))
            distance = high / (2.0 * math.tan(min(fill * lens.height * per_pixel / 2.0, 1.2)))
            way, tilt = float(rng.uniform(0.0, 2.0 * math.pi)), math.radians(float(rng.uniform(*TILT)))
            lean = Rotation.from_rotvec([tilt * math.cos(way), tilt * math.sin(way), 0.0])
            spin = Rotation.from_rotvec([0.0, 0.0, float(rng.normal(0.0, 0.2))])
            facing, _ = Rotation.align_vectors(ray[None], np.array([[0.0, 0.0, 1.0]]))
            rotation = (facing * lean * spin).as_matrix()
            place = distance * ray - rotation @ middle
            seen = lens.project(corners @ rotation.T + place)
            with np.errstate(invalid="ignore"):
                inside = ((seen > 2.0) & (seen < (lens.width - 3.0, lens.height - 3.0))).all()
            if inside:
                return rotation, place
        raise ValueError("the board does not fit into the picture; expected a lens that sees more")


def spots(count: int) -> list[tuple[float, float]]:
    """Return places all over the picture, as shares of its size: corners and edges, too, for there lenses bend most."""
    around = [(0.15, 0.2), (0.85, 0.8), (0.85, 0.2), (0.15, 0.8), (0.5, 0.5), (0.5, 0.15), (0.5, 0.85), (0.15, 0.5)]
    around += [(0.85, 0.5), (0.3, 0.35), (0.7, 0.65), (0.7, 0.35), (0.3, 0.65)]
    return [around[index % len(around)] for index in range(count)]


def independent_rays(lens: Lens, pixels: Array) -> Array:
    """Return (n, 3) unit vectors seen at (n, 2) pixels, without use of our own lens models where there is another."""
    matrix, points = lens.camera_matrix, np.ascontiguousarray(pixels).reshape(-1, 1, 2)
    if lens.model == PLUMB_BOB:
        flat = cv2.undistortPoints(points, matrix, lens.distortion, criteria=EXACT).reshape(-1, 2)
    elif lens.model == EQUIDISTANT:
        if lens.largest_angle > LARGEST_ANGLE and not _stays_ahead(lens):
            return lens.rays(pixels)  # OpenCV's answer, x / z and y / z, has no place for directions beside the camera
        flat = cv2.fisheye.undistortPoints(points, matrix, lens.distortion, criteria=EXACT).reshape(-1, 2)
    elif not lens.distortion.any():
        flat = (pixels - matrix[:2, 2]) / matrix[[0, 1], [0, 1]]
        if lens.model == EQUISOLID:
            radius = np.hypot(flat[:, 0], flat[:, 1])
            with np.errstate(invalid="ignore"):
                angle = 2.0 * np.arcsin(radius / 2.0)
            aside = flat * (np.sin(angle) / np.maximum(radius, 1e-12))[:, None]
            return np.concatenate([aside, np.cos(angle)[:, None]], axis=1)
    else:
        return lens.rays(pixels)
    directions = np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
    unit: Array = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return unit


def _stays_ahead(lens: Lens) -> bool:
    corners = lens.rays([(-1.0, -1.0), (lens.width, -1.0), (-1.0, lens.height), (lens.width, lens.height)])
    return bool((corners[:, 2] > 0.1).all())
