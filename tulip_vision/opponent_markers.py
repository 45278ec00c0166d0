"""The markers of opponents: patches in the other team's colour."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import View

EDGE = 2
"""[px] row of the picture that is looked at for what its upper edge cuts."""
LEAST_CUT = 8
"""[px] across: a leg 3 m away is that wide."""
NO_BODY = Colour.GREEN | Colour.WHITE | Colour.ORANGE | Colour.YELLOW | Colour.BLUE
"""Carpet and lines, balls, posts and poles: what belongs to no robot."""


@dataclass(frozen=True)
class Marker:
    """A patch that may be a marker, as angles about the camera.

    Attributes:
        left, right: Azimuth of its edges [rad].
        low, high: Elevation of its edges [rad].
        area: [px^2].
        pixel: u, v of its middle [px].
        cut: By the picture's edge: it may be larger than it looks.
    """

    left: float
    right: float
    low: float
    high: float
    area: float
    pixel: tuple[float, float]
    cut: bool

    @property
    def azimuth(self) -> float:
        """Of its middle [rad]."""
        return 0.5 * (self.left + self.right)


def markers_of(found: list[tuple[NDArray[np.int32], float]], view: View) -> list[Marker]:
    """Return the markers that patches, each with its area, are; worked on all at once."""
    if not found:
        return []
    lengths = [len(points) for points, _ in found]
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    points = np.concatenate([points for points, _ in found])
    azimuths, elevations = view.angles_at(points)
    reference = np.repeat(azimuths[starts], lengths)
    turned = (azimuths - reference + math.pi) % (2.0 * math.pi) - math.pi + reference  # no jump behind the robot
    left, right = np.maximum.reduceat(turned, starts).tolist(), np.minimum.reduceat(turned, starts).tolist()
    high, low = np.maximum.reduceat(elevations, starts).tolist(), np.minimum.reduceat(elevations, starts).tolist()
    middles = (np.add.reduceat(points, starts) / np.array(lengths)[:, None]).tolist()
    last = np.array([view.lens.width, view.lens.height]) - 1
    cut = np.logical_or.reduceat(((points <= 0) | (points >= last)).any(axis=1), starts).tolist()
    columns = zip(left, right, low, high, middles, cut, strict=True)
    return [
        Marker(one_left, one_right, lowest, highest, area, (u, v), in_part)
        for (one_left, one_right, lowest, highest, (u, v), in_part), (_, area) in zip(columns, found, strict=True)
    ]


def cut_bodies(segmentation: Segmentation, view: View) -> list[Marker]:
    """Return where the picture's upper edge cuts something that is no carpet: markers of no area, as wide as that."""
    inside = segmentation.on_carpet[EDGE] != 0
    if not inside.any():
        return []
    bare = inside & ~belongs(segmentation.classes[EDGE], NO_BODY) & (segmentation.own_body[EDGE] == 0)
    changes = np.flatnonzero(np.diff(np.concatenate([[False], bare, [False]]).view(np.int8)))
    found = []
    for start, stop in changes.reshape(-1, 2).tolist():
        if stop - start >= LEAST_CUT:
            azimuths, elevations = view.angles_at(np.array([[start, EDGE], [stop - 1, EDGE]]))
            low, pixel = float(elevations.min()), (0.5 * (start + stop), float(EDGE))
            found.append(Marker(float(azimuths[0]), float(azimuths[1]), low, low, 0.0, pixel, cut=True))
    return found


def joined(marker: Marker, markers: list[Marker], reach: float) -> Marker:
    """Return a marker together with the others of the same opponent.

    Those are the ones within `reach` [rad] to either side that are at the same height.
    """
    same = [
        other
        for other in markers
        if other is marker
        or (
            angle_between(other.azimuth, marker.azimuth) < reach and other.low < marker.high and other.high > marker.low
        )
    ]
    return replace(
        marker,
        left=max(other.left for other in same),
        right=min(other.right for other in same),
        low=min(other.low for other in same),
        high=max(other.high for other in same),
    )


def is_compact(points: NDArray[np.int32], area: float) -> bool:
    """Return whether a patch is a marker and not a thin border where two other colours blend."""
    _, _, width, height = cv2.boundingRect(points)
    return bool(min(width, height) >= 3 and area >= 0.4 * width * height)


def angle_between(first: float, second: float) -> float:
    """Return the angle between two directions [rad], 0 to pi."""
    return abs((first - second + math.pi) % (2.0 * math.pi) - math.pi)
