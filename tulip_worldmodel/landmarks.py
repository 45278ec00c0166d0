"""What the robot should see of the field from a state of localization (landmark_geometry.py)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import CrossingKind, Field, LineSegment
from tulip_vision.features import Feature, FeatureClass
from tulip_worldmodel.direction import wrap
from tulip_worldmodel.landmark_geometry import STATES, line_misfits, piece_on_ground, point_directions

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

CROSSINGS = {
    FeatureClass.CROSSING_L: CrossingKind.L,
    FeatureClass.CROSSING_T: CrossingKind.T,
    FeatureClass.CROSSING_X: CrossingKind.X,
}
POLES = {
    FeatureClass.POLE_YELLOW_BLUE_YELLOW: ("yellow", "blue", "yellow"),
    FeatureClass.POLE_BLUE_YELLOW_BLUE: ("blue", "yellow", "blue"),
}


@dataclass(frozen=True)
class Lines:
    """Straight lines of the field, in map.

    Attributes:
        directions: (n,) from start to end [rad].
        lengths: (n,) [m].
        along: (n, 2) unit vectors from start to end.
        across: (n, 2) unit vectors to the left of `along`.
        starts: (n, 2) the starts, each along and across its own line [m].
    """

    directions: Array
    lengths: Array
    along: Array
    across: Array
    starts: Array


def lines_of(segments: Sequence[LineSegment]) -> Lines:
    """Return the lines of segments, in their order."""
    directions = np.array([segment.direction for segment in segments])
    along = np.column_stack((np.cos(directions), np.sin(directions)))
    across = np.column_stack((-along[:, 1], along[:, 0]))
    starts = np.array([segment.start for segment in segments], dtype=np.float64).reshape(-1, 2)
    starts_by_line = np.column_stack(((along * starts).sum(axis=1), (across * starts).sum(axis=1)))
    return Lines(directions, np.array([segment.length for segment in segments]), along, across, starts_by_line)


@dataclass(frozen=True)
class Landmarks:
    """Places on the field that a feature may belong to.

    Attributes:
        points: For each feature class, (n, 2) places in map [m].
        lines: Straight lines.
        mates: (n, 2) for each goal post, the other one of its goal [m].
    """

    points: dict[FeatureClass, Array]
    lines: Lines
    mates: Array

    def of(self, feature: Feature) -> Array:
        """Return (n, 2) places in map that a feature may show, seen from anywhere between the goal lines [m]."""
        points = self.points[feature.kind]
        if feature.side == 0:
            return points
        return points[has_side(np.zeros(2), points, self.mates, feature.side)]


def landmarks_of(field: Field) -> Landmarks:
    """Return the field's landmarks, sorted by the class of feature that shows them."""
    points: dict[FeatureClass, list[tuple[float, float]]] = {
        FeatureClass.GOAL_POST: [(post.x, post.y) for post in field.goal_posts],
        FeatureClass.PENALTY_MARK: list(field.penalty_marks),
        FeatureClass.CENTRE_CIRCLE: [(field.centre_circle.x, field.centre_circle.y)],
    }
    for kind, crossing_kind in CROSSINGS.items():
        points[kind] = [(crossing.x, crossing.y) for crossing in field.crossings if crossing.kind is crossing_kind]
    for kind, colours in POLES.items():
        points[kind] = [(pole.x, pole.y) for pole in field.poles if pole.colours == colours]
    return Landmarks(
        {kind: np.array(places, dtype=np.float64).reshape(-1, 2) for kind, places in points.items()},
        lines_of(field.line_segments),
        np.array([(mate.x, mate.y) for goal in (field.own_goal, field.opponent_goal) for mate in goal.posts[::-1]]),
    )


def has_side(place: Array, points: Array, mates: Array, side: int) -> NDArray[np.bool_]:
    """Return (n,) which posts are the left (side 1) or the right one (side -1) of their goals.

    Args:
        place: (2,) from where they are seen [m].
        points: (n, 2) the posts [m].
        mates: (n, 2) the other posts of their goals [m].
        side: See `Feature.side`.
    """
    to_post, to_mate = points - place, mates - place
    left = to_post[:, 0] * to_mate[:, 1] - to_post[:, 1] * to_mate[:, 0] < 0.0  # its mate is to the right of it
    return left if side > 0 else ~left


