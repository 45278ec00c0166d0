"""Joins points to straight lines: the loops of `lines`, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Line = tuple[float, float, float, float]
"""A straight line in the plane z = 1: x and y of a point on it [px], and its unit direction."""

REFITS = 2
FEWEST = 4
"""Neighbours, the point itself among them, that give a direction."""
ROUND = 0.06
"""Variance across over the whole variance: above that neighbours are no line."""
THICK = 1.5
"""[px^2] the same for the variance across itself."""


@njit(cache=True)
def local_directions(
    points: Array, near: NDArray[np.bool_], radius: float, far_radius: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Return each point's (n, 2) unit direction from its neighbours, and (n,) whether they lie on a line.

    Args:
        points: (n, 2) [px].
        near: (n,) whether each is close to the robot.
        radius: Of the neighbourhood of two points that are close to the robot [px].
        far_radius: Of the others [px], at most `radius`.
    """
    count = len(points)
    directions = np.zeros((count, 2))
    clear = np.zeros(count, dtype=np.bool_)
    left, top = points[:, 0].min(), points[:, 1].min()
    columns = int((points[:, 0].max() - left) / radius) + 1
    rows = int((points[:, 1].max() - top) / radius) + 1
    # Points sorted by cells of the radius' size: neighbours are in the nine cells around.
    cell = np.empty(count, dtype=np.int64)
    begin = np.zeros(rows * columns + 1, dtype=np.int64)
    for i in range(count):
        cell[i] = int((points[i, 1] - top) / radius) * columns + int((points[i, 0] - left) / radius)
        begin[cell[i] + 1] += 1
    for k in range(rows * columns):
        begin[k + 1] += begin[k]
    order = np.empty(count, dtype=np.int64)
    filled = begin[:-1].copy()
    for i in range(count):
        order[filled[cell[i]]] = i
        filled[cell[i]] += 1
    for i in range(count):
        row, column = cell[i] // columns, cell[i] % columns
        number, sum_x, sum_y, sum_xx, sum_xy, sum_yy = 0, 0.0, 0.0, 0.0, 0.0, 0.0
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            first, last = begin[r * columns + max(column - 1, 0)], begin[r * columns + min(column + 2, columns)]
            for k in range(first, last):
                j = order[k]
                x, y = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
                reach = radius if near[i] and near[j] else far_radius
                if x * x + y * y < reach * reach:
                    number += 1
                    sum_x += x
                    sum_y += y
                    sum_xx += x * x
                    sum_xy += x * y
                    sum_yy += y * y
        mean_x, mean_y = sum_x / number, sum_y / number
        xx, xy, yy = sum_xx / number - mean_x**2, sum_xy / number - mean_x * mean_y, sum_yy / number - mean_y**2
        across = 0.5 * (xx + yy - math.hypot(xx - yy, 2.0 * xy))
        angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
        directions[i, 0], directions[i, 1] = math.cos(angle), math.sin(angle)
        clear[i] = number >= FEWEST and across < ROUND * (xx + yy) and across < THICK
    return directions, clear


