"""Points on the middles of white lines, from vertical and horizontal cuts through the picture.

A pixel belongs to a line if it is clearly whiter than the pixels one line width to either side, and both of
those are carpet. The expected width follows from the camera's height and the row, so the wall, goal posts and
white shoes give no points. The middle of each run is found to a fraction of a pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.segmentation import Colour, Segmentation
from tulip_vision.view import Array, View

LONGEST_REACH = 60
"""[px] lines at the robot's own feet are not looked for beyond that."""
SLANTED = 1.6
"""Thickness of a line that runs at up to 50 deg to its cut, over that of one at a right angle."""
MARGIN = 2.0
"""[px] blur on both sides."""
SLIMMEST = 0.4
"""Least thickness of a line over the largest: two thirds of what is expected at a right angle."""

LONGEST_SHORT = 10
"""[px] up to which the middle of a run is found from how white its pixels are."""
BESIDE = 2
"""[px] of blur to either side, that count for the middle."""


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
    # Where there is no carpet the side is white beyond measure: nothing stands out from it.
    side = cv2.max(segmentation.whiteness, cv2.compare(segmentation.mask(Colour.GREEN), 0, cv2.CMP_EQ))
    middle = int(np.searchsorted(-slant[first:last], -parameters.near)) + first
    margin = 12  # [px] runs at the border between the two bands belong to both
    runs = []  # column and row at which each begins, and its length [px]; those of vertical cuts first
    for low, high, step in (
        (first, min(middle + margin, last), parameters.column_step // 2),
        (max(middle - margin, first), last, parameters.column_step),
    ):
        if high - low < 2:
            continue
        columns = slice(step // 2, view.lens.width, step)
        reach = np.minimum(np.rint(across_row[low:high]), LONGEST_REACH).astype(np.intp)
        place = np.arange(low, high)
        sides = side[:, columns]
        higher = cv2.max(sides[np.maximum(place - reach, 0)], sides[np.minimum(place + reach, len(side) - 1)])
        white = cv2.subtract(segmentation.whiteness[low:high, columns], higher) > contrast[low:high, None]
        cut, start, length = _runs(white.T, np.broadcast_to(reach, white.T.shape))
        runs.append((step // 2 + step * cut, start + low, length))
    vertical = sum(len(length) for _, _, length in runs)
    steps = np.where(slant[first:last] < parameters.near, parameters.row_step, parameters.row_step // 4)
    chosen = first + np.flatnonzero((np.arange(first, last) % steps) == 0)
    reach = np.minimum(np.rint(across_column[chosen]), LONGEST_REACH).astype(np.intp)
    white = cv2.subtract(segmentation.whiteness[chosen], _higher_side(side[chosen], reach)) > contrast[chosen, None]
    cut, start, length = _runs(white, np.broadcast_to(reach[:, None], white.shape))
    runs.append((start, chosen[cut], length))
    u, v, length = (np.concatenate(each) for each in zip(*runs, strict=True))
    stride = np.ones(len(u), dtype=np.intp)
    stride[:vertical] = view.lens.width
    middles = _middles(segmentation.whiteness.reshape(-1), v * view.lens.width + u, stride, length)
    pixels = np.stack([u, v], axis=1).astype(np.float64)
    pixels[:vertical, 1] += middles[:vertical]
    pixels[vertical:, 0] += middles[vertical:]
    nearest = np.rint(pixels).astype(np.intp)
    pixels = pixels[segmentation.on_carpet[nearest[:, 1], nearest[:, 0]] != 0]
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


def _contrast(slant: Array, brightness: float, view: View, parameters: LinePointParameters) -> NDArray[np.uint8]:
    """Return the contrast asked of a line in each row of the picture."""
    focal = float(view.lens.camera_matrix[1, 1])
    thickness = parameters.line_width * focal * view.height / slant**2  # [px] of a line across the line of sight
    share = np.clip(thickness / 3.0, 0.0, 1.0)  # three pixels thick: the middle keeps the paint's own colour
    asked = parameters.least_contrast + share * (parameters.contrast - parameters.least_contrast)
    return np.clip(asked * brightness, 9.0, 90.0).astype(np.uint8)


def _higher_side(rows: NDArray[np.uint8], reach: NDArray[np.intp]) -> NDArray[np.uint8]:
    """Return for each pixel of (n, width) rows the higher of the two that are `reach` (n,) to its left and right.

    Beyond the ends of a row its last pixels count. Rows of the same reach must follow each other.
    """
    width = rows.shape[1]
    most = int(reach.max())
    wider = cv2.copyMakeBorder(rows, 0, 0, most, most, cv2.BORDER_REPLICATE)
    higher = np.empty_like(rows)
    borders = [0, *(np.flatnonzero(np.diff(reach)) + 1).tolist(), len(reach)]
    for first, last in pairwise(borders):
        left, right = most - int(reach[first]), most + int(reach[first])
        part = wider[first:last]
        np.maximum(part[:, left : left + width], part[:, right : right + width], out=higher[first:last])
    return higher


def _runs(
    white: NDArray[np.bool_], reach: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Find the runs of white pixels in each row of an array that are as thick as a line.

    Args:
        white: (cuts, length).
        reach: (cuts, length) more than the expected width [px]; runs longer than twice that are no lines.

    Returns:
        For each run the index of its cut, its first place within that, and its length [px].
    """
    cuts, length = white.shape
    padded = np.zeros((cuts, length + 2), dtype=np.bool_)
    padded[:, 1:-1] = white
    # Each row begins and ends without white, so that beginnings and ends of runs take turns.
    change = np.flatnonzero(padded[:, 1:] != padded[:, :-1])  # in a row of length + 1
    cut, start = np.divmod(change[0::2], length + 1)
    long = change[1::2] - change[0::2]
    expected = reach[cut, start + long // 2]
    thin = (long <= 2 * expected) & (start >= BESIDE) & (start + long <= length - BESIDE)
    thin &= long >= SLIMMEST * (expected - MARGIN)  # threads of a net are white too
    return cut[thin], start[thin], long[thin]


def _middles(
    whiteness: NDArray[np.uint8], start: NDArray[np.intp], stride: NDArray[np.intp], length: NDArray[np.intp]
) -> Array:
    """Return (n,) how far the middle of each run is from its first pixel [px].

    Args:
        whiteness: Of all pixels, row by row.
        start: (n,) index of each run's first pixel.
        stride: (n,) from one pixel of the run to the next.
        length: (n,) [px].
    """
    middles = 0.5 * (length - 1)
    short = np.flatnonzero(length <= LONGEST_SHORT)
    # Few pixels: the centre of what each has of the paint is exact to a tenth of a pixel.
    window = np.arange(-BESIDE, LONGEST_SHORT + BESIDE)[:, None]
    used = window < length[short] + BESIDE  # (window, runs): sums over the first axis are faster
    index = start[short] + window * stride[short]
    values = whiteness.take(index, mode="clip")  # clipped: beyond the last line, but not used then
    floor = np.where(used, values, np.uint8(255)).min(axis=0)
    weights = np.where(used, values - floor, np.uint8(0)).astype(np.float32)
    middles[short] = (window[:, 0].astype(np.float32) @ weights) / np.maximum(weights.sum(axis=0), 1e-6)
    return middles
