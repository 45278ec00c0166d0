"""Upright coloured things that stand on the ground: what goal posts and poles have in common."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.patches import patches
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import Array, Mask, View, direction_of, directions_of

MOST_CANDIDATES = 12
"""The largest patches are looked at; a crowd in yellow shirts must not cost time without bound."""
BELOW, LEAST_BELOW = np.arange(2.0, 6.0), 3
"""[px] below an upright's foot at which carpet is looked for, and how many must show it."""
ABOVE, LEAST_ABOVE = np.arange(1.0, 8.0), 2
"""[px] the same for blue above its upper end."""
LEAST_SLENDERNESS = 0.6
"""Height over width; one segment of a pole is as high as wide, seen from above a bit less."""


@dataclass(frozen=True)
class Upright:
    """A connected patch below the horizon, seen as something upright.

    Attributes:
        azimuth: Of its middle [rad].
        width: Angle between its left and right edge [rad].
        low, high: Elevation of its lowest and highest point [rad].
        foot_seen: True where carpet is seen right below it.
        blue_above: True where something blue begins right above it.
        on_carpet: True where its lowest point is inside the carpet's outline or at the lower edge of the picture.
        cut: True where the left or right edge of the picture cuts it.
        reaches_up: True where it goes on to the horizon or the upper edge of the picture.
        pixel: u, v of its lowest point.
        pixel_angle: Angle of one pixel there [rad].
    """

    azimuth: float
    width: float
    low: float
    high: float
    foot_seen: bool
    blue_above: bool
    on_carpet: bool
    cut: bool
    reaches_up: bool
    pixel: tuple[float, float]
    pixel_angle: float

    def distance(self, view: View) -> float:
        """Return the distance along the ground to the lowest point [m]; infinite at the horizon or above."""
        return view.height / math.tan(-self.low) if self.low < -1e-3 else math.inf


def find_uprights(
    mask: Mask, segmentation: Segmentation, view: View, least_area: float, corner: tuple[int, int] = (0, 0)
) -> list[Upright]:
    """Return the patches of a mask that lie below the horizon, each with its middle, edges and foot.

    Args:
        mask: (rows, columns) of the picture or of a part of it, nonzero where the thing's colours are.
        segmentation: Of the same picture.
        view: Of the same picture.
        least_area: Smaller patches are noise [px^2].
        corner: u, v in the picture of the mask's first pixel.
    """
    u, v = corner
    below = mask & view.below_horizon[v : v + len(mask), u : u + mask.shape[1]]
    slender = []
    for points, _ in patches(below, least_area, MOST_CANDIDATES, (u, v)):
        _, _, width, height = cv2.boundingRect(points)
        if height > LEAST_SLENDERNESS * width:
            slender.append(points)
    return _measure(slender, segmentation, view) if slender else []


def axis_samples(view: View, image: NDArray[np.uint8], foot: Array, heights: Array) -> NDArray[np.uint8]:
    """Read an image along a vertical axis on the ground; the pixels outside the picture are left out.

    Args:
        view: Of the picture.
        image: (height, width) values to read.
        foot: (2,) where the axis stands in base_footprint [m].
        heights: (n,) above the ground [m].

    Returns:
        (n,) values, 0 outside the picture.
    """
    points = np.column_stack([np.full(len(heights), foot[0]), np.full(len(heights), foot[1]), heights])
    values, inside = view.sample(image, view.pixels(points))
    read: NDArray[np.uint8] = values[inside]
    return read


def foot_on_ground(view: View, azimuth: float, low: float, depth: float) -> tuple[Array, float]:
    """Return where an upright's axis stands, and the elevation of that point.

    Args:
        view: Of the picture.
        azimuth: Of the axis [rad].
        low: Elevation of the lowest point that is seen: the foot's near edge [rad].
        depth: From the near edge to the axis [m].

    Returns:
        (2,) in base_footprint [m], and the elevation [rad].
    """
    distance = view.height / math.tan(-low) + depth
    foot = view.position[:2] + distance * np.array([math.cos(azimuth), math.sin(azimuth)])
    return foot, -math.atan2(view.height, distance)


