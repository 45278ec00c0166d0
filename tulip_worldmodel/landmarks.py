"""What the robot should see of the field from a pose, and how that changes with the pose.

State of localization, (6,): x, y [m], yaw [rad] of base_footprint in map; the small rotations about the x and
y axes of base_footprint [rad] by which the camera is tilted beyond what kinematics and IMU say; and the heading
drift [rad/s] that dead reckoning misses. An observed ray is the true offset o turned by the tilt w: o' = o + w x o.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import CrossingKind, Field, LineSegment
from tulip_vision.features import Feature, FeatureClass
from tulip_worldmodel.direction import directions, meet_plane, rays, wrap

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
class Landmarks:
    """Places on the field that a feature may belong to.

    Attributes:
        points: For each feature class, (n, 2) places in map [m].
        lines: Straight lines.
    """

    points: dict[FeatureClass, Array]
    lines: tuple[LineSegment, ...]


def landmarks_of(field: Field) -> Landmarks:
    """Return the field's landmarks, sorted by the class of feature that shows them."""
    points: dict[FeatureClass, list[tuple[float, float]]] = {
        FeatureClass.GOAL_POST: [(post.x, post.y) for post in field.goal_posts],
        FeatureClass.PENALTY_MARK: list(field.penalty_marks),
    }
    for kind, crossing_kind in CROSSINGS.items():
        points[kind] = [(crossing.x, crossing.y) for crossing in field.crossings if crossing.kind is crossing_kind]
    for kind, colours in POLES.items():
        points[kind] = [(pole.x, pole.y) for pole in field.poles if pole.colours == colours]
    return Landmarks(
        {kind: np.array(places, dtype=np.float64).reshape(-1, 2) for kind, places in points.items()},
        field.line_segments,
    )


def point_directions(state: Array, points: Array, camera_position: Array) -> tuple[Array, Array]:
    """Return under which angles places on the ground appear.

    Args:
        state: (6,) see the module.
        points: (n, 2) in map [m].
        camera_position: (3,) optical centre in base_footprint [m].

    Returns:
        (n, 2) azimuth and elevation [rad], and (n, 2, 6) their derivatives by the state.
    """
    yaw, roll, pitch = state[2], state[3], state[4]
    c, s = math.cos(yaw), math.sin(yaw)
    to_footprint = np.array([[c, s], [-s, c]])
    relative = (points - state[:2]) @ to_footprint.T
    offset = np.empty((len(points), 3))
    offset[:, :2] = relative - camera_position[:2]
    offset[:, 2] = -camera_position[2]
    by_state = np.zeros((len(points), 3, 6))
    by_state[:, :2, :2] = -to_footprint
    by_state[:, 0, 2] = relative[:, 1]
    by_state[:, 1, 2] = -relative[:, 0]
    tilt = np.array([[1.0, 0.0, pitch], [0.0, 1.0, -roll], [-pitch, roll, 1.0]])
    by_state = tilt @ by_state
    by_state[:, 1, 3] = -offset[:, 2]
    by_state[:, 2, 3] = offset[:, 1]
    by_state[:, 0, 4] = offset[:, 2]
    by_state[:, 2, 4] = -offset[:, 0]
    angles, by_offset = directions(offset @ tilt.T)
    return angles, by_offset @ by_state


def line_misfit(
    state: Array, ends: Array, line: LineSegment, camera_position: Array
) -> tuple[Array, Array, Array, Array]:
    """Return how an observed piece of line lies relative to a line of the field.

    Args:
        state: (6,) see the module.
        ends: (2, 2) azimuth and elevation of both ends [rad], below the horizon.
        line: The line of the field.
        camera_position: (3,) optical centre in base_footprint [m].

    Returns:
        (2,) angle between the two [rad, in [-pi/2, pi/2)] and distance of the piece's middle from the line [m];
        (2, 6) their derivatives by the state; (2, 4) by azimuth and elevation of the first and second end;
        (2,) where both ends lie along the line, from its start [m].
    """
    seen, ray_by_angles = rays(ends)
    roll, pitch = state[3], state[4]
    untilt = np.array([[1.0, 0.0, -pitch], [0.0, 1.0, roll], [pitch, -roll, 1.0]])
    level = seen @ untilt.T
    points, point_by_ray = meet_plane(level, camera_position)
    ray_by_tilt = np.zeros((2, 3, 2))
    ray_by_tilt[:, 1, 0] = seen[:, 2]
    ray_by_tilt[:, 2, 0] = -seen[:, 1]
    ray_by_tilt[:, 0, 1] = -seen[:, 2]
    ray_by_tilt[:, 2, 1] = seen[:, 0]
    point_by_tilt = point_by_ray @ ray_by_tilt
    point_by_angles = point_by_ray @ untilt @ ray_by_angles

    c, s = math.cos(state[2]), math.sin(state[2])
    rotation = np.array([[c, -s], [s, c]])
    direction = line.direction
    along = np.array([math.cos(direction), math.sin(direction)])
    across = np.array([-along[1], along[0]])
    in_map = points @ rotation.T + state[:2] - np.array(line.start)
    piece = points[1] - points[0]
    middle = points.mean(axis=0)
    angle = math.atan2(piece[1], piece[0]) + state[2] - direction
    misfit = np.array([half_turn(angle), across @ in_map.mean(axis=0)])

    length_squared = max(float(piece @ piece), 1e-6)
    by_end = np.empty((2, 2, 2))  # misfit by first and second point
    by_end[0, 1] = np.array([-piece[1], piece[0]]) / length_squared
    by_end[0, 0] = -by_end[0, 1]
    by_end[1, :] = across @ rotation / 2.0
    by_state = np.zeros((2, 6))
    by_state[0, 2] = 1.0
    by_state[1, :2] = across
    by_state[1, 2] = across @ rotation @ np.array([-middle[1], middle[0]])
    by_state[:, 3:5] = np.einsum("mep,ept->mt", by_end, point_by_tilt)
    by_angles = np.einsum("mep,epa->mea", by_end, point_by_angles).reshape(2, 4)
    return misfit, by_state, by_angles, np.asarray(in_map @ along)


