"""A small picture of the robot's balance from above: both soles, with CoM, ZMP and DCM over them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_view.live.scene import Balance

WIDTH, HEIGHT = 360, 260  # [px]
SCALE = 460.0  # [px/m]
ABOVE = 0.08  # [m] by which the middle of the picture lies ahead of the foot that carries
COLOURS = {"CoM": (30, 100, 220), "DCM": (20, 150, 90), "ZMP": (215, 60, 20), "ZMP wanted": (235, 165, 40)}
"""RGB of each point; the same in the field."""


def balance_picture(balance: Balance) -> NDArray[np.uint8]:
    """Return (HEIGHT, WIDTH, 3) RGB, seen from above in the carrying foot's frame with the toes up.

    Args:
        balance: What to draw.
    """
    picture = np.full((HEIGHT, WIDTH, 3), 250, np.uint8)
    inverse = balance.carrying.inverse()

    def pixels(points: NDArray[np.float64]) -> NDArray[np.int32]:
        seen = np.array([inverse.transform(point) for point in points])
        x = WIDTH / 2.0 - SCALE * seen[:, 1]
        y = HEIGHT / 2.0 - SCALE * (seen[:, 0] - ABOVE)
        return np.rint(np.column_stack([x, y])).astype(np.int32)

    for corners, carries in zip(balance.soles, balance.carries, strict=True):
        outline = pixels(corners[:, :2])
        cv2.fillPoly(picture, [outline], (190, 196, 204) if carries else (228, 231, 235), cv2.LINE_AA)
        cv2.polylines(picture, [outline], True, (90, 98, 108), 1, cv2.LINE_AA)
    points = {"ZMP wanted": balance.zmp_desired, "ZMP": balance.zmp, "DCM": balance.dcm, "CoM": balance.com[:2]}
    for name, point in points.items():
        if np.isfinite(point).all():
            (x, y), *_ = pixels(point[None]).tolist()
            cv2.circle(picture, (x, y), 5, COLOURS[name], -1, cv2.LINE_AA)
    for row, (name, colour) in enumerate(COLOURS.items()):
        cv2.circle(picture, (12, 16 + 18 * row), 5, colour, -1, cv2.LINE_AA)
        _write(picture, name, (24, 20 + 18 * row))
    _write(picture, balance.words, (10, HEIGHT - 10))
    return picture


def _write(picture: NDArray[np.uint8], words: str, place: tuple[int, int]) -> None:
    cv2.putText(picture, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.42, (40, 44, 50), 1, cv2.LINE_AA)
