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

from tulip_vision.features import Feature, FeatureClass
from tulip_vision.line_growth import grow_lines, local_directions
from tulip_vision.line_points import LinePoints
from tulip_vision.view import Array, View, angles, direction_of

FAR_NEIGHBOURHOOD = 0.65
"""Neighbourhood of far points over that of near ones."""
CIRCLE_ALIGNMENT = math.sin(math.radians(25.0))
"""Largest deviation of a point's own direction from the circle's."""
CIRCLE_DOUBT = 2.0
"""How many times less sure the middle is than a point that is seen: a part of the circle is extrapolated from."""
SURE_CIRCLE = 120.0
"""Points of a circle that is seen whole from some metres."""
VOTE_CELL = 0.15
"""[m] a quarter of a right angle's direction error at the radius."""
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
    hypotheses: int = 160
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
        (x0, y0), (x1, y1) = self.start.tolist(), self.end.tolist()
        return math.hypot(x1 - x0, y1 - y0)

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


ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Lines:
    """What the line points were joined to."""

    pieces: tuple[LinePiece, ...]
    circle: CentreCircle | None


def find_lines(points: LinePoints, view: View, parameters: LineParameters) -> Lines:
    """Return the straight pieces of line, longest support first, and the centre circle if it is seen."""
    if len(points.flat) < parameters.least_points:
        return Lines((), None)
    radius = parameters.neighbourhood
    directions, clear = local_directions(points.flat, points.near, radius, FAR_NEIGHBOURHOOD * radius)
    circle, on_circle = _find_circle(points, directions, clear, view, parameters)
    flat, directions, clear = points.flat[~on_circle], directions[~on_circle], clear[~on_circle]
    return Lines(tuple(_find_pieces(flat, directions, clear, view, parameters)), circle)


def line_features(lines: Lines, view: View) -> tuple[Feature, ...]:
    """Return a LINE feature for each straight piece, and CENTRE_CIRCLE if there is one."""
    features = [] if lines.circle is None else [_circle_feature(lines.circle, view)]
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


def _circle_feature(circle: CentreCircle, view: View) -> Feature:
    ray = np.array([*circle.centre, 0.0]) - view.position
    ray /= np.linalg.norm(ray)
    azimuth, elevation = angles(ray[None])
    azimuth_spread, elevation_spread = view.spreads(ray, CIRCLE_DOUBT)
    confidence = min(1.0, circle.points / SURE_CIRCLE)
    return Feature(
        FeatureClass.CENTRE_CIRCLE, float(azimuth[0]), float(elevation[0]), azimuth_spread, elevation_spread, confidence
    )


def _find_circle(
    points: LinePoints, directions: Array, clear: NDArray[np.bool_], view: View, parameters: LineParameters
) -> tuple[CentreCircle | None, NDArray[np.bool_]]:
    """Find the centre circle: every point votes for the two centres that its direction allows.

    Points of the ground are complex numbers here, x + iy: half as many operations.
    """
    none = np.zeros(len(points.flat), dtype=np.bool_)
    everywhere, eye = _complex(points.ground), complex(*view.position[:2])
    chosen = np.flatnonzero(clear & (np.abs(everywhere - eye) < parameters.circle_range))
    if len(chosen) < parameters.circle_points:
        return None, none
    ground = everywhere[chosen]
    tangent = _complex(_to_ground(points.flat[chosen] + 2.0 * directions[chosen], view)) - ground
    tangent /= np.maximum(np.abs(tangent), 1e-9)
    centre = _elect(ground, 1j * parameters.circle_radius * tangent)
    if centre is None:
        return None, none
    tolerance = _circle_tolerance(np.abs(ground - eye), view, parameters)
    tangent = tangent.conj()
    for wider in (4.0, 3.0, 2.0, 1.0, 1.0):
        offset = ground - centre
        distance = np.maximum(np.abs(offset), 1e-6)
        radial = offset / distance
        error = distance - parameters.circle_radius
        used = np.abs(error) < np.minimum(wider * tolerance, 0.2)
        used &= np.abs((radial * tangent).real) < CIRCLE_ALIGNMENT
        if np.count_nonzero(used) < parameters.circle_points:
            return None, none
        if wider == 2.0 and np.count_nonzero(_filled(offset[used])) < LEAST_SECTORS - 1:
            return None, none  # straight lines at the circle's distance; most pictures end here
        step = _gauss_newton(radial[used], error[used])
        if step is None:
            return None, none  # all points in one direction
        centre += step
    if not _is_whole(centre, offset[used], view, parameters):
        return None, none
    on_circle = none.copy()
    on_circle[chosen[used]] = True
    error = np.abs(np.abs(everywhere - centre) - parameters.circle_radius)
    on_circle |= ~clear & (error < _circle_tolerance(np.abs(everywhere - eye), view, parameters))
    return CentreCircle(np.array([centre.real, centre.imag]), int(np.count_nonzero(used))), on_circle


