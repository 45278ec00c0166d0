"""Straight pieces of white line, and the centre circle, from points on the middles of lines.

Pieces are fitted where no lens bends them: in the plane z = 1 of the camera, where straight lines on the
ground are straight and the noise of the points is the same in all directions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tulip_vision.features import Feature, FeatureClass
from tulip_vision.line_points import LinePoints
from tulip_vision.view import Array, View, angles, direction_of

FAR_NEIGHBOURHOOD = 0.65
"""Neighbourhood of far points over that of near ones."""
CIRCLE_ALIGNMENT = math.sin(math.radians(25.0))
"""Largest deviation of a point's own direction from the circle's."""
SECTORS = 24
LEAST_SECTORS = 7
"""Of 24 sectors of 15 deg: less arc than that cannot be told from two straight pieces that meet."""
LEAST_SHARE = 0.6
"""Of the sectors in the picture: where a circle is believed, most of it must be seen."""


@dataclass(frozen=True)
class LineParameters:
    """How points are joined to lines.

    Attributes:
        neighbourhood: Radius within which a point's direction is taken from its neighbours [px].
        tolerance: Largest distance of a point from its line [px].
        alignment: Largest angle between a point's own direction and that of its line [rad].
        largest_gap: Longer gaps divide a line [m], or `largest_gap_pixels` where that is longer.
        largest_gap_pixels: [px].
        least_points: Fewest points of a piece.
        least_length: Shortest piece [m].
        most: Largest number of pieces.
        hypotheses: Largest number of points whose direction is tried as a line.
        circle_radius: Of the centre circle [m].
        circle_tolerance, circle_tolerance_pixels: Largest distance of a point from the circle, the sum of both.
        circle_points: Fewest points of a circle.
        circle_range: Largest distance of the circle's points along the ground [m].
    """

    neighbourhood: float = 13.0  # [px] three cuts to either side
    tolerance: float = 1.3  # [px]
    alignment: float = math.radians(14.0)
    largest_gap: float = 0.35  # [m] the ball or a foot
    largest_gap_pixels: float = 22.0
    least_points: int = 8
    least_length: float = 0.30  # [m]
    most: int = 16
    hypotheses: int = 220
    circle_radius: float = 0.75
    circle_tolerance: float = 0.02  # [m] unevenly painted
    circle_tolerance_pixels: float = 1.0  # [px] counted in depth, where a pixel covers most
    circle_points: int = 30
    circle_range: float = 5.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for name, value in vars(self).items():
            if not value > 0:
                raise ValueError(f"{name} is {value}; expected > 0")


@dataclass(frozen=True)
class LinePiece:
    """A straight piece of line.

    Attributes:
        start, end: (2,) on the ground, in base_footprint [m].
        points: How many points it was fitted to.
        residual: Root mean square distance of the points from it [px].
    """

    start: Array
    end: Array
    points: int
    residual: float

    @property
    def length(self) -> float:
        """Distance between the ends [m]."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def direction(self) -> Array:
        """(2,) unit vector from start to end."""
        along: Array = (self.end - self.start) / max(self.length, 1e-9)
        return along


@dataclass(frozen=True)
class CentreCircle:
    """The centre circle.

    Attributes:
        centre: (2,) on the ground, in base_footprint [m].
        points: How many points lie on it.
    """

    centre: Array
    points: int


@dataclass(frozen=True)
class Lines:
    """What the line points were joined to."""

    pieces: tuple[LinePiece, ...]
    circle: CentreCircle | None


def find_lines(points: LinePoints, view: View, parameters: LineParameters) -> Lines:
    """Return the straight pieces of line, longest support first, and the centre circle if it is seen."""
    if len(points.flat) < parameters.least_points:
        return Lines((), None)
    directions, clear = _local_directions(points, parameters.neighbourhood)
    circle, on_circle = _find_circle(points, directions, clear, view, parameters)
    flat, directions, clear = points.flat[~on_circle], directions[~on_circle], clear[~on_circle]
    return Lines(tuple(_find_pieces(flat, directions, clear, view, parameters)), circle)