def half_turn(angle: float) -> float:
    """Return the direction of an undirected line [rad] brought into [-pi/2, pi/2)."""
    return (angle + math.pi / 2.0) % math.pi - math.pi / 2.0


class PointObservation:
    """A feature that shows one of several places on the ground."""

    def __init__(self, feature: Feature, points: Array, camera_position: Array, spreads: tuple[float, float, float]):
        """Remember what was seen.

        Args:
            feature: A post, pole, crossing or mark.
            points: (n, 2) places in map that it may be [m].
            camera_position: (3,) optical centre in base_footprint [m].
            spreads: Added to the feature's own: azimuth [rad], elevation [rad], place of the landmark [m].
        """
        self.feature = feature
        self.count = len(points)
        self._points = points
        self._camera_position = camera_position
        self._spreads = spreads
        self._rows = 1 if math.isnan(feature.elevation) else 2
        self._seen = np.array([feature.azimuth, feature.elevation])[: self._rows]

    def key(self, candidate: int) -> object:
        """Return what a candidate is, so that no two features of a picture claim it."""
        return tuple(self._points[candidate])

    def possible(self, state: Array) -> Indices:
        """Return the candidates worth a look: all of them, (n,)."""
        return np.arange(self.count)

    def linearize(self, state: Array, candidates: Indices) -> tuple[Array, Array, Array]:
        """Return innovations (k, m), their Jacobians (k, m, 6) and noise (k, m, m) of some candidates."""
        angles, jacobian = point_directions(state, self._points[candidates], self._camera_position)
        innovation = self._seen - angles[:, : self._rows]
        innovation[:, 0] = wrap(innovation[:, 0])
        azimuth_spread, elevation_spread, landmark_spread = self._spreads
        height = self._camera_position[2]
        ground = height / np.tan(np.clip(-angles[:, 1], 0.02, 1.5))
        noise = np.zeros((len(candidates), self._rows, self._rows))
        noise[:, 0, 0] = (
            self.feature.azimuth_spread**2 + azimuth_spread**2 + (landmark_spread / np.maximum(ground, 0.1)) ** 2
        )
        if self._rows == 2:
            noise[:, 1, 1] = (
                self.feature.elevation_spread**2
                + elevation_spread**2
                + (landmark_spread * height / (ground**2 + height**2)) ** 2
            )
        return innovation, jacobian[:, : self._rows], noise


class LineObservation:
    """A piece of line that shows one of the field's straight lines."""

    OVERHANG = 0.5  # [m] by which a piece may reach beyond the line's end: error of far ends

    def __init__(
        self,
        feature: Feature,
        lines: tuple[LineSegment, ...],
        camera_position: Array,
        spreads: tuple[float, float, float],
    ):
        """Remember what was seen; arguments as of `PointObservation`."""
        self.feature = feature
        self.count = len(lines)
        self._lines = lines
        self._camera_position = camera_position
        self._spreads = spreads
        self._ends = np.array(
            [[feature.azimuth, feature.elevation], [feature.end_azimuth, feature.end_elevation]], dtype=np.float64
        )

    def key(self, candidate: int) -> object:
        """Return None: several pieces of one line may be in a picture."""
        return None

    def possible(self, state: Array) -> Indices:
        """Return the lines along which the whole piece lies."""
        found = []
        for candidate, line in enumerate(self._lines):
            along = self._misfit(state, candidate)[3]
            if min(along) > -self.OVERHANG and max(along) < line.length + self.OVERHANG:
                found.append(candidate)
        return np.array(found, dtype=np.intp)

    def _misfit(self, state: Array, candidate: int) -> tuple[Array, Array, Array, Array]:
        return line_misfit(state, self._ends, self._lines[candidate], self._camera_position)

    def ground_ends(self) -> Array:
        """Return (2, 2) both ends on the ground in base_footprint [m]."""
        return meet_plane(rays(self._ends)[0], self._camera_position)[0]

    def linearize(self, state: Array, candidates: Indices) -> tuple[Array, Array, Array]:
        """Return innovations (k, 2), their Jacobians (k, 2, 6) and noise (k, 2, 2) of some candidates."""
        azimuth_spread, elevation_spread, line_spread = self._spreads
        angles_noise = np.tile(
            [
                self.feature.azimuth_spread**2 + azimuth_spread**2,
                self.feature.elevation_spread**2 + elevation_spread**2,
            ],
            2,
        )
        innovations, jacobians, noises = [], [], []
        for candidate in candidates:
            misfit, by_state, by_angles, along = self._misfit(state, candidate)
            noise = (by_angles * angles_noise) @ by_angles.T
            piece = max(abs(along[1] - along[0]), 0.1)
            noise[0, 0] += 2.0 * (line_spread / piece) ** 2
            noise[1, 1] += line_spread**2
            innovations.append(-misfit)
            jacobians.append(by_state)
            noises.append(noise)
        return np.array(innovations), np.array(jacobians), np.array(noises)
