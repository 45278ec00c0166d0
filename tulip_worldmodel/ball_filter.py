"""Where the ball is and how it rolls: an extended Kalman filter in odom.

In odom the ball's position needs no localization. Everyone may kick the ball: when it is seen twice in a row
where the filter cannot explain it, the filter starts anew there, with the velocity between the two sightings.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_vision.features import Feature, FeatureClass, Features
from tulip_worldmodel.camera_error import CameraErrorParameters
from tulip_worldmodel.mahalanobis import gate
from tulip_worldmodel.moving_point import MovingPoint, PointEstimate, PointMotion, check_tracking, position_noise
from tulip_worldmodel.odometry_history import Increment
from tulip_worldmodel.rejected import Rejected
from tulip_worldmodel.rolling import DECELERATION, slowing
from tulip_worldmodel.sighting import Observer, Sighting, in_view

Array = NDArray[np.float64]

RESTLESS = 2.5  # mean squared distance per dimension from which a ball seems pushed; 1 for one that is not


@dataclass(frozen=True)
class BallParameters:
    """Parameters of the ball's filter. Noise grows with the root of what it is given for."""

    rolling_deceleration: float = DECELERATION  # [m/s^2]
    position_noise_per_second: float = 0.02  # [m/sqrt(s)] slow errors of the camera's pose
    position_noise_per_metre: float = 0.10  # [m/sqrt(m)] dead reckoning of the walking robot
    position_noise_per_radian: float = 0.06  # [rad/sqrt(rad)] times range: dead reckoning of the turning robot
    quiet_velocity_noise: float = 0.1  # [m/s/sqrt(s)] while sightings agree with the filter
    restless_velocity_noise: float = 1.5  # [m/s/sqrt(s)] while they do not: dribbled, pushed
    restless_time: float = 0.2  # [s] over which the agreement is averaged: three pictures
    angular_radius_range: float = 3.0  # [m] beyond it the ball's size tells its range better than its elevation
    angular_radius_spread: float = 0.0015  # [rad] a pixel
    start_speed_spread: float = 0.5  # [m/s] of a ball seen for the first time
    greatest_speed: float = 7.0  # [m/s] a faster jump is not one ball
    longest_range: float = 12.0  # [m] the field's diagonal
    gate_probability: float = 0.999  # share of true sightings inside the chi-square gate
    restart_time: float = 0.35  # [s] within which the second unexplained sighting must follow the first
    confidence_gain: float = 0.35  # share of the missing confidence that a sighting adds
    confirmed: float = 0.6  # confidence of a known ball: reached with the third sighting
    forgotten: float = 0.05  # confidence at which the ball is given up
    missed_time: float = 0.6  # [s] in which confidence falls by e while the ball should be visible but is not
    hidden_time: float = 20.0  # [s] in which confidence falls by e while nobody looks
    visible_range: float = 5.0  # [m] up to which vision is expected to find it
    view_margin: float = math.radians(4.0)  # [rad] from the picture's edge, where it may be cut

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        check_tracking(self)


