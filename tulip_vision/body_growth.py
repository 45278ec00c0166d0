"""Follows a body down a fan of cuts to its lowest points: the loops of `opponent_body`, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]


@njit(cache=True)
def lowest_of_body(
    classes: Bytes, on_carpet: Bytes, own_body: Bytes, inside: NDArray[np.bool_], carpet: int, painted: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the lowest row of a body in each cut, and whether it goes on where nothing is seen of it.

    The body hides carpet, and hangs together with what is seen in the cuts from the top until the carpet begins: bent
    legs are not straight below a marker.

    Args:
        classes: (rows, cuts) bits of `Colour`; the first row is the highest.
        on_carpet: (rows, cuts) nonzero inside the carpet's outline.
        own_body: (rows, cuts) nonzero where the robot sees itself.
        inside: (rows, cuts) whether the picture shows it.
        carpet: Bits of what is no part of a body: the carpet, and a ball at the feet.
        painted: Bits of posts and poles.

    Returns:
        (cuts,) row, -1 where no body is; (cuts,) whether the next row is not seen.
    """
    rows, cuts = classes.shape
    hides = np.zeros((rows, cuts), dtype=np.bool_)
    body = np.zeros((rows, cuts), dtype=np.bool_)
    waiting = np.empty(rows * cuts, dtype=np.int64)
    count = 0
    for cut in range(cuts):
        begins, run, first_own = rows, 0, rows
        for row in range(rows):
            is_carpet = classes[row, cut] & carpet != 0 and on_carpet[row, cut] != 0
            if own_body[row, cut] != 0:
                first_own = min(first_own, row)
            elif not is_carpet and inside[row, cut] and on_carpet[row, cut] != 0:
                hides[row, cut] = classes[row, cut] & painted == 0
            # The carpet begins where three samples in a row are carpet; a single one is noise. What the own body
            # hides, and all below it, tells nothing.
            run = run + 1 if is_carpet else 0
            if run >= 3 and begins == rows and row - 2 < first_own:
                begins = row - 2
        starts_on_carpet = classes[0, cut] & carpet != 0 and on_carpet[0, cut] != 0
        if starts_on_carpet or not inside[0, cut] or own_body[0, cut] != 0 or hides[:begins, cut].sum() < 2:
            continue
        for row in range(begins):
            if hides[row, cut]:
                body[row, cut] = True
                waiting[count] = row * cuts + cut
                count += 1
    while count:
        count -= 1
        row, cut = divmod(waiting[count], cuts)
        for near in range(max(row - 1, 0), min(row + 2, rows)):
            for beside in range(max(cut - 1, 0), min(cut + 2, cuts)):
                if hides[near, beside] and not body[near, beside]:
                    body[near, beside] = True
                    waiting[count] = near * cuts + beside
                    count += 1
    lowest = np.full(cuts, -1, dtype=np.int64)
    goes_on = np.zeros(cuts, dtype=np.bool_)
    for cut in range(cuts):
        for row in range(rows):
            if body[row, cut]:
                lowest[cut] = row
        below = lowest[cut] + 1
        if below > 0:
            goes_on[cut] = below == rows or not inside[below, cut] or own_body[below, cut] != 0
    return lowest, goes_on
