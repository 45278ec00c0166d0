"""Poses from which one picture could have been taken: where a lost robot begins to look for itself.

Three kinds of minimal sets fix a pose (x, y, yaw), with p the place of a feature in base_footprint and a a landmark:

- two points:           yaw = angle(a2 - a1) - angle(p2 - p1),   if |a2 - a1| is about |p2 - p1|
- a point and a line:   yaw = k pi / 2 - angle(line), k = 0..3, since all lines of a field are along its sides
- a point and the heading that dead reckoning has kept

and then (x, y) = a - R(yaw) p. Each pose is weighed by how well it explains all features of the picture: a feature
that is d away from the nearest landmark of its kind costs min(d^2 / (2 s^2), most), with the spread s growing with
range; so one false feature cannot rule out the true pose. The field looks the same from a pose and from its mirror
image, turned by pi about the centre, but for the colours of the poles. What decides is the heading: it is known at the
start, and the IMU carries it on even where the legs' dead reckoning is worth nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_worldmodel.direction import HORIZON, half_turn, wrap
from tulip_worldmodel.landmarks import Landmarks, landmarks_of
from tulip_worldmodel.localization_parameters import LocalizationParameters

Array = NDArray[np.float64]

POSITION_SPREAD, HEADING_SPREAD = 0.3, math.radians(8.0)  # [m], [rad] of a seed: a far feature, a swaying trunk
SAME_PLACE, SAME_HEADING = 0.6, math.radians(20.0)  # [m], [rad] poses closer together are one
NEAREST_SPREAD, SPREAD_PER_METRE = 0.1, 0.05  # [m], 1 spread of a feature on the ground: 0.3 m at 4 m
MOST = 5.0  # nats that one feature can cost
PAIR_MISFIT = 0.5  # [m] between the distances of two features and of two landmarks
LONG_LINE = 0.8  # [m] a shorter piece of line does not tell the heading
LONGEST_RANGE = 6.5  # [m] of a feature that fixes a place
LINES = 2  # longest pieces of line that are tried
OVERHANG = 0.5  # [m] by which a piece of line may reach beyond the line's end


@dataclass(frozen=True)
class Seed:
    """A pose of base_footprint in map, and how well it explains the picture (log-likelihood, not normalised)."""

    pose: Pose2D
    log_weight: float


@dataclass(frozen=True)
class _Point:
    landmarks: Array  # (n, 2) that it may be, in map [m]
    place: Array  # (2,) in base_footprint [m]
    spread: float  # [m]


@dataclass(frozen=True)
class _Piece:
    ends: Array  # (2, 2) in base_footprint [m]
    spread: float  # [m]

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.ends[1] - self.ends[0]))

    @property
    def direction(self) -> float:
        way = self.ends[1] - self.ends[0]
        return math.atan2(float(way[1]), float(way[0]))


class SeedFinder:
    """Finds the poses that explain a picture."""

    def __init__(self, parameters: LocalizationParameters, field: Field) -> None:
        """Prepare for a field."""
        self._parameters = parameters
        self._landmarks: Landmarks = landmarks_of(field)
        self._reach = np.array([field.carpet_length, field.carpet_width]) / 2.0

    def find(self, features: Features, heading: float) -> tuple[Seed, ...]:
        """Return the best poses for a picture, best first, none close to another.

        Args:
            features: Of the picture.
            heading: Yaw of base_footprint in map that dead reckoning has kept [rad].
        """
        points, pieces = self._points(features), self._pieces(features)
        poses = self._candidates(points, pieces, heading)
        poses = poses[(np.abs(poses[:, :2]) < self._reach).all(axis=1)]
        if not len(poses):
            return ()
        scores = self.heading_priors(poses[:, 2], heading)
        for point in points:
            scores -= self._point_cost(poses, point)
        for piece in pieces:
            scores -= self._piece_cost(poses, piece)
        seeds: list[Seed] = []
        for index in np.argsort(-scores, kind="stable"):
            pose = Pose2D(*(float(value) for value in poses[index]))
            if not any(close(pose, seed.pose) for seed in seeds):
                seeds.append(Seed(pose, float(scores[index])))
                if len(seeds) == self._parameters.seeds:
                    break
        return tuple(seeds)

    def heading_prior(self, yaw: float, heading: float) -> float:
        """Return the log-density of one heading; see `heading_priors`."""
        return float(self.heading_priors(np.array([yaw]), heading)[0])

    def heading_priors(self, yaws: Array, heading: float) -> Array:
        """Return (n,) log-density of headings, 0 at its peak: that of the IMU, or any if it was switched off between.

        Args:
            yaws: (n,) in map [rad].
            heading: That dead reckoning has kept [rad].
        """
        p = self._parameters
        kept = np.exp(-0.5 * (wrap(yaws - heading) / p.heading_continuity) ** 2)
        return np.asarray(np.log(kept + p.heading_break))

    def _points(self, features: Features) -> list[_Point]:
        found = []
        for feature in features.features:
            if feature.kind in self._landmarks.points and feature.elevation < HORIZON:
                place = _ground(features.camera_position, feature.azimuth, feature.elevation)
                distance = float(np.linalg.norm(place))
                if distance < LONGEST_RANGE:
                    found.append(
                        _Point(self._landmarks.of(feature), place, NEAREST_SPREAD + SPREAD_PER_METRE * distance)
                    )
        return found

    def _pieces(self, features: Features) -> list[_Piece]:
        found = []
        for feature in features.features:
            if feature.kind is FeatureClass.LINE and _below(feature):
                ends = np.array(
                    [
                        _ground(features.camera_position, feature.azimuth, feature.elevation),
                        _ground(features.camera_position, feature.end_azimuth, feature.end_elevation),
                    ]
                )
                distance = float(np.linalg.norm(ends, axis=1).max())
                piece = _Piece(ends, NEAREST_SPREAD + SPREAD_PER_METRE * distance)
                if distance < LONGEST_RANGE and piece.length >= self._parameters.shortest_line:
                    found.append(piece)
        return sorted(found, key=lambda piece: -piece.length)

    def _candidates(self, points: Sequence[_Point], pieces: Sequence[_Piece], heading: float) -> Array:
        """Return (n, 3) poses from all minimal sets."""
        found = [np.empty((0, 3))]
        yaws = [heading]
        for piece in pieces[:LINES]:
            if piece.length >= LONG_LINE:
                yaws += [wrap_angle(quarter * math.pi / 2.0 - piece.direction) for quarter in range(4)]
        for point in points:
            for yaw in yaws:
                found.append(_poses(point.landmarks, np.full(len(point.landmarks), yaw), point.place))
        for first, second in permutations(points, 2):
            if first.spread < second.spread:  # the nearer one fixes the place
                found.append(self._from_pair(first, second))
        return np.concatenate(found)

    def _from_pair(self, first: _Point, second: _Point) -> Array:
        ours, theirs = first.landmarks, second.landmarks
        ways = theirs[None] - ours[:, None]  # (a, b, 2)
        way = second.place - first.place
        lengths = np.hypot(ways[..., 0], ways[..., 1])
        chosen, other = np.nonzero((np.abs(lengths - math.hypot(*way)) < PAIR_MISFIT) & (lengths > PAIR_MISFIT))
        turns = ways[chosen, other]
        yaws = wrap(np.arctan2(turns[:, 1], turns[:, 0]) - math.atan2(float(way[1]), float(way[0])))
        return _poses(ours[chosen], yaws, first.place)

    def _point_cost(self, poses: Array, point: _Point) -> Array:
        places = point.landmarks
        if not len(places):
            return np.full(len(poses), MOST)
        seen = _in_map(poses, point.place[None])[:, 0]
        squares = ((seen[:, None] - places[None]) ** 2).sum(axis=2).min(axis=1)
        return np.asarray(np.minimum(squares / (2.0 * point.spread**2), MOST))

    def _piece_cost(self, poses: Array, piece: _Piece) -> Array:
        lines = self._landmarks.lines
        ends = _in_map(poses, piece.ends)  # (n, 2, 2)
        across = ends @ lines.across.T - lines.starts[:, 1]  # (n, 2, l)
        along = ends @ lines.along.T - lines.starts[:, 0]
        inside = ((along > -OVERHANG) & (along < lines.lengths + OVERHANG)).all(axis=1)
        parallel = np.abs(half_turn(poses[:, 2, None] + piece.direction - lines.directions)) < math.radians(30.0)
        squares = np.where(inside & parallel, (across**2).max(axis=1), np.inf).min(axis=1)
        return np.asarray(np.minimum(squares / (2.0 * piece.spread**2), MOST))


def close(first: Pose2D, second: Pose2D) -> bool:
    """Return whether two poses are one and the same for a lost robot."""
    return (
        math.hypot(first.x - second.x, first.y - second.y) < SAME_PLACE
        and abs(wrap_angle(first.yaw - second.yaw)) < SAME_HEADING
    )


def _below(feature: Feature) -> bool:
    return bool(feature.elevation < HORIZON and feature.end_elevation < HORIZON)


def _ground(camera_position: Array, azimuth: float, elevation: float) -> Array:
    """Return (2,) where a direction below the horizon meets the ground, in base_footprint [m]."""
    reach = float(camera_position[2]) / math.tan(-elevation)
    return camera_position[:2] + reach * np.array([math.cos(azimuth), math.sin(azimuth)])


def _poses(places: Array, yaws: Array, seen: Array) -> Array:
    """Return (n, 3) poses from which landmarks (n, 2) are seen at a place (2,) of base_footprint."""
    c, s = np.cos(yaws), np.sin(yaws)
    turned = np.stack([c * seen[0] - s * seen[1], s * seen[0] + c * seen[1]], axis=1)
    return np.column_stack([places - turned, yaws])


def _in_map(poses: Array, places: Array) -> Array:
    """Return (n, k, 2) in map of places (k, 2) in base_footprint, for poses (n, 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)  # (n, 2, 2)
    return np.asarray(poses[:, None, :2] + np.einsum("nij,kj->nki", turn, places))
