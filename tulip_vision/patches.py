"""Connected patches of a mask."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.view import Mask


def patches(
    mask: Mask, least_area: float, most: int, corner: tuple[int, int] = (0, 0)
) -> list[tuple[NDArray[np.int32], float]]:
    """Return the connected patches of a mask, largest first, those inside the holes of others too.

    Args:
        mask: (height, width) nonzero inside the patches.
        least_area: Smaller ones are left out [px^2].
        most: Largest number of patches.
        corner: u, v in the picture of the mask's first pixel, where the mask is of a part of the picture.

    Returns:
        For each patch its outer contour, (n, 2) u and v [px], and its area without regard to holes [px^2].
    """
    contours, hierarchy = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE, offset=corner)
    if hierarchy is None:
        return []
    shortest = 4.0 * (math.sqrt(least_area) - 1.0)  # of a contour round that area: a square's
    found = []
    for contour, parent in zip(contours, hierarchy.reshape(-1, 4)[:, 3].tolist(), strict=True):
        if parent >= 0 or len(contour) < shortest:
            continue  # the edge of a hole, or noise
        points: NDArray[np.int32] = contour.reshape(-1, 2)
        # The contour runs through the middles of the edge pixels: half a pixel is missing all around.
        area = float(cv2.contourArea(contour)) + 0.5 * len(points) + 1.0
        if area >= least_area:
            found.append((points, area))
    found.sort(key=lambda patch: patch[1], reverse=True)
    return found[:most]
