"""Points on the middles of white lines, from vertical and horizontal cuts through the picture.

A pixel belongs to a line if it is clearly whiter than the pixels one line width to either side, and both of
those are carpet. The expected width follows from the camera's height and the row, so the wall, goal posts and
white shoes give no points. The middle of each run is found to a fraction of a pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_vision.line_cuts import MARGIN, cut_lines
from tulip_vision.segmentation import Segmentation
from tulip_vision.view import Array, View

LONGEST_REACH = 60
"""[px] lines at the robot's own feet are not looked for beyond that."""
SLANTED = 1.6
"""Thickness of a line that runs at up to 50 deg to its cut, over that of one at a right angle."""


@dataclass(frozen=True)
class LinePointParameters:
    """How points on lines are found.

    Attributes:
        line_width: [m].
        contrast: Least difference in whiteness to the carpet on both sides, at the reference brightness, for
            lines several pixels thick [0-255]. Blur takes from thinner ones, so that less is asked of them.
        least_contrast: For the thinnest lines [0-255].
        column_step: Distance between vertical cuts close to the robot [px]; half of it far away.
        row_step: Distance between horizontal cuts close to the robot [px]; a quarter of it far away, where the
            goal area's sides are 20 px high.
        near: What is close to the robot: slant range from the camera [m].
        farthest: Largest distance along the ground [m].
        own_reach, own_half_width: Nothing is looked for where the own feet are: up to own_reach ahead and
            behind, own_half_width to either side of base_footprint [m].
    """

    line_width: float = 0.05
    contrast: float = 65.0  # grey legs stand out by 40, paint by 150
    least_contrast: float = 26.0  # five times the camera's noise; a line at 6 m keeps about 60
    column_step: int = 4
    row_step: int = 4
    near: float = 3.0  # [m] closer, lines are long in the picture and fewer cuts do
    farthest: float = 8.0  # [m] one pixel is 0.12 m deep there
    own_reach: float = 0.30
    own_half_width: float = 0.28

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for name in ("line_width", "contrast", "least_contrast", "near", "farthest"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected > 0")
        if self.column_step < 2 or self.row_step < 4:
            raise ValueError(f"steps are {self.column_step} and {self.row_step} px; expected >= 2 px and >= 4 px")
        if self.own_reach < 0.0 or self.own_half_width < 0.0:
            raise ValueError(f"own zone is {self.own_reach} m by {self.own_half_width} m; expected >= 0 m")


@dataclass(frozen=True)
class LinePoints:
    """Points on the middles of lines.

    Attributes:
        pixels: (n, 2) [px].
        near: (n,) whether each is close to the robot, where cuts are twice as far apart.
        flat: (n, 2) the same without lens distortion: x / z and y / z times the focal length [px].
        ground: (n, 2) in base_footprint [m].
    """

    pixels: Array
    near: NDArray[np.bool_]
    flat: Array
    ground: Array


def find_line_points(segmentation: Segmentation, view: View, parameters: LinePointParameters) -> LinePoints:
    """Return the points of all lines on the carpet."""
    across_row, across_column, slant = _expected_widths(view, parameters)
    lowest = view.height / parameters.farthest  # tangent of the angle below the horizon
    rows = np.flatnonzero(slant < view.height / math.sin(math.atan(lowest)))
    if not len(rows):
        return LinePoints(np.empty((0, 2)), np.empty(0, dtype=np.bool_), np.empty((0, 2)), np.empty((0, 2)))
    first, last = int(rows[0]), int(rows[-1]) + 1
    contrast = _contrast(slant, segmentation.brightness, view, parameters)
    middle = int(np.searchsorted(-slant[first:last], -parameters.near)) + first
    pixels = cut_lines(
        segmentation.whiteness,
        segmentation.classes,
        segmentation.on_carpet,
        (first, middle, last),
        (parameters.column_step, parameters.row_step),
        np.minimum(np.rint(across_row), LONGEST_REACH).astype(np.intp),
        np.minimum(np.rint(across_column), LONGEST_REACH).astype(np.intp),
        contrast,
    )
    rays = view.lens.rays_inside(pixels)
    ground = view.ground(rays @ view.rotation.T)
    with np.errstate(invalid="ignore"):
        far = np.hypot(*(ground - view.position[:2]).T) < parameters.farthest
    own_feet = (np.abs(ground[:, 0]) < parameters.own_reach) & (np.abs(ground[:, 1]) < parameters.own_half_width)
    kept = far & ~own_feet
    focal = float(view.lens.camera_matrix[0, 0])
    near = np.rint(pixels[kept, 1]).astype(np.intp) >= middle
    return LinePoints(pixels[kept], near, (rays[kept, :2] / rays[kept, 2:]) * focal, ground[kept])


def _expected_widths(view: View, parameters: LinePointParameters) -> tuple[Array, Array, Array]:
    """Return how thick lines appear in each row of the picture, at its middle.

    Returns:
        Thickness, with a margin, of a line across and of one along the line of sight [px], and the slant range
        [m], infinite above the horizon.
    """
    sines = view.middle_sines
    with np.errstate(divide="ignore"):
        slant = np.where(sines < -1e-3, view.height / -sines, np.inf)
    focal = float(view.lens.camera_matrix[1, 1])
    wide = parameters.line_width * focal / slant
    deep = wide * view.height / slant
    return SLANTED * deep + MARGIN, SLANTED * wide + MARGIN, slant


def _contrast(slant: Array, brightness: float, view: View, parameters: LinePointParameters) -> NDArray[np.int32]:
    """Return the contrast asked of a line in each row of the picture."""
    focal = float(view.lens.camera_matrix[1, 1])
    thickness = parameters.line_width * focal * view.height / slant**2  # [px] of a line across the line of sight
    share = np.clip(thickness / 3.0, 0.0, 1.0)  # three pixels thick: the middle keeps the paint's own colour
    asked = parameters.least_contrast + share * (parameters.contrast - parameters.least_contrast)
    return np.clip(asked * brightness, 9.0, 90.0).astype(np.int32)