def line_features(lines: Lines, view: View) -> tuple[Feature, ...]:
    """Return a LINE feature for each straight piece."""
    features = []
    for piece in lines.pieces:
        ends = np.column_stack([np.stack([piece.start, piece.end]), np.zeros(2)]) - view.position
        ends /= np.linalg.norm(ends, axis=1, keepdims=True)
        azimuth, elevation = angles(ends)
        middle = direction_of(float(azimuth.mean()), float(elevation.mean()))
        if abs(azimuth[0] - azimuth[1]) > math.pi:
            middle = ends[0]
        spread_azimuth, spread_elevation = view.spreads(middle)
        features.append(
            Feature(
                FeatureClass.LINE,
                float(azimuth[0]),
                float(elevation[0]),
                spread_azimuth,
                spread_elevation,
                confidence=min(1.0, piece.points / 40.0 + 0.3 * piece.length),
                end_azimuth=float(azimuth[1]),
                end_elevation=float(elevation[1]),
            )
        )
    return tuple(features)


def _local_directions(points: LinePoints, radius: float) -> tuple[Array, NDArray[np.bool_]]:
    """Return each point's (n, 2) unit direction from its neighbours, and (n,) whether they lie on a line."""
    flat = points.flat
    count = len(flat)
    one, other = cKDTree(flat, balanced_tree=False).query_pairs(radius, output_type="ndarray").T
    x, y = flat[:, 0][other] - flat[:, 0][one], flat[:, 1][other] - flat[:, 1][one]
    # Far away the cuts are closer together, and so are the lines.
    kept = (points.near[one] & points.near[other]) | (x * x + y * y < (FAR_NEIGHBOURHOOD * radius) ** 2)
    one, other, x, y = one[kept], other[kept], x[kept], y[kept]
    first = np.concatenate([one, other])
    x, y = np.concatenate([x, -x]), np.concatenate([y, -y])
    number = np.bincount(first, minlength=count) + 1.0
    mean_x, mean_y = (np.bincount(first, each, count) / number for each in (x, y))
    xx = np.bincount(first, x * x, count) / number - mean_x**2
    yy = np.bincount(first, y * y, count) / number - mean_y**2
    xy = np.bincount(first, x * y, count) / number - mean_x * mean_y
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    spread = np.hypot(xx - yy, 2.0 * xy)
    smaller = 0.5 * (xx + yy - spread)
    clear = (number >= 4) & (smaller < 0.06 * (xx + yy)) & (smaller < 1.5)
    return np.column_stack([np.cos(angle), np.sin(angle)]), clear


def _find_circle(
    points: LinePoints, directions: Array, clear: NDArray[np.bool_], view: View, parameters: LineParameters
) -> tuple[CentreCircle | None, NDArray[np.bool_]]:
    """Find the centre circle: every point votes for the two centres that its direction allows."""
    none = np.zeros(len(points.flat), dtype=np.bool_)
    near = np.hypot(*(points.ground - view.position[:2]).T) < parameters.circle_range
    chosen = np.flatnonzero(clear & near)
    if len(chosen) < parameters.circle_points:
        return None, none
    tangent = _to_ground(points.flat[chosen] + 2.0 * directions[chosen], view) - points.ground[chosen]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    ground = points.ground[chosen]
    votes = np.concatenate([ground + parameters.circle_radius * normal, ground - parameters.circle_radius * normal])
    votes = votes[np.isfinite(votes).all(axis=1)]
    cell = 0.15  # [m] a quarter of a right angle's direction error at the radius
    index = np.floor((votes - votes.min(axis=0)) / cell).astype(np.intp)
    shape = index.max(axis=0) + 1
    if shape.prod() > 100_000:
        return None, none
    counts = np.bincount(index[:, 0] * shape[1] + index[:, 1], minlength=int(shape.prod())).reshape(shape)
    summed = cv2.boxFilter(counts.astype(np.float32), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    peak = np.unravel_index(int(np.argmax(summed)), summed.shape)
    centre = votes.min(axis=0) + (np.array(peak) + 0.5) * cell
    tolerance = _circle_tolerance(ground, view, parameters)
    for wider in (4.0, 3.0, 2.0, 1.0, 1.0):
        offset = ground - centre
        distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-6)
        radial = offset / distance[:, None]
        error = distance - parameters.circle_radius
        along = np.abs((radial * tangent).sum(axis=1)) < CIRCLE_ALIGNMENT
        used = (np.abs(error) < np.minimum(wider * tolerance, 0.2)) & along
        if np.count_nonzero(used) < parameters.circle_points:
            return None, none
        # Gauss-Newton: the residual falls by radial . step when the centre moves by step.
        away = radial[used]
        try:
            centre = centre + np.linalg.solve(away.T @ away, away.T @ error[used])
        except np.linalg.LinAlgError:
            return None, none  # all points in one direction
    if not _is_whole(centre, offset[used], view, parameters):
        return None, none
    on_circle = none.copy()
    on_circle[chosen[used]] = True
    error = np.abs(np.linalg.norm(points.ground - centre, axis=1) - parameters.circle_radius)
    on_circle |= ~clear & (error < _circle_tolerance(points.ground, view, parameters))
    return CentreCircle(centre, int(np.count_nonzero(used))), on_circle


