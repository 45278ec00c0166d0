"""Pictures without the lens's distortion, for looking at a calibration."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.lens import Lens

Picture = NDArray[np.uint8]

WIDEST = math.radians(120.0)  # seen across the straight picture; beyond, its edges are stretched without end


def straighten(picture: Picture, lens: Lens) -> Picture:
    """Return the picture that a lens without distortion would have taken, as wide as the lens sees or 120 deg.

    Args:
        picture: (height, width) or (height, width, 3), of the lens's size.
        lens: That took it.
    """
    across = min(lens.field_of_view[0], WIDEST)
    focal = (lens.width - 1) / 2.0 / math.tan((across if math.isfinite(across) else WIDEST) / 2.0)
    v, u = np.mgrid[0 : lens.height, 0 : lens.width].astype(np.float64)
    x, y = (u - (lens.width - 1) / 2.0) / focal, (v - (lens.height - 1) / 2.0) / focal
    seen = lens.project(np.stack([x, y, np.ones_like(x)], axis=-1)).reshape(lens.height, lens.width, 2)
    where = np.nan_to_num(seen, nan=-10.0).astype(np.float32)
    return np.asarray(cv2.remap(picture, where[..., 0], where[..., 1], cv2.INTER_LINEAR), np.uint8)


def draw_corners(picture: Picture, seen: NDArray[np.float64], fitted: NDArray[np.float64] | None = None) -> Picture:
    """Return a BGR copy with (n, 2) corners seen as red rings and, if given, corners of the fit as green dots."""
    drawn = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture.copy()
    for points, colour, radius, thickness in ((seen, (0, 0, 255), 5, 1), (fitted, (0, 200, 0), 2, -1)):
        if points is None:
            continue
        for u, v in points[np.isfinite(points).all(axis=1)]:
            middle = (round(float(u) * 16), round(float(v) * 16))
            cv2.circle(drawn, middle, radius * 16, colour, thickness, cv2.LINE_AA, 4)
    return np.asarray(drawn, np.uint8)


def beside(*pictures: Picture) -> Picture:
    """Return pictures of one height side by side, with a white gap."""
    height = pictures[0].shape[0]
    gap = np.full((height, 8, 3), 255, np.uint8)
    parts = [part for picture in pictures for part in (gap, picture)][1:]
    return np.concatenate(parts, axis=1)
