"""Upright coloured things that stand on the ground: what goal posts and poles have in common."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.patches import patches
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import Array, Mask, View, angles, direction_of, fan_of

MOST_CANDIDATES = 12
"""The largest patches are looked at; a crowd in yellow shirts must not cost time without bound."""
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
    left, top, width, height = cv2.boundingRect(mask)
    if width == 0:
        return []
    u, v = corner[0] + left, corner[1] + top
    horizon = view.below_horizon[v : v + height, u : u + width]
    below = np.bitwise_and(mask[top : top + height, left : left + width], horizon)
    found = []
    for points, _ in patches(below, least_area, MOST_CANDIDATES, (u, v)):
        _, _, width, height = cv2.boundingRect(points)
        if height > LEAST_SLENDERNESS * width:
            found.append(_measure(points, segmentation, view))
    return found


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


def _measure(points: NDArray[np.int32], segmentation: Segmentation, view: View) -> Upright:
    azimuths, elevations = angles(view.directions_at(points[:, 0], points[:, 1]))
    reference = float(azimuths[0])
    turned = (azimuths - reference + math.pi) % (2.0 * math.pi) - math.pi  # no jump at the back of the robot
    lowest, highest = int(np.argmin(elevations)), int(np.argmax(elevations))
    low, high = float(elevations[lowest]), float(elevations[highest])
    pixel = view.angle_per_pixel(direction_of(float(azimuths[lowest]), low))
    # The lower two thirds: whatever hangs onto the upper end (a crossbar close by, a net) does not move the middle.
    lower = turned[elevations <= low + max(0.66 * (high - low), 2.0 * pixel)]
    lower.sort()
    # The 94th and the 6th percentile, as `np.percentile` has them.
    left, right = np.interp([0.94 * (len(lower) - 1), 0.06 * (len(lower) - 1)], np.arange(len(lower)), lower).tolist()
    middle = reference + 0.5 * (left + right)
    rows, columns = segmentation.classes.shape
    near_middle = np.abs(turned - (middle - reference)) <= 0.35 * (left - right) + pixel
    foot = float(elevations[near_middle].min()) - 0.5 * pixel if near_middle.any() else low
    under = [foot - step * pixel for step in (2.0, 3.0, 4.0, 5.0)]
    below = view.pixels_of_directions(fan_of(middle, under))
    (classes, carpet), inside = view.sample_all((segmentation.classes, segmentation.on_carpet), below)
    ground = belongs(classes, Colour.GREEN | Colour.WHITE) & (carpet != 0) & inside
    top, bottom = points[highest], points[lowest]
    return Upright(
        azimuth=(middle + math.pi) % (2.0 * math.pi) - math.pi,
        width=left - right + pixel,
        low=foot,
        high=high,
        foot_seen=int(ground.sum()) >= 3,
        on_carpet=bool(bottom[1] >= rows - 2 or segmentation.on_carpet[bottom[1], bottom[0]] != 0),
        cut=bool(points[:, 0].min() <= 0 or points[:, 0].max() >= columns - 1),
        reaches_up=bool(high > -4.0 * pixel or top[1] <= 1),
        pixel=(float(bottom[0]), float(bottom[1])),
        pixel_angle=pixel,
    )