def _is_whole(centre: Array, offset: Array, view: View, parameters: LineParameters) -> bool:
    """Return whether points, (n, 2) from the circle's centre [m], fill enough of the part that the picture shows."""
    sector = np.floor(np.arctan2(offset[:, 1], offset[:, 0]) * SECTORS / (2.0 * math.pi)).astype(np.intp) % SECTORS
    filled = np.bincount(sector, minlength=SECTORS) >= 2
    middle = (np.arange(SECTORS) + 0.5) * 2.0 * math.pi / SECTORS
    around = centre + parameters.circle_radius * np.column_stack([np.cos(middle), np.sin(middle)])
    shown = view.inside(view.pixels_on_ground(around), margin=10.0)
    shown &= np.hypot(*(around - view.position[:2]).T) < parameters.circle_range
    count = np.count_nonzero(filled)
    return bool(count >= LEAST_SECTORS and np.count_nonzero(filled & shown) >= LEAST_SHARE * np.count_nonzero(shown))


def _circle_tolerance(ground: Array, view: View, parameters: LineParameters) -> Array:
    """Return (n,) how far each point may be from the circle [m]: paint, and the depth that a pixel covers there."""
    slant_squared = ((ground - view.position[:2]) ** 2).sum(axis=1) + view.height**2
    depth = slant_squared / (view.height * float(view.lens.camera_matrix[1, 1]))
    tolerance: Array = parameters.circle_tolerance + parameters.circle_tolerance_pixels * depth
    return tolerance


def _find_pieces(
    flat: Array, directions: Array, clear: NDArray[np.bool_], view: View, parameters: LineParameters
) -> list[LinePiece]:
    """Take the best supported line again and again, each time removing its points."""
    candidates = np.flatnonzero(clear)
    if not len(candidates):
        return []
    # Points come cut by cut, so every third one would mean the same line again and again: take them in a scattered
    # order instead (multiplicative hashing), the same one each time.
    candidates = candidates[np.argsort((candidates * 2654435761) % 2**32)][: parameters.hypotheses]
    tried = directions[candidates]
    distances = flat[candidates, 0] * tried[:, 1] - flat[candidates, 1] * tried[:, 0]
    least_cosine = math.cos(parameters.alignment)
    # Single precision halves the time of the large arrays, and is exact to 1e-4 px. The third column takes away each
    # line's distance from the middle, and lets points without a direction of their own agree with all lines.
    one, agreeing = np.ones(len(flat)), np.where(clear, 0.0, 9.0)
    beside = _product(np.column_stack([tried[:, 1], -tried[:, 0], -distances]), np.column_stack([flat, one]))
    alike = _product(np.column_stack([tried, one[candidates]]), np.column_stack([directions, agreeing]))
    support = ((beside < 1.5 * parameters.tolerance) & (alike > least_cosine)).astype(np.float32)
    alive = np.ones(len(flat), dtype=np.float32)
    pieces: list[LinePiece] = []
    for _ in range(2 * parameters.most):
        counts = support @ alive
        best = int(np.argmax(counts))
        if counts[best] < parameters.least_points or len(pieces) >= parameters.most:
            break
        members = np.flatnonzero((support[best] > 0.0) & (alive > 0.0))
        for _ in range(2):
            centre, along = _fit(flat[members])
            offset = flat - centre
            near = np.abs(offset @ np.array([-along[1], along[0]])) < parameters.tolerance
            near &= (np.abs(directions @ along) > least_cosine) | ~clear
            refined = np.flatnonzero(near & (alive > 0.0))
            if len(refined) < parameters.least_points:
                break
            members = refined
        points = flat[members]
        line = _fit(points)
        run = _longest_run(points, line, view, parameters)
        if len(run) < len(members):
            members = members[run]
            points = flat[members]
            line = _fit(points)
        alive[members] = 0.0
        support[best] = 0.0
        if len(members) >= parameters.least_points:
            piece = _piece(points, line, view)
            if piece is not None and piece.length >= parameters.least_length:
                pieces.append(piece)
    return pieces


