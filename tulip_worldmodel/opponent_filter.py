"""Where the opponents are: an extended Kalman filter in odom for each."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import wrap_angle
from tulip_vision.features import FeatureClass, Features
from tulip_worldmodel.association import assign
from tulip_worldmodel.camera_error import CameraErrorParameters
from tulip_worldmodel.direction import HORIZON
from tulip_worldmodel.mahalanobis import gate
from tulip_worldmodel.moving_point import MovingPoint, PointEstimate, PointMotion, check_tracking, position_noise
from tulip_worldmodel.odometry_history import Increment
from tulip_worldmodel.rejected import Rejected
from tulip_worldmodel.rolling import Slowing
from tulip_worldmodel.sighting import Observer, Sighting, in_view

Array = NDArray[np.float64]

GROUND = 0.0  # [m] a sighting shows the point on the ground below the opponent


@dataclass(frozen=True)
class OpponentParameters:
    """Parameters of the opponents' filters. Noise grows with the root of what it is given for."""

    velocity_time: float = 1.0  # [s] in which a walking robot's velocity is forgotten: it stops and turns
    velocity_noise: float = 0.3  # [m/s/sqrt(s)] walking robots change speed by about that in a second
    position_noise_per_second: float = 0.05  # [m/sqrt(s)] the point below a robot is not well defined
    position_noise_per_metre: float = 0.10  # [m/sqrt(m)] dead reckoning of the walking robot
    position_noise_per_radian: float = 0.06  # [rad/sqrt(rad)] times range: dead reckoning of the turning robot
    body_azimuth_spread: float = math.radians(1.0)  # [rad] a body is wide, besides what vision claims
    body_elevation_spread: float = math.radians(1.0)  # [rad] feet differ from the middle of the body, likewise
    start_speed_spread: float = 0.3  # [m/s]
    longest_range: float = 8.0  # [m] not born further away
    body_radius: float = 0.3  # [m] two nearer than this are one; what lies behind is hidden
    most: int = 4  # opponents tracked at once
    gate_probability: float = 0.999  # share of true sightings inside the chi-square gate
    confidence_gain: float = 0.3  # share of the missing confidence that a sighting adds
    confirmed: float = 0.6  # confidence of a confirmed opponent: reached with the third sighting
    forgotten: float = 0.05  # confidence at which it is given up
    missed_time: float = 0.6  # [s] in which confidence falls by e while it should be visible but is not
    hidden_time: float = 15.0  # [s] in which confidence falls by e while nobody looks
    marker_height: float = 0.95  # [m] of the team marker's middle: what vision must see to find anybody
    visible_range: float = 5.0  # [m] up to which vision is expected to find it
    view_margin: float = math.radians(5.0)  # [rad] from the picture's edge, where it may be cut

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        check_tracking(self)


class Opponent:
    """One opponent, perhaps not yet confirmed."""

    def __init__(self, parameters: OpponentParameters, camera: CameraErrorParameters, sighting: Sighting) -> None:
        """Begin where a sighting with range shows it."""
        speed = np.eye(2) * parameters.start_speed_spread**2
        self.point = MovingPoint(sighting.place(), np.zeros(2), speed, camera)
        self._parameters = parameters
        self.confirmed = False
        self.confidence = 0.0
        self.last_seen = 0  # stamp [ns]
        self.gain_confidence(sighting)

    def gain_confidence(self, sighting: Sighting) -> None:
        """Count a sighting."""
        self.confidence += self._parameters.confidence_gain * (1.0 - self.confidence)
        self.confirmed = self.confirmed or self.confidence >= self._parameters.confirmed
        self.last_seen = sighting.observer.stamp

    def walking(self, moved: Increment, observer_position: Array) -> PointMotion:
        """Return how it walks on while the robot moves; its velocity fades with `velocity_time`."""
        p = self._parameters
        x, y = self.point.state[:2].tolist()
        return PointMotion(
            moved.duration,
            Slowing(math.exp(-moved.duration / p.velocity_time) * np.eye(2), np.zeros(2), np.zeros((2, 2))),
            position_noise(
                (x - float(observer_position[0]), y - float(observer_position[1])),
                p.position_noise_per_second**2 * moved.duration + p.position_noise_per_metre**2 * moved.distance,
                p.position_noise_per_radian**2 * moved.turned,
            ),
            p.velocity_noise**2 * moved.duration,
        )

    def extrapolated(self, moved: Increment, observer_position: Array) -> PointEstimate:
        """Return where it is after a movement as in `OpponentFilter.predict`, without changing the filter."""
        return self.point.predicted(self.walking(moved, observer_position))


