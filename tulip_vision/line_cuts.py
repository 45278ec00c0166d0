"""Cuts through the picture that meet white lines: the loops of `line_points`, compiled.

A loop over single pixels takes numpy a dozen passes over arrays, and five times as long.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tulip_vision.segmentation import Colour

MARGIN = 2.0
"""[px] blur on both sides, that is part of the expected widths."""
SLIMMEST = 0.4
"""Least thickness of a line over the largest: two thirds of what is expected at a right angle."""
OVERLAP = 12
"""[px] runs at the border between the two bands of vertical cuts belong to both."""
LONGEST_SHORT = 10
"""[px] up to which the middle of a run is found from how white its pixels are."""
BESIDE = 2
"""[px] of blur to either side, that count for the middle."""
MOST = 20_000
"""Points at most."""

GREEN = int(Colour.GREEN)


@njit(cache=True)
def cut_lines(
    whiteness: NDArray[np.uint8],
    classes: NDArray[np.uint8],
    on_carpet: NDArray[np.uint8],
    bands: tuple[int, int, int],
    steps: tuple[int, int],
    reach_down: NDArray[np.intp],
    reach_across: NDArray[np.intp],
    contrast: NDArray[np.int32],
) -> NDArray[np.float64]:
    """Return (n, 2) places where vertical and horizontal cuts meet the middles of lines [px].

    A pixel belongs to a line if it is whiter by `contrast` than those `reach` away on both sides, and these are green.

    Args:
        whiteness: (height, width) 0 to 255.
        classes: (height, width) bits of `Colour`.
        on_carpet: (height, width) nonzero inside the carpet's outline.
        bands: First row, first row of what is close, and end.
        steps: Between vertical and between horizontal cuts in what is close [px]; half and a quarter of it far away.
        reach_down: (height,) more than a line's expected thickness in a vertical cut [px].
        reach_across: (height,) the same in a horizontal cut [px].
        contrast: (height,) asked for in each row.
    """
    height, width = whiteness.shape
    found = np.empty((MOST, 2), dtype=np.float64)
    count = 0
    first, middle, last = bands
    for band in range(2):
        if band == 0:
            low, high, step = first, min(middle + OVERLAP, last), steps[0] // 2
        else:
            low, high, step = max(middle - OVERLAP, first), last, steps[0]
        begun = np.full(width, -1, dtype=np.intp)  # where the run that a cut is in began, or -1
        # Row by row, all cuts at once: that is how pixels lie in memory.
        for v in range(low, high):
            above, below = max(v - reach_down[v], 0), min(v + reach_down[v], height - 1)
            for u in range(step // 2, width, step):
                least = np.int32(whiteness[v, u]) - contrast[v]
                if (
                    least > 0
                    and whiteness[above, u] < least
                    and whiteness[below, u] < least
                    and classes[above, u] & classes[below, u] & GREEN
                ):
                    if begun[u] < 0:
                        begun[u] = v
                elif begun[u] >= 0:
                    start, length = begun[u], v - begun[u]
                    begun[u] = -1
                    if (
                        start >= low + BESIDE
                        and v <= high - BESIDE
                        and _is_thin(length, reach_down[start + length // 2])
                    ):
                        place = start + _middle(whiteness, start, u, length, 1, 0)
                        if on_carpet[int(place + 0.5), u] and count < MOST:
                            found[count, 0], found[count, 1] = u, place
                            count += 1
    for v in range(first, last):
        if v % (steps[1] if v >= middle else steps[1] // 4) != 0:
            continue
        reach = reach_across[v]
        start = -1
        for u in range(width):
            left, right = max(u - reach, 0), min(u + reach, width - 1)
            least = np.int32(whiteness[v, u]) - contrast[v]
            if (
                least > 0
                and whiteness[v, left] < least
                and whiteness[v, right] < least
                and classes[v, left] & classes[v, right] & GREEN
            ):
                if start < 0:
                    start = u
            elif start >= 0:
                length = u - start
                if start >= BESIDE and u <= width - BESIDE and _is_thin(length, reach):
                    place = start + _middle(whiteness, v, start, length, 0, 1)
                    if on_carpet[v, int(place + 0.5)] and count < MOST:
                        found[count, 0], found[count, 1] = place, v
                        count += 1
                start = -1
    return found[:count].copy()


@njit(cache=True)
def _is_thin(length: int, reach: int) -> bool:
    return length <= 2 * reach and length >= SLIMMEST * (reach - MARGIN)  # threads of a net are white too


@njit(cache=True)
def _middle(whiteness: NDArray[np.uint8], v: int, u: int, length: int, down: int, across: int) -> float:
    """Return how far the middle of a run is from its first pixel [px]."""
    if length > LONGEST_SHORT:
        return 0.5 * (length - 1)
    # Few pixels: the centre of what each has of the paint is exact to a tenth of a pixel.
    floor = 255
    for place in range(-BESIDE, length + BESIDE):
        floor = min(floor, int(whiteness[v + place * down, u + place * across]))
    total, moment = 0.0, 0.0
    for place in range(-BESIDE, length + BESIDE):
        paint = float(int(whiteness[v + place * down, u + place * across]) - floor)
        total += paint
        moment += paint * place
    return moment / max(total, 1e-9)