@njit(cache=True)
def grow_lines(
    points: Array,
    directions: Array,
    clear: NDArray[np.bool_],
    candidates: NDArray[np.intp],
    limits: tuple[float, float, int, int],
    gaps: tuple[float, float],
    to_ground: Array,
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Take the best supported line again and again, each time removing its points.

    Args:
        points: (n, 2) [px].
        directions: (n, 2) of their neighbourhoods.
        clear: (n,) whether a point has a direction; the others agree with all lines.
        candidates: (m,) indices of the points that propose lines.
        limits: Largest distance from a line [px], least cosine between directions, fewest points, most lines.
        gaps: In a line [px] and [m]: what is larger in both divides it, and the part with most points is kept.
        to_ground: (3, 3) takes (x, y, 1) to a direction whose first two numbers over the third are metres.

    Returns:
        Indices of the points, line by line; how many points each of the k lines has; and the lines (k, 4).
    """
    tolerance, least_cosine, fewest, most = limits
    count, number = len(points), len(candidates)
    support = np.zeros((number, count), dtype=np.bool_)
    votes = np.zeros(number, dtype=np.int64)
    for m in range(number):
        x, y = points[candidates[m], 0], points[candidates[m], 1]
        along_x, along_y = directions[candidates[m], 0], directions[candidates[m], 1]
        agreeing = 0
        for i in range(count):
            across = (points[i, 1] - y) * along_x - (points[i, 0] - x) * along_y
            alike = directions[i, 0] * along_x + directions[i, 1] * along_y
            agrees = (abs(across) < 1.5 * tolerance) & (abs(alike) > least_cosine or not clear[i])
            support[m, i] = agrees
            agreeing += agrees
        votes[m] = agreeing
    alive = np.ones(count, dtype=np.bool_)
    members = np.empty(count, dtype=np.intp)
    lengths = np.empty(most, dtype=np.intp)
    lines = np.empty((most, 4))
    used, found = 0, 0
    for _ in range(2 * most):
        best = np.argmax(votes)
        if votes[best] < fewest or found >= most:
            break
        inside = support[best] & alive
        for _ in range(REFITS):
            x, y, along_x, along_y = _fit(points, inside)
            refined = np.zeros(count, dtype=np.bool_)
            agreeing = 0
            for i in range(count):
                across = (points[i, 1] - y) * along_x - (points[i, 0] - x) * along_y
                alike = directions[i, 0] * along_x + directions[i, 1] * along_y
                refined[i] = alive[i] and abs(across) < tolerance and (abs(alike) > least_cosine or not clear[i])
                agreeing += refined[i]
            if agreeing < fewest:
                break
            inside = refined
        line = _fit(points, inside)
        run = _longest_run(points, np.flatnonzero(inside), line, gaps, to_ground)
        inside[:] = False
        inside[run] = True
        for i in run:
            alive[i] = False
        for m in range(number):
            for i in run:
                votes[m] -= support[m, i]
        votes[best] = 0
        support[best] = False
        if len(run) >= fewest:
            members[used : used + len(run)] = run
            lines[found] = _fit(points, inside)
            lengths[found] = len(run)
            used += len(run)
            found += 1
    return members[:used].copy(), lengths[:found].copy(), lines[:found].copy()


@njit(cache=True)
def _fit(points: Array, used: NDArray[np.bool_]) -> Line:
    """Return the line with the least squared distances to the points that are used."""
    number, x, y = 0, 0.0, 0.0
    for i in range(len(points)):
        if used[i]:
            number += 1
            x += points[i, 0]
            y += points[i, 1]
    x, y = x / number, y / number
    xx, xy, yy = 0.0, 0.0, 0.0
    for i in range(len(points)):
        if used[i]:
            dx, dy = points[i, 0] - x, points[i, 1] - y
            xx += dx * dx
            xy += dx * dy
            yy += dy * dy
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    return x, y, math.cos(angle), math.sin(angle)


@njit(cache=True)
def _longest_run(
    points: Array, members: NDArray[np.intp], line: Line, gaps: tuple[float, float], to_ground: Array
) -> NDArray[np.intp]:
    """Return the members, in their order along the line, of the part without a gap that has most points."""
    x, y, along_x, along_y = line
    place = np.empty(len(members))
    for k in range(len(members)):
        place[k] = (points[members[k], 0] - x) * along_x + (points[members[k], 1] - y) * along_y
    order = np.argsort(place)
    start, longest, length = 0, 0, 0
    for k in range(1, len(order) + 1):
        if k < len(order):
            one, other = place[order[k - 1]], place[order[k]]
            if other - one <= gaps[0]:
                continue
            metres = _metres(x + one * along_x, y + one * along_y, x + other * along_x, y + other * along_y, to_ground)
            if metres <= gaps[1]:
                continue
        if k - start > length:
            longest, length = start, k - start
        start = k
    return members[order[longest : longest + length]]


@njit(cache=True)
def _metres(x0: float, y0: float, x1: float, y1: float, to_ground: Array) -> float:
    """Return how far two places of the plane z = 1 are apart on the ground [m]; infinite above the horizon."""
    a = to_ground[:, 0] * x0 + to_ground[:, 1] * y0 + to_ground[:, 2]
    b = to_ground[:, 0] * x1 + to_ground[:, 1] * y1 + to_ground[:, 2]
    if a[2] <= 0.0 or b[2] <= 0.0:
        return math.inf
    return math.hypot(a[0] / a[2] - b[0] / b[2], a[1] / a[2] - b[1] / b[2])