def _complex(points: Array) -> ComplexArray:
    """Return (n,) x + iy of (n, 2) points."""
    return np.ascontiguousarray(points).view(np.complex128)[:, 0]


def _elect(ground: ComplexArray, inwards: ComplexArray) -> complex | None:
    """Return the centre with most votes; None if the votes are all over the place.

    Args:
        ground: (n,) points [m].
        inwards: (n,) from each to the centre that it votes for, if not to the one on the other side.
    """
    votes = np.concatenate([ground + inwards, ground - inwards]).view(np.float64).reshape(-1, 2)
    votes = votes[np.isfinite(votes).all(axis=1)]
    corner = votes.min(axis=0)
    index = ((votes - corner) / VOTE_CELL).astype(np.intp)
    rows, columns = (index.max(axis=0) + 1).tolist()
    if rows * columns > 100_000:
        return None
    counts = np.bincount(index[:, 0] * columns + index[:, 1], minlength=rows * columns).reshape(rows, columns)
    summed = cv2.boxFilter(counts.astype(np.float32), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    row, column = divmod(int(np.argmax(summed)), columns)
    return complex(corner[0] + (row + 0.5) * VOTE_CELL, corner[1] + (column + 0.5) * VOTE_CELL)


def _gauss_newton(radial: ComplexArray, error: Array) -> complex | None:
    """Return by how much to move a centre: each residual falls by radial . step; None if that is not determined."""
    x, y = radial.real, radial.imag
    xx, xy, yy, ex, ey = float(x @ x), float(x @ y), float(y @ y), float(x @ error), float(y @ error)
    determinant = xx * yy - xy * xy
    if determinant <= 1e-9 * xx * yy:
        return None
    return complex(yy * ex - xy * ey, xx * ey - xy * ex) / determinant


def _filled(offset: ComplexArray) -> NDArray[np.bool_]:
    """Return (SECTORS,) which of the circle's sectors hold points, (n,) from its centre."""
    sector = np.floor(np.angle(offset) * (SECTORS / (2.0 * math.pi))).astype(np.intp) % SECTORS
    filled: NDArray[np.bool_] = np.bincount(sector, minlength=SECTORS) >= 2
    return filled


def _is_whole(centre: complex, offset: ComplexArray, view: View, parameters: LineParameters) -> bool:
    """Return whether points, (n,) from the circle's centre [m], fill enough of the part that the picture shows."""
    filled = _filled(offset)
    count = np.count_nonzero(filled)
    if count < LEAST_SECTORS:
        return False
    around = centre + parameters.circle_radius * np.exp((np.arange(SECTORS) + 0.5) * (2j * math.pi / SECTORS))
    places = around.view(np.float64).reshape(-1, 2)
    shown = view.inside(view.pixels_on_ground(places), margin=10.0)
    shown &= np.hypot(*(places - view.position[:2]).T) < parameters.circle_range
    return bool(np.count_nonzero(filled & shown) >= LEAST_SHARE * np.count_nonzero(shown))


def _circle_tolerance(distance: Array, view: View, parameters: LineParameters) -> Array:
    """Return (n,) how far points may be from the circle [m]: paint, and the depth that a pixel covers there.

    Args:
        distance: (n,) of the points along the ground [m].
        view: Of the picture.
        parameters: How a circle is found.
    """
    depth = (distance * distance + view.height**2) / (view.height * float(view.lens.camera_matrix[1, 1]))
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
    focal = float(view.lens.camera_matrix[0, 0])
    to_ground = np.stack([*view.rotation.T[:2], focal * view.rotation[:, 2]], axis=1)
    to_ground[2] /= -view.height
    members, lengths, lines = grow_lines(
        flat,
        directions,
        clear,
        candidates,
        (parameters.tolerance, math.cos(parameters.alignment), parameters.least_points, parameters.most),
        (parameters.largest_gap_pixels, parameters.largest_gap),
        to_ground,
    )
    return [piece for piece in _pieces(flat[members], lengths, lines, view) if piece.length >= parameters.least_length]


def _to_ground(flat: Array, view: View) -> Array:
    focal = float(view.lens.camera_matrix[0, 0])
    return view.ground(flat @ view.rotation[:, :2].T + focal * view.rotation[:, 2])


def _pieces(points: Array, lengths: NDArray[np.intp], lines: Array, view: View) -> list[LinePiece]:
    """Return the pieces that lines with their points make; those that are bent, or do not lie on the ground, are none.

    Args:
        points: (n, 2), line by line [px].
        lengths: (m,) how many points each line has.
        lines: (m, 4) see `Line`.
        view: Of the picture.
    """
    if not len(lines):
        return []
    x, y, along_x, along_y = lines.T
    starts = np.cumsum(lengths) - lengths
    piece = np.repeat(np.arange(len(lines)), lengths)  # to which line each point belongs
    offset_x, offset_y = points[:, 0] - x[piece], points[:, 1] - y[piece]
    place = offset_x * along_x[piece] + offset_y * along_y[piece]
    across = offset_y * along_x[piece] - offset_x * along_y[piece]
    first, last = np.minimum.reduceat(place, starts), np.maximum.reduceat(place, starts)
    residual = np.sqrt(np.add.reduceat(across * across, starts) / lengths)
    bent = _bent(place, across, piece, starts, lengths, residual, last - first)
    reach = np.stack([first, last])[..., None] * np.stack([along_x, along_y], axis=1)  # (2, pieces, 2)
    ends = _to_ground((np.stack([x, y], axis=1) + reach).reshape(-1, 2), view).reshape(2, -1, 2)
    good = np.isfinite(ends).all(axis=(0, 2)) & ~bent
    return [
        LinePiece(ends[0, index], ends[1, index], int(lengths[index]), float(residual[index]))
        for index in np.flatnonzero(good).tolist()
    ]


def _bent(
    place: Array,
    across: Array,
    piece: NDArray[np.intp],
    starts: NDArray[np.intp],
    lengths: NDArray[np.intp],
    residual: Array,
    extent: Array,
) -> NDArray[np.bool_]:
    """Return (m,) whether points follow an arc rather than a line: a parabola fits them much better.

    Each line is the best one for its points, so that the sums of `place`, `across` and their product are zero.
    Then only the parabola's part that no line has needs to be fitted.

    Args:
        place: (n,) of the points along their lines [px], piece by piece.
        across: (n,) beside them [px].
        piece: (n,) to which piece each point belongs.
        starts: (m,) index of each piece's first point.
        lengths: (m,) how many points it has.
        residual: (m,) root mean square of `across` [px].
        extent: (m,) from the first to the last point [px].
    """
    squared = place * place
    total = np.maximum(np.add.reduceat(squared, starts), 1e-12)
    slope = np.add.reduceat(squared * place, starts) / total
    bow = squared - (total / lengths)[piece] - slope[piece] * place  # a parabola across all lines
    bows, fits = np.add.reduceat(bow * bow, starts), np.add.reduceat(bow * across, starts)
    known = bows >= 1e-9 * total  # else there are fewer than three places
    bows = np.where(known, bows, 1.0)
    sagitta = np.abs(fits) / bows * (0.5 * extent) ** 2
    rest = np.maximum(residual**2 - fits**2 / bows / lengths, 0.0)
    bent: NDArray[np.bool_] = known & (sagitta > 1.0) & (np.sqrt(rest) < 0.6 * residual)
    return bent