class PointObservation:
    """A feature that shows one of several places on the ground."""

    def __init__(
        self,
        feature: Feature,
        points: Array,
        camera_position: Array,
        landmark_spread: float,
        mates: Array | None = None,
    ):
        """Remember what was seen.

        Args:
            feature: A post, pole, crossing or mark; its spreads are those that it shares with no other feature.
            points: (n, 2) places in map that it may be [m].
            camera_position: (3,) optical centre in base_footprint [m].
            landmark_spread: Standard deviation of the landmark's place along each axis [m].
            mates: (n, 2) the other posts of the goals, for a post of which the side is known [m].
        """
        self.feature = feature
        self._count = len(points)
        self._points = points
        self._mates = mates if feature.side else None
        self._camera_position = camera_position
        self._landmark_spread = landmark_spread
        self._azimuth_variance = feature.azimuth_spread**2
        self._elevation_variance = feature.elevation_spread**2
        self.rows = 1 if math.isnan(feature.elevation) else 2
        self._seen = np.array([feature.azimuth, feature.elevation])[: self.rows]

    def key(self, candidate: int) -> object:
        """Return what a candidate is, so that no two features of a picture claim it."""
        return tuple(self._points[candidate])

    def possible(self, state: Array) -> Indices:
        """Return the candidates worth a look, (n,): all, but for posts on the other side of their goals."""
        if self._mates is None:
            return np.arange(self._count)
        return np.flatnonzero(has_side(state[:2], self._points, self._mates, self.feature.side))

    def linearize(self, state: Array, candidates: Indices) -> tuple[Array, Array, Array]:
        """Return innovations (k, m), their Jacobians (k, m, 7) and noise (k, m, m) of some candidates."""
        angles, jacobian = point_directions(state, self._points[candidates], self._camera_position)
        innovation = self._seen - angles[:, : self.rows]
        innovation[:, 0] = wrap(innovation[:, 0])
        height, spread = self._camera_position[2], self._landmark_spread
        ground = height / np.tan(np.minimum(np.maximum(-angles[:, 1], 0.02), 1.5))
        noise = np.zeros((len(candidates), self.rows, self.rows))
        noise[:, 0, 0] = self._azimuth_variance + (spread / np.maximum(ground, 0.1)) ** 2
        if self.rows == 2:
            noise[:, 1, 1] = self._elevation_variance + (spread * height / (ground**2 + height**2)) ** 2
        return innovation, jacobian[:, : self.rows], noise


class LineObservation:
    """A piece of line that shows one of the field's straight lines."""

    OVERHANG = 0.5  # [m] by which a piece may reach beyond the line's end: error of far ends

    def __init__(
        self,
        feature: Feature,
        lines: Lines,
        camera_position: Array,
        landmark_spread: float,
    ):
        """Remember what was seen; arguments as of `PointObservation`."""
        self.feature = feature
        self._lines = lines
        self._camera_position = camera_position
        self._ends = np.array([[feature.azimuth, feature.elevation], [feature.end_azimuth, feature.end_elevation]])
        self._line_spread = landmark_spread
        self._angles_noise = np.square([feature.azimuth_spread, feature.elevation_spread] * 2)

    def key(self, candidate: int) -> object:
        """Return None: several pieces of one line may be in a picture."""
        return None

    def possible(self, state: Array) -> Indices:
        """Return the lines along which the whole piece lies."""
        lines = self._lines
        along = line_misfits(state, self._ends, self._camera_position, lines.directions, lines.starts)[3]
        inside = (along > -self.OVERHANG) & (along < lines.lengths[:, None] + self.OVERHANG)
        return np.flatnonzero(inside[:, 0] & inside[:, 1])

    def ground_ends(self) -> Array:
        """Return (2, 2) both ends on the ground in base_footprint [m], as the camera's pose has it."""
        return np.asarray(piece_on_ground(np.zeros(STATES), self._ends, self._camera_position)[0])

    def linearize(self, state: Array, candidates: Indices) -> tuple[Array, Array, Array]:
        """Return innovations (k, 2), their Jacobians (k, 2, 7) and noise (k, 2, 2) of some candidates."""
        directions, starts = self._lines.directions[candidates], self._lines.starts[candidates]
        misfits, by_state, by_angles, along = line_misfits(state, self._ends, self._camera_position, directions, starts)
        noise = (by_angles * self._angles_noise) @ by_angles.transpose(0, 2, 1)
        length = np.maximum(np.abs(along[:, 1] - along[:, 0]), 0.1)
        noise[:, 0, 0] += 2.0 * (self._line_spread / length) ** 2
        noise[:, 1, 1] += self._line_spread**2
        return -misfits, by_state, noise
