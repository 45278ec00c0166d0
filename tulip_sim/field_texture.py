"""Pictures that the camera's backdrop is read from: the ground from above, and the wall of the hall unrolled.

The ground is one channel, an index into a palette that runs without a break from the hall's floor over the carpet
to the white of the lines. Mixing two neighbouring indices then mixes the two colours, so that it can be
filtered like a grey picture, at a third of the cost of three channels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field

Bytes = NDArray[np.uint8]
Place = Callable[[float, float], tuple[int, int]]

FLOOR, CARPET, LINE = 40, 120, 255  # indices of the mean floor, the mean carpet and of fresh line paint
FLOOR_SPREAD, CARPET_SPREAD = 30, 26  # indices around the mean that are still floor, or still carpet
FINEST = 0.004  # [m] one pixel of the finest ground picture: 2.5 mm is what a pixel sees straight down at the feet
LEVELS = 6  # each level halves the resolution of the one before
MARGIN = 1.5  # [m] of floor around the carpet; beyond it the floor has one colour
SHIFT = 4  # fractional bits of OpenCV's drawing coordinates


@dataclass(frozen=True)
class Ground:
    """The ground from above, in several resolutions.

    Attributes:
        levels: Index pictures, each half as fine as the one before; columns run along map x, rows along map y.
        left, lower: Map x and y of the middle of pixel (0, 0) of the finest level, less half a pixel: its corner [m].
    """

    levels: tuple[Bytes, ...]
    left: float
    lower: float

    def resolution(self, level: int) -> float:
        """Return the width of one pixel of a level [m]."""
        return FINEST * float(2**level)


def paint_ground(field: Field, mottling: float, rng: np.random.Generator) -> Ground:
    """Paint floor, carpet and lines.

    Args:
        field: What to paint.
        mottling: Strength of the carpet's blotches, 0 to 1.
        rng: Where floor and carpet get their blotches from.
    """
    left, lower = -field.carpet_length / 2.0 - MARGIN, -field.carpet_width / 2.0 - MARGIN
    columns, rows = round(-2.0 * left / FINEST), round(-2.0 * lower / FINEST)

    def pixel(x: float, y: float) -> tuple[int, int]:
        scale = float(1 << SHIFT)
        return round(((x - left) / FINEST - 0.5) * scale), round(((y - lower) / FINEST - 0.5) * scale)

    picture = FLOOR + FLOOR_SPREAD * _blotches(rows, columns, (96, 384), rng)
    carpet = np.zeros((rows, columns), np.uint8)
    edge = (field.carpet_length / 2.0, field.carpet_width / 2.0)
    _bar(carpet, pixel, (-edge[0], -edge[1]), edge)
    weave = CARPET + CARPET_SPREAD * mottling * _blotches(rows, columns, (4, 24, 200), rng)
    picture = np.where(carpet > 0, weave, picture).round().astype(np.uint8)
    paint = np.zeros((rows, columns), np.uint8)
    half = field.line_width / 2.0
    for line in field.line_segments:
        x0, x1 = sorted((line.start[0], line.end[0]))
        y0, y1 = sorted((line.start[1], line.end[1]))
        _bar(paint, pixel, (x0 - half, y0 - half), (x1 + half, y1 + half))
    arm = field.penalty_mark_size / 2.0
    for x, y in field.penalty_marks:
        _bar(paint, pixel, (x - arm, y - half), (x + arm, y + half))
        _bar(paint, pixel, (x - half, y - arm), (x + half, y + arm))
    circle = field.centre_circle
    angles = np.linspace(0.0, 2.0 * math.pi, 361)
    for radius, colour in ((circle.radius + half, 255), (circle.radius - half, 0)):
        ring = np.array([pixel(circle.x + radius * math.cos(a), circle.y + radius * math.sin(a)) for a in angles])
        cv2.fillPoly(paint, [ring.astype(np.int32)], colour, cv2.LINE_8, SHIFT)
    _bar(paint, pixel, (-half, -circle.radius), (half, circle.radius))  # the halfway line, which the disc wiped out
    picture[paint > 0] = LINE - rng.integers(0, 16, int((paint > 0).sum()), dtype=np.uint8)
    levels: list[Bytes] = [np.ascontiguousarray(picture)]
    for _ in range(LEVELS - 1):
        finer = levels[-1]
        even = finer[: finer.shape[0] // 2 * 2, : finer.shape[1] // 2 * 2]
        levels.append(np.asarray(cv2.resize(even, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8))
    return Ground(tuple(levels), left, lower)


def ground_palette(floor: tuple[int, int, int], carpet: tuple[int, int, int], line: tuple[int, int, int]) -> Bytes:
    """Return the (256, 1, 3) BGR palette of the ground's indices."""
    anchors = {
        0: np.array(floor) * 0.8,
        FLOOR: np.array(floor),
        FLOOR + FLOOR_SPREAD: np.array(floor) * 1.1,
        CARPET - CARPET_SPREAD: np.array(carpet) * 0.72,
        CARPET: np.array(carpet),
        CARPET + CARPET_SPREAD: np.array(carpet) * 1.28,
        LINE: np.array(line),
    }
    where = list(anchors)
    channels = [np.interp(np.arange(256), where, [colour[c] for colour in anchors.values()]) for c in range(3)]
    palette: Bytes = np.clip(np.stack(channels, axis=1), 0, 255).round().astype(np.uint8)[:, None, :]
    return palette