def _measure(contours: list[NDArray[np.int32]], segmentation: Segmentation, view: View) -> list[Upright]:
    """Return what each contour, (n, 2) pixels, is as an upright; what takes arrays is done for all at once."""
    points = np.concatenate(contours)
    starts = np.cumsum([0, *(len(each) for each in contours)])
    azimuths, elevations = view.angles_at(points)
    parts = [slice(first, last) for first, last in pairwise(starts.tolist())]
    shapes = [_shape(azimuths[part], elevations[part], view) for part in parts]
    azimuth, foot, high, pixel = np.array([[each.azimuth, each.foot, each.high, each.pixel] for each in shapes]).T[
        ..., None
    ]
    beside = np.concatenate([foot - BELOW * pixel, high + ABOVE * pixel], axis=1)  # elevations, a row for each
    places = directions_of(np.repeat(azimuth, beside.shape[1], axis=1).reshape(-1), beside.reshape(-1))
    read, inside = view.sample_all((segmentation.classes, segmentation.on_carpet), view.pixels_of_directions(places))
    classes, carpet, inside = (each.reshape(beside.shape) for each in (*read, inside))
    ground = belongs(classes, Colour.GREEN | Colour.WHITE) & (carpet != 0) & inside
    fits = np.count_nonzero(ground[:, : len(BELOW)], axis=1) >= LEAST_BELOW
    blue = np.count_nonzero(belongs(classes[:, len(BELOW) :], Colour.BLUE), axis=1) >= LEAST_ABOVE
    rows, columns = segmentation.classes.shape
    found = []
    for index, (contour, shape) in enumerate(zip(contours, shapes, strict=True)):
        (lowest_u, lowest_v), top = contour[shape.lowest].tolist(), int(contour[shape.highest, 1])
        left, _, width, _ = cv2.boundingRect(contour)
        found.append(
            Upright(
                azimuth=(shape.azimuth + math.pi) % (2.0 * math.pi) - math.pi,
                width=shape.width,
                low=shape.foot,
                high=shape.high,
                foot_seen=bool(fits[index]),
                blue_above=bool(blue[index]),
                on_carpet=bool(lowest_v >= rows - 2 or segmentation.on_carpet[lowest_v, lowest_u] != 0),
                cut=left <= 0 or left + width >= columns,
                reaches_up=shape.high > -4.0 * shape.pixel or top <= 1,
                pixel=(float(lowest_u), float(lowest_v)),
                pixel_angle=shape.pixel,
            )
        )
    return found


@dataclass(frozen=True)
class _Shape:
    azimuth: float  # of the middle [rad]
    width: float  # [rad]
    foot: float  # elevation [rad]
    high: float  # elevation [rad]
    pixel: float  # angle of one pixel [rad]
    lowest: int  # index of the lowest point
    highest: int


def _shape(azimuths: Array, elevations: Array, view: View) -> _Shape:
    """Return middle, edges and foot of a contour, (n,) angles [rad]."""
    reference = float(azimuths[0])
    turned = (azimuths - reference + math.pi) % (2.0 * math.pi) - math.pi  # no jump at the back of the robot
    lowest, highest = int(elevations.argmin()), int(elevations.argmax())
    low, high = float(elevations[lowest]), float(elevations[highest])
    pixel = view.angle_per_pixel(direction_of(float(azimuths[lowest]), low))
    # The lower two thirds: whatever hangs onto the upper end (a crossbar close by, a net) does not move the middle.
    lower = turned[elevations <= low + max(0.66 * (high - low), 2.0 * pixel)]
    lower.sort()
    left, right = (_at_share(lower, share) for share in (0.94, 0.06))
    middle = 0.5 * (left + right)
    near_middle = elevations[np.abs(turned - middle) <= 0.35 * (left - right) + pixel]
    foot = float(near_middle.min()) - 0.5 * pixel if len(near_middle) else low
    return _Shape(reference + middle, left - right + pixel, foot, high, pixel, lowest, highest)


def _at_share(ordered: Array, share: float) -> float:
    """Return a percentile of (n,) values in rising order, as `np.percentile` has it."""
    place = share * (len(ordered) - 1)
    index = min(int(place), len(ordered) - 2) if len(ordered) > 1 else 0
    low, high = float(ordered[index]), float(ordered[min(index + 1, len(ordered) - 1)])
    return low + (place - index) * (high - low)