class BallFilter:
    """The one ball of the game."""

    def __init__(
        self, parameters: BallParameters, ball_radius: float, camera: CameraErrorParameters | None = None
    ) -> None:
        """Begin without a ball.

        Args:
            parameters: See `BallParameters`.
            ball_radius: [m].
            camera: How far its pose may be off; by default as vision says.
        """
        self._parameters = parameters
        self._camera = camera or CameraErrorParameters()
        self._radius = ball_radius
        self._point: MovingPoint | None = None
        self._unexplained: Sighting | None = None
        self._restlessness = 1.0  # running mean of the squared distance per dimension; 1 when all is as expected
        self._was_confirmed = False
        self.confidence = 0.0
        self.last_seen = 0  # stamp [ns]

    @property
    def known(self) -> bool:
        """Whether the ball was confirmed and not given up since; a known ball stays so until forgotten."""
        return self._point is not None and self._was_confirmed

    @property
    def point(self) -> MovingPoint:
        """The filter of the ball's position and velocity.

        Raises:
            LookupError: if there is no ball, not even an unconfirmed one.
        """
        if self._point is None:
            raise LookupError("there is no ball; ask `known` first")
        return self._point

    def predict(self, moved: Increment, observer_position: Array) -> None:
        """Let the ball roll on while the robot moves.

        Args:
            moved: The robot's movement by dead reckoning, whose error makes the ball less sure.
            observer_position: (2,) robot in odom [m].
        """
        if self._point is None:
            return
        self._point.predict(self._rolling(self._point, moved, observer_position))
        if math.sqrt(np.trace(self._point.covariance[:2, :2])) > self._parameters.longest_range / 2.0:
            self._forget()

    def extrapolated(self, moved: Increment, observer_position: Array) -> PointEstimate:
        """Return the known ball after a movement as in `predict`, without changing the filter."""
        return self.point.predicted(self._rolling(self.point, moved, observer_position))

    def update(self, features: Features, observer: Observer, since_last: float, occluded: bool) -> tuple[Rejected, ...]:
        """Use one picture, with the ball predicted to its stamp.

        Args:
            features: Of the picture.
            observer: Where the camera was.
            since_last: Time since the last picture [s].
            occluded: Whether something known stands in front of the expected place.

        Returns:
            Ball features that were not used.
        """
        p = self._parameters
        rejected: list[Rejected] = []
        sightings: list[Sighting] = []
        for feature in features.features:
            if feature.kind is not FeatureClass.BALL:
                continue
            sighting = Sighting(feature, observer, self._radius, self._camera)
            if not sighting.has_range or self._range(sighting) > p.longest_range:
                rejected.append(Rejected(features.stamp, "a ball at or above the horizon, or off the field", feature))
            else:
                sightings.append(sighting)
        limit = gate(p.gate_probability, 2)
        matched = None
        if self._point is not None and sightings:
            nearest = min(sightings, key=self._point.distance)
            if self._point.distance(nearest) <= limit:
                matched = nearest
        if matched is not None:
            self._see(matched, since_last)
            others = [sighting for sighting in sightings if sighting is not matched]
            rejected += [Rejected(features.stamp, "another ball matches better", other.feature) for other in others]
            self._unexplained = None
            return tuple(rejected)
        if self._point is not None:
            self._miss(features, observer, since_last, occluded)
        if sightings:
            best = max(sightings, key=lambda sighting: sighting.feature.confidence)
            rejected += self._start(best, sightings)
        return tuple(rejected)

    def _range(self, sighting: Sighting) -> float:
        return math.dist(sighting.place().position, (sighting.observer.pose.x, sighting.observer.pose.y))

    def _see(self, sighting: Sighting, since_last: float) -> None:
        p, point = self._parameters, self.point
        share = 1.0 - math.exp(-since_last / p.restless_time)
        self._restlessness += share * (point.distance(sighting) / 2.0 - self._restlessness)
        point.see(sighting)
        self._use_angular_radius(sighting.feature, sighting.observer)
        self._gain_confidence(sighting)

    def _use_angular_radius(self, feature: Feature, observer: Observer) -> None:
        """Correct the range with the ball's size: sin(radius angle) = radius / distance."""
        p, point = self._parameters, self.point
        offset = observer.offset(point.state[:2], self._radius)[0]
        distance = float(np.linalg.norm(offset))
        if math.isnan(feature.angular_radius) or distance < max(p.angular_radius_range, 2.0 * self._radius):
            return
        expected = math.asin(self._radius / distance)
        by_distance = -self._radius / (distance * math.sqrt(distance**2 - self._radius**2))
        jacobian = np.zeros((1, 5))  # a turned camera sees it as large
        jacobian[0, :2] = by_distance * (observer.pose.rotation() @ (offset[:2] / distance))
        innovation = np.array([feature.angular_radius - expected])
        noise = np.array([[p.angular_radius_spread**2]])
        spread = float((jacobian[:, :2] @ point.covariance[:2, :2] @ jacobian[:, :2].T + noise)[0, 0])
        if innovation[0] ** 2 / spread <= gate(p.gate_probability, 1):  # a ball half hidden looks small
            point.correct(innovation, jacobian, noise)

    def _miss(self, features: Features, observer: Observer, since_last: float, occluded: bool) -> None:
        p, point = self._parameters, self.point
        angles, jacobian = observer.direction(point.state[:2], self._radius)
        spread = math.sqrt(float(np.max(np.diag(jacobian @ point.covariance[:2, :2] @ jacobian.T))))
        near = np.linalg.norm(observer.offset(point.state[:2], self._radius)[0]) < p.visible_range
        expected = near and not occluded and in_view(features, angles, p.view_margin + spread)
        self.confidence *= math.exp(-since_last / (p.missed_time if expected else p.hidden_time))
        if self.confidence < p.forgotten:
            self._forget()

    def _start(self, sighting: Sighting, sightings: list[Sighting]) -> list[Rejected]:
        """Begin a ball, or begin it anew after a second unexplained sighting."""
        p = self._parameters
        place = sighting.place()
        if self._point is None:
            self._point = MovingPoint(place, np.zeros(2), np.eye(2) * p.start_speed_spread**2, self._camera)
            self.confidence = 0.0
            self._restlessness = 1.0
            self._gain_confidence(sighting)
            self._unexplained = None
            return []
        first, self._unexplained = self._unexplained, sighting
        rest = [
            Rejected(sighting.observer.stamp, "does not fit the known ball", other.feature)
            for other in sightings
            if other is not sighting
        ]
        here = Rejected(
            sighting.observer.stamp, "does not fit the known ball; waiting for a second one", sighting.feature
        )
        if first is None:
            return [here, *rest]
        duration = (sighting.observer.stamp - first.observer.stamp) * 1e-9
        before = first.place()
        if not 0.0 < duration <= p.restart_time:
            return [here, *rest]
        velocity = (place.position - before.position) / duration
        _, anew = self._camera.fading(duration)  # what both sightings have in common moves neither
        velocity_covariance = (before.own + place.covariance(anew)) / duration**2
        spread = math.sqrt(float(np.trace(velocity_covariance)))
        if np.linalg.norm(velocity) > p.greatest_speed + 2.0 * spread:
            return [here, *rest]
        # Weighed with what balls do (they stand or roll at most at a few m/s), far sightings give no wild speeds.
        prior = (p.greatest_speed / 2.0) ** 2 * np.eye(2)
        gain = prior @ np.linalg.inv(prior + velocity_covariance)
        self._point = MovingPoint(place, gain @ velocity, (np.eye(2) - gain) @ prior, self._camera)
        self._restlessness = 1.0
        self._unexplained = None
        self._gain_confidence(sighting)
        return rest

    def _gain_confidence(self, sighting: Sighting) -> None:
        p = self._parameters
        self.confidence += p.confidence_gain * (1.0 - self.confidence)
        self._was_confirmed = self._was_confirmed or self.confidence >= p.confirmed
        self.last_seen = sighting.observer.stamp

    def _forget(self) -> None:
        self._point = None
        self._was_confirmed = False
        self.confidence = 0.0

    def _velocity_noise(self) -> float:
        p = self._parameters
        share = min(1.0, max(0.0, (self._restlessness - RESTLESS) / RESTLESS))
        return p.quiet_velocity_noise + share * (p.restless_velocity_noise - p.quiet_velocity_noise)

    def _rolling(self, point: MovingPoint, moved: Increment, observer_position: Array) -> PointMotion:
        """Return how a ball rolls: it loses `rolling_deceleration` of its speed each second until it rests."""
        p = self._parameters
        state = point.state
        x, y = state[:2].tolist()
        return PointMotion(
            moved.duration,
            slowing(state[2:], point.covariance[2:, 2:], p.rolling_deceleration, moved.duration),
            position_noise(
                (x - float(observer_position[0]), y - float(observer_position[1])),
                p.position_noise_per_second**2 * moved.duration + p.position_noise_per_metre**2 * moved.distance,
                p.position_noise_per_radian**2 * moved.turned,
            ),
            self._velocity_noise() ** 2 * moved.duration,
        )
