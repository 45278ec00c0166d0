"""Crossings of lines, L, T and X, and the penalty mark.

Two pieces of line that meet at a right angle propose a place; what shape it has is then read from the picture
itself, by looking for paint along its four arms and for carpet between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.features import Feature, FeatureClass
from tulip_vision.findings import Findings, Refusal
from tulip_vision.lines import Lines
from tulip_vision.patches import patches
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import Array, Mask, View, angles

ARMS = np.array([0.13, 0.17, 0.21, 0.25, 0.29, 0.33])
"""[m] Where an arm is looked at: beyond the width of the other line, before the next line of the field begins."""
MOST_HIDDEN = 2
"""Of the six samples of an arm: the four others are enough to tell paint from carpet."""
THINGS = Colour.ORANGE | Colour.YELLOW | Colour.BLUE | Colour.DARK
BETWEEN = np.array([[a * reach, b * reach] for a in (1.0, -1.0) for b in (1.0, -1.0) for reach in (0.14, 0.2)])
"""(8, 2) places between the arms, along both lines [m]."""
LEAST_BETWEEN = 5
"""Of them on carpet."""
LEAST_CONTRAST = 20.0
"""Between paint and carpet [0-255]."""
LEAST_MARK_AREA = 8.0
"""[px^2] at 4 m the penalty mark covers about 12."""
BODY_HALF_WIDTH = 0.25
"""[m] of an opponent; its light parts look like paint."""
FOOT_RADIUS = 0.25
"""[m] around the foot of a goal post: no line of the field meets the goal line there."""
MOST_MARK_CANDIDATES = 20
"""The largest white patches are looked at."""


@dataclass(frozen=True)
class CrossingParameters:
    """How crossings are found.

    Attributes:
        farthest: Largest distance along the ground [m].
        square: Largest deviation from a right angle [rad].
        extension: How far a piece of line may end before the crossing [m].
        least_arm: Share of an arm's samples that must be paint, or carpet where there is no arm.
        circle_radius: Of the centre circle [m].
        mark_size: Length of the bars of the penalty mark [m].
        mark_range: Largest distance of a penalty mark [m].
    """

    farthest: float = 6.5  # [m]
    square: float = math.radians(16.0)
    extension: float = 0.30
    least_arm: float = 0.8  # five of six samples: the centre circle bends away from its tangent
    circle_radius: float = 0.75
    mark_size: float = 0.10
    mark_range: float = 4.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for name, value in vars(self).items():
            if not value > 0.0:
                raise ValueError(f"{name} is {value}; expected > 0")
        if not 0.5 < self.least_arm <= 1.0:
            raise ValueError(f"least_arm is {self.least_arm}; expected above 0.5 to 1, or paint and carpet overlap")


@dataclass(frozen=True)
class _Place:
    point: Array  # (2,) on the ground [m]
    first: Array  # (2,) unit direction of one line
    second: Array  # (2,) of the other, or of the circle's tangent
    centre: Array | None  # (2,) of the circle [m], where the second line is the circle

    def arms(self) -> Array:
        """Return (4 * len(ARMS), 2) points along the four arms [m]."""
        straight = np.outer(ARMS, self.first)
        if self.centre is None:
            bent = np.outer(ARMS, self.second)
            return np.concatenate([straight, -straight, bent, -bent]) + self.point
        offset = self.point - self.centre
        radius = math.hypot(*offset)
        start = math.atan2(float(offset[1]), float(offset[0]))
        turn = start + np.concatenate([ARMS, -ARMS]) / radius
        around = self.centre + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return np.concatenate([straight + self.point, -straight + self.point, around])


@dataclass(frozen=True)
class _Shape:
    kind: FeatureClass | None
    confidence: float
    reason: str  # why it is none


def find_crossings(
    lines: Lines,
    opponents: Findings,
    goal_posts: Findings,
    segmentation: Segmentation,
    view: View,
    parameters: CrossingParameters,
) -> Findings:
    """Return the crossings of the lines in the picture.

    Args:
        lines: Pieces of line and the centre circle.
        opponents: Of the same picture: what seems to cross on a body does not.
        goal_posts: Of the same picture: the net begins at their feet and looks like a line there.
        segmentation: Of the same picture.
        view: Of the same picture.
        parameters: How crossings are found.
    """
    places = _proposals(lines, view, parameters)
    if not places:
        return Findings()
    taken: list[Array] = []
    features: list[Feature] = []
    refusals: list[Refusal] = []
    for place, shape in zip(places, _shapes(places, segmentation, view, parameters), strict=True):
        if any(math.hypot(*(place.point - other)) < 0.3 for other in taken):
            continue
        if shape.kind is None:
            pixel = view.pixels_on_ground(place.point[None])[0]
            if np.isfinite(pixel).all():
                refusals.append(Refusal(FeatureClass.CROSSING_L, (float(pixel[0]), float(pixel[1])), shape.reason))
            continue
        if any(_behind(place.point, opponent, view) for opponent in opponents.features):
            continue
        if any(_at_foot(place.point, post, view) for post in goal_posts.features):
            continue
        taken.append(place.point)
        features.append(_feature(shape.kind, place.point, shape.confidence, view))
    return Findings(tuple(features), tuple(refusals))


def find_penalty_marks(
    lines: Lines, segmentation: Segmentation, view: View, parameters: CrossingParameters
) -> Findings:
    """Return white spots on the carpet that have the penalty mark's size and stand alone."""
    carpet_level = _carpet_whiteness(segmentation)
    level = 0.5 * (carpet_level + 255.0 * min(1.0, 0.75 * segmentation.brightness))
    lowest = -view.height / math.hypot(view.height, parameters.mark_range)
    close = np.flatnonzero(view.middle_sines < lowest)
    if not len(close):
        return Findings()
    top = int(close[0])
    white = cv2.compare(segmentation.whiteness[top:], level, cv2.CMP_GT)
    field = cv2.subtract(segmentation.on_carpet[top:], segmentation.own_body[top:])  # light arms are white, too
    mask = np.asarray(cv2.bitwise_and(white, field), dtype=np.uint8)
    features: list[Feature] = []
    refusals: list[Refusal] = []
    rows, columns = mask.shape
    focal = float(view.lens.camera_matrix[0, 0])
    for points, _ in patches(mask, LEAST_MARK_AREA, MOST_MARK_CANDIDATES):
        left, upper, width, height = cv2.boundingRect(points)
        cut = min(left, upper) <= 0 or left + width >= columns or upper + height >= rows
        if cut or len(points) < 6:
            continue
        sine = float(view.middle_sines[upper + height // 2 + top])
        if max(width, height) > 2.5 * parameters.mark_size * focal * -sine / view.height + 4.0:
            continue  # a line, most often
        ground = view.ground(view.directions_at(points[:, 0], points[:, 1] + top))
        centre = 0.5 * (ground.max(axis=0) + ground.min(axis=0))
        extent = 2.0 * np.linalg.norm(ground - centre, axis=1).max()
        if not 0.6 * parameters.mark_size <= extent <= 1.9 * parameters.mark_size:
            continue
        turn = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
        circle = np.column_stack([np.cos(turn), np.sin(turn)])
        ring = np.concatenate([centre + share * parameters.mark_size * circle for share in (1.6, 2.2)])
        around = view.pixels_on_ground(ring)
        classes, inside = view.sample(segmentation.classes, around)
        whiteness, _ = view.sample(segmentation.whiteness, around)
        # Far away a thin line through the spot is a blend that still counts as green: look at its brightness too.
        plain = belongs(classes, Colour.GREEN) & (whiteness < carpet_level + 0.4 * (level - carpet_level))
        carpet = float(plain[inside].mean()) if inside.any() else 0.0
        own = abs(centre[0]) < 0.35 and abs(centre[1]) < 0.3
        if carpet < 0.95 or own or any(_distance(centre, piece.start, piece.end) < 0.15 for piece in lines.pieces):
            u, v = points.mean(axis=0)
            refusals.append(Refusal(FeatureClass.PENALTY_MARK, (float(u), float(v) + top), "does not stand alone"))
            continue
        features.append(_feature(FeatureClass.PENALTY_MARK, centre, 0.6, view))
    return Findings(tuple(features), tuple(refusals))


def _behind(point: Array, opponent: Feature, view: View) -> bool:
    """Return whether a point on the ground is seen where an opponent's body is."""
    if math.isnan(opponent.elevation):
        return False
    offset = point - view.position[:2]
    azimuth, distance = math.atan2(float(offset[1]), float(offset[0])), math.hypot(*offset)
    apart = abs((azimuth - opponent.azimuth + math.pi) % (2.0 * math.pi) - math.pi)
    body = view.height / math.tan(-opponent.elevation)
    return apart < BODY_HALF_WIDTH / body and distance > body - BODY_HALF_WIDTH


def _at_foot(point: Array, post: Feature, view: View) -> bool:
    """Return whether a point on the ground is at a goal post's foot."""
    if math.isnan(post.elevation):
        return False
    distance = view.height / math.tan(-post.elevation)
    foot = view.position[:2] + distance * np.array([math.cos(post.azimuth), math.sin(post.azimuth)])
    return math.hypot(*(point - foot)) < FOOT_RADIUS + 0.05 * distance


def _proposals(lines: Lines, view: View, parameters: CrossingParameters) -> list[_Place]:
    places: list[_Place] = []
    pieces = lines.pieces
    if lines.circle is not None:
        for piece in pieces:
            along = piece.direction
            offset = lines.circle.centre - piece.start
            across = float(along[0] * offset[1] - along[1] * offset[0])
            if abs(across) > 0.15:
                continue
            foot = piece.start + float(offset @ along) * along
            for side in (-1.0, 1.0):
                point = foot + side * parameters.circle_radius * along
                before, after = float((point - piece.start) @ along), float((piece.end - point) @ along)
                if min(before, after) > -parameters.extension:
                    places.append(_Place(point, along, np.array([-along[1], along[0]]), lines.circle.centre))
    # Plain numbers: numpy is slow one by one.
    plain = [(*piece.start.tolist(), *piece.direction.tolist(), piece.length) for piece in pieces]
    eye_x, eye_y = view.position[:2].tolist()
    least_turn, reach = math.cos(parameters.square), parameters.extension
    for (index, one), (other_index, other) in combinations(enumerate(plain), 2):
        (x, y, along_x, along_y, length), (other_x, other_y, across_x, across_y, other_length) = one, other
        turn = along_x * across_y - along_y * across_x
        if abs(turn) < least_turn:
            continue
        along = ((other_x - x) * across_y - (other_y - y) * across_x) / turn
        place_x, place_y = x + along * along_x, y + along * along_y
        across = (place_x - other_x) * across_x + (place_y - other_y) * across_y
        if not (-reach <= along <= length + reach and -reach <= across <= other_length + reach):
            continue
        if math.hypot(place_x - eye_x, place_y - eye_y) <= parameters.farthest:
            point = np.array([place_x, place_y])
            places.append(_Place(point, pieces[index].direction, pieces[other_index].direction, None))
    return places


def _shapes(
    places: list[_Place], segmentation: Segmentation, view: View, parameters: CrossingParameters
) -> list[_Shape]:
    """Read the shapes of crossings from the picture, all at once."""
    count, arm = len(places), len(ARMS)
    axes = np.stack([[place.first, place.second] for place in places])  # (places, 2, 2)
    along = np.stack([place.arms() for place in places])
    between = np.stack([place.point for place in places])[:, None] + BETWEEN @ axes
    points = np.concatenate([along, between], axis=1)
    pixels = view.pixels_on_ground(points.reshape(-1, 2))
    (plain, classes), inside = view.sample_all((segmentation.whiteness, segmentation.classes), pixels)
    values = _brightest(segmentation.whiteness, pixels, inside).reshape(count, -1)[:, : 4 * arm]
    plain, classes = (each.reshape(count, -1) for each in (plain, classes))
    inside = inside.reshape(count, -1)
    on_green = belongs(classes[:, 4 * arm :], Colour.GREEN) & inside[:, 4 * arm :]
    carpet = _medians(plain[:, 4 * arm :], on_green)
    samples = values.reshape(count, 4, arm).astype(np.float64)
    arm_classes = classes[:, : 4 * arm].reshape(count, 4, arm)
    seen = inside[:, : 4 * arm].reshape(count, 4, arm)
    medians = np.where(seen.all(axis=2), np.median(samples, axis=2), carpet[:, None])
    paint = np.sort(medians, axis=1)[:, -2]  # at least two arms are paint
    contrast = paint - carpet
    is_paint = (samples > 0.5 * (paint + carpet)[:, None, None]) & seen
    green = belongs(arm_classes, Colour.GREEN) & seen
    is_carpet = green & (~is_paint | (samples < (carpet + 0.35 * contrast)[:, None, None]))
    # A pole, a foot or the ball may stand on an arm's end: what has their colours says nothing.
    hidden = belongs(arm_classes, THINGS) & ~is_paint & ~is_carpet
    number = hidden.sum(axis=2)
    judged = np.where(number <= MOST_HIDDEN, arm - number, arm)
    has = is_paint.sum(axis=2) >= parameters.least_arm * judged
    lacks = is_carpet.sum(axis=2) >= parameters.least_arm * judged
    shapes = []
    for index, place in enumerate(places):
        if np.count_nonzero(on_green[index]) < LEAST_BETWEEN:
            shapes.append(_Shape(None, 0.0, "little carpet between the arms"))
        elif contrast[index] < LEAST_CONTRAST:
            shapes.append(_Shape(None, 0.0, "no contrast"))
        elif not (has[index] | lacks[index]).all():
            shapes.append(_Shape(None, 0.0, "an arm is hidden or out of the picture"))
        else:
            shapes.append(_kind_of(has[index], place.centre is not None))
    return shapes


def _brightest(image: Mask, pixels: Array, inside: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return (n,) the highest value of the nine pixels around each of (n, 2) places; anything outside the picture."""
    height, width = image.shape
    u, v = (np.where(inside[:, None], pixels, 0.0) + 0.5).astype(np.intp).T
    index = np.clip(v, 1, height - 2) * width + np.clip(u, 1, width - 2)
    steps = np.array([[row * width + column] for row in (-1, 0, 1) for column in (-1, 0, 1)])
    highest: NDArray[np.uint8] = image.reshape(-1)[index + steps].max(axis=0)
    return highest


def _medians(values: NDArray[np.uint8], used: NDArray[np.bool_]) -> Array:
    """Return (n,) the median of what is used of each row of (n, m); 0 where nothing is."""
    number = used.sum(axis=1)
    ordered = np.sort(np.where(used, values, np.uint8(255)).astype(np.float64), axis=1)
    row = np.arange(len(values))
    middles = 0.5 * (
        ordered[row, np.maximum(number - 1, 0) // 2] + ordered[row, np.minimum(number // 2, values.shape[1] - 1)]
    )
    return np.where(number > 0, middles, 0.0)


def _kind_of(has: NDArray[np.bool_], circle: bool) -> _Shape:
    count = int(has.sum())
    if count == 4:
        return _Shape(FeatureClass.CROSSING_X, 0.9 if circle else 0.7, "")
    if circle:
        return _Shape(None, 0.0, "the circle does not cross here")
    if count == 3:
        return _Shape(FeatureClass.CROSSING_T, 0.85, "")
    if count == 2 and has[:2].any() and has[2:].any():
        return _Shape(FeatureClass.CROSSING_L, 0.85, "")
    return _Shape(None, 0.0, f"{count} arms, no corner")


def _feature(kind: FeatureClass, point: Array, confidence: float, view: View) -> Feature:
    direction = np.array([point[0], point[1], 0.0]) - view.position
    direction /= np.linalg.norm(direction)
    azimuth, elevation = angles(direction[None])
    spread_azimuth, spread_elevation = view.spreads(direction)
    return Feature(kind, float(azimuth[0]), float(elevation[0]), spread_azimuth, spread_elevation, confidence)


def _carpet_whiteness(segmentation: Segmentation) -> float:
    sampled = segmentation.whiteness[::8, ::8][belongs(segmentation.classes[::8, ::8], Colour.GREEN)]
    return float(np.partition(sampled, sampled.size // 2)[sampled.size // 2]) if sampled.size else 0.0


def _distance(point: Array, start: Array, end: Array) -> float:
    along = end - start
    share = float(np.clip((point - start) @ along / max(float(along @ along), 1e-12), 0.0, 1.0))
    return math.hypot(*(point - start - share * along))