class OpponentFilter:
    """All opponents."""

    def __init__(self, parameters: OpponentParameters, camera: CameraErrorParameters | None = None) -> None:
        """Begin without opponents; the camera's pose may be off as far as vision says, if not told otherwise."""
        self._parameters = parameters
        self._camera = camera or CameraErrorParameters()
        self._opponents: list[Opponent] = []

    @property
    def confirmed(self) -> tuple[Opponent, ...]:
        """Opponents that were seen often enough, in the order of their birth."""
        return tuple(opponent for opponent in self._opponents if opponent.confirmed)

    def predict(self, moved: Increment, observer_position: Array) -> None:
        """Let opponents walk on while the robot moves; arguments as of `BallFilter.predict`."""
        for opponent in self._opponents:
            opponent.point.predict(opponent.walking(moved, observer_position))

    def update(self, features: Features, observer: Observer, since_last: float) -> tuple[Rejected, ...]:
        """Use one picture, with the opponents predicted to its stamp.

        Args:
            features: Of the picture.
            observer: Where the camera was.
            since_last: Time since the last picture [s].

        Returns:
            Opponent features that were not used.
        """
        p = self._parameters
        sightings = [
            Sighting(feature, observer, GROUND, self._camera, (p.body_azimuth_spread, p.body_elevation_spread))
            for feature in features.features
            if feature.kind is FeatureClass.OPPONENT
        ]
        distances = np.array(
            [[opponent.point.distance(sighting) for sighting in sightings] for opponent in self._opponents]
        ).reshape(len(self._opponents), len(sightings))
        limits = np.array([gate(p.gate_probability, 2 if sighting.has_range else 1) for sighting in sightings])
        pairs = assign(distances, limits)
        for row, column in pairs:
            self._opponents[row].point.see(sightings[column])
            self._opponents[row].gain_confidence(sightings[column])
        seen = {row for row, _ in pairs}
        for row, opponent in enumerate(self._opponents):
            if row not in seen:
                self._miss(opponent, features, observer, since_last)
        self._opponents = [opponent for opponent in self._opponents if opponent.confidence >= p.forgotten]
        used = {column for _, column in pairs}
        rejected = []
        for column, sighting in enumerate(sightings):
            if column in used:
                continue
            reason = self._give_birth(sighting)
            if reason:
                rejected.append(Rejected(features.stamp, reason, sighting.feature))
        self._merge()
        return tuple(rejected)

    def hides(self, angles: Array, distance: float, observer: Observer, features: Features) -> bool:
        """Tell whether an opponent stands in front of a point.

        Args:
            angles: (2,) of the point.
            distance: Of the point along the ground [m].
            observer: Where the camera was.
            features: Of the picture, for opponents so near that their feet are below it: they have no range, and may
                not be confirmed.
        """
        lowest = float(features.view[2])
        if lowest < HORIZON:
            farthest = float(observer.camera_position[2]) / math.tan(-lowest)  # their feet would be seen further away
            half_width = math.atan2(self._parameters.body_radius, farthest)
            for feature in features.features:
                if feature.kind is FeatureClass.OPPONENT and math.isnan(feature.elevation) and farthest < distance:
                    if abs(wrap_angle(feature.azimuth - float(angles[0]))) < half_width:
                        return True
        for opponent in self.confirmed:
            seen, _ = observer.direction(opponent.point.state[:2], GROUND)
            offset = observer.offset(opponent.point.state[:2], GROUND)[0]
            nearer = float(np.hypot(offset[0], offset[1]))
            half_width = math.atan2(self._parameters.body_radius, nearer)
            if nearer < distance and abs(wrap_angle(float(seen[0] - angles[0]))) < half_width:
                return True
        return False

    def _miss(self, opponent: Opponent, features: Features, observer: Observer, since_last: float) -> None:
        p = self._parameters
        # Of somebody close by, a camera that looks down sees the feet only, and vision knows nobody by the feet.
        angles, _ = observer.direction(opponent.point.state[:2], p.marker_height)
        near = np.linalg.norm(observer.offset(opponent.point.state[:2], GROUND)[0]) < p.visible_range
        expected = near and in_view(features, angles, p.view_margin)
        opponent.confidence *= math.exp(-since_last / (p.missed_time if expected else p.hidden_time))

    def _give_birth(self, sighting: Sighting) -> str:
        """Begin an opponent; return why not, or ""."""
        p = self._parameters
        if not sighting.has_range:
            return "an unknown opponent without range"
        if math.dist(sighting.place().position, (sighting.observer.pose.x, sighting.observer.pose.y)) > p.longest_range:
            return "an unknown opponent too far away"
        if len(self._opponents) >= p.most:
            return "more opponents than can be on the field"
        self._opponents.append(Opponent(p, self._camera, sighting))
        return ""

    def _merge(self) -> None:
        """Let the surest stay of opponents that stand inside each other."""
        kept: list[Opponent] = []
        for opponent in sorted(self._opponents, key=lambda each: -each.confidence):
            place = opponent.point.state[:2]
            if all(math.dist(place, other.point.state[:2]) > self._parameters.body_radius for other in kept):
                kept.append(opponent)
        self._opponents = [opponent for opponent in self._opponents if opponent in kept]