def paint_wall(circumference: float, height: float, resolution: float, rng: np.random.Generator) -> Bytes:
    """Paint the unrolled wall of the hall: dull panels, people-like and box-like clutter, a dark ceiling.

    Args:
        circumference: Length of the wall [m].
        height: Of the picture [m]; row 0 lies on the floor.
        resolution: Width of one pixel [m].
        rng: Where the clutter comes from.

    Returns:
        (rows, columns, 3) BGR; the last column is followed by the first.
    """
    columns, rows = round(circumference / resolution), round(height / resolution)
    picture = np.empty((rows, columns, 3), np.float32)
    picture[:] = (128, 136, 140)
    ceiling = round(3.2 / resolution)
    picture[ceiling:] = (70, 72, 76)
    for _ in range(60):  # panels
        start, wide = int(rng.integers(columns)), int(rng.integers(20, 90))
        picture[:ceiling, start : start + wide] += rng.normal(0.0, 12.0) + rng.normal(0.0, 4.0, 3)
    for _ in range(90):  # spectators, tables, boxes: mostly grey and brown, some with a little colour
        start, wide = int(rng.integers(columns)), int(rng.integers(8, 40))
        bottom = int(rng.integers(0, rows // 12))
        top = bottom + int(rng.integers(10, 60))
        colour = rng.uniform(30.0, 150.0) + rng.normal(0.0, 14.0, 3)
        picture[bottom:top, start : start + wide] = colour
        if rng.random() < 0.4:  # a head on it
            cv2.circle(picture, (start + wide // 2, top + 5), 5, (95.0, 120.0, 165.0), -1)
    for start in range(30, columns, 160):  # lamps
        picture[ceiling + 20 : ceiling + 24, start : start + 60] = (235, 240, 240)
    picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), 1.5, borderType=cv2.BORDER_REPLICATE), np.float32)
    picture *= 1.0 + 0.05 * _blotches(rows, columns, (12, 80), rng)[..., None]
    return np.ascontiguousarray(np.clip(picture, 0, 255).astype(np.uint8))


def _bar(paint: Bytes, pixel: Place, low: tuple[float, float], high: tuple[float, float]) -> None:
    """Fill a rectangle between two places in map; pixel gives their columns and rows with SHIFT fractional bits."""
    (x0, y0), (x1, y1) = pixel(*low), pixel(*high)
    whole = 1 << SHIFT
    paint[-(-y0 // whole) : y1 // whole + 1, -(-x0 // whole) : x1 // whole + 1] = 255


def _blotches(rows: int, columns: int, sizes: tuple[int, ...], rng: np.random.Generator) -> NDArray[np.float32]:
    """Return (rows, columns) smooth noise between about -1 and 1, a mix of blotches of several sizes [px]."""
    total = np.zeros((rows, columns), np.float32)
    for size in sizes:
        coarse = rng.uniform(-1.0, 1.0, (rows // size + 2, columns // size + 2)).astype(np.float32)
        total += cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_LINEAR) / np.float32(len(sizes))
    return total