def _product(first: Array, second: Array) -> NDArray[np.float32]:
    """Return (m, n) absolute scalar products of the rows of (m, 3) and (n, 3)."""
    product: NDArray[np.float32] = first.astype(np.float32) @ second.astype(np.float32).T
    return np.abs(product, out=product)


def _fit(points: Array) -> tuple[Array, Array]:
    """Return the centre (2,) and unit direction (2,) of the line with the least squared distances to points."""
    centre = points.sum(axis=0) / len(points)
    offset = points - centre
    (xx, xy), (_, yy) = (offset.T @ offset).tolist()
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    return centre, np.array([math.cos(angle), math.sin(angle)])


def _to_ground(flat: Array, view: View) -> Array:
    focal = float(view.lens.camera_matrix[0, 0])
    return view.ground(flat @ view.rotation[:, :2].T + focal * view.rotation[:, 2])


def _longest_run(points: Array, line: tuple[Array, Array], view: View, parameters: LineParameters) -> NDArray[np.intp]:
    """Return the indices of the points of the part without a gap that has most points."""
    centre, along = line
    place = (points - centre) @ along
    order = np.argsort(place)
    place = place[order]
    gaps = np.flatnonzero(place[1:] - place[:-1] > parameters.largest_gap_pixels)
    if not len(gaps):
        return order
    before, after = (_to_ground(centre + place[ends, None] * along, view) for ends in (gaps, gaps + 1))
    metres = np.linalg.norm(after - before, axis=1)
    parts = np.split(order, gaps[~(metres <= parameters.largest_gap)] + 1)
    return max(parts, key=len)


def _bent(place: Array, across: Array, residual: float) -> bool:
    """Return whether points follow an arc rather than a line: a parabola fits them much better.

    The line is the best one for the points, so that the sums of `place`, `across` and their product are zero.
    Then only the parabola's part that no line has needs to be fitted.

    Args:
        place: (n,) along the line [px].
        across: (n,) beside the line [px].
        residual: Root mean square of `across` [px].
    """
    squared = place * place
    total = float(squared.sum())
    if total == 0.0:
        return False  # all points in one place
    bow = squared - total / len(place) - float(squared @ place) / total * place  # a parabola across all lines
    bows, fits = float(bow @ bow), float(bow @ across)
    if bows < 1e-9 * total:
        return False  # fewer than three places
    sagitta = abs(fits) / bows * (0.5 * float(np.ptp(place))) ** 2
    rest = max(residual**2 - fits**2 / bows / len(place), 0.0)
    return sagitta > 1.0 and math.sqrt(rest) < 0.6 * residual


def _piece(points: Array, line: tuple[Array, Array], view: View) -> LinePiece | None:
    centre, along = line
    offset = points - centre
    place = offset @ along
    across = offset @ np.array([-along[1], along[0]])
    residual = math.sqrt(float(across @ across) / len(across))
    if _bent(place, across, residual):
        return None
    ends = _to_ground(np.stack([centre + place.min() * along, centre + place.max() * along]), view)
    if not np.isfinite(ends).all():
        return None
    return LinePiece(ends[0], ends[1], len(points), residual)
