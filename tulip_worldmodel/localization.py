"""Where the robot is on the field: an extended Kalman filter over dead reckoning and landmarks.

State: x, y [m], yaw [rad] of base_footprint in map, two small tilts of the camera [rad], and the drift of the
heading [rad/s] (see landmarks.py). The tilts die out with a time constant; they carry what all features of a picture,
and of the next ones, have in common: a swaying trunk misjudged by half a degree moves every far feature by
decimetres in the same direction. The drift is the bias of the gyro and of slipping feet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_worldmodel.direction import HORIZON
from tulip_worldmodel.landmark_association import Observation, associate
from tulip_worldmodel.landmarks import CROSSINGS, LineObservation, PointObservation, landmarks_of
from tulip_worldmodel.mahalanobis import distances_and_determinants, gate
from tulip_worldmodel.odometry_history import Increment
from tulip_worldmodel.rejected import Rejected

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LocalizationParameters:
    """Parameters of localization. Noise of dead reckoning grows with the root of what it is given for."""

    start_position_spread: float = 0.3  # [m] a person puts the robot down by eye
    start_heading_spread: float = math.radians(10.0)  # [rad]
    position_noise_per_metre: float = 0.10  # [m/sqrt(m)] feet slip by 5 to 10 % of a step
    position_noise_per_radian: float = 0.05  # [m/sqrt(rad)] turning in place wanders
    position_noise_per_second: float = 0.01  # [m/sqrt(s)] keeps the filter awake while standing
    heading_noise_per_metre: float = math.radians(1.0)  # [rad/sqrt(m)]
    heading_noise_per_radian: float = math.radians(2.0)  # [rad/sqrt(rad)] slip of the turning foot
    heading_noise_per_second: float = math.radians(0.3)  # [rad/sqrt(s)] noise of the gyro
    drift_spread: float = 0.02  # [rad/s] of the heading: bias of the gyro
    drift_time: float = 60.0  # [s] how long a drift lasts
    tilt_spread: float = math.radians(0.6)  # [rad] of the camera: IMU, bending of legs and neck while walking
    tilt_time: float = 0.5  # [s] how long a tilt lasts: about a step
    extra_azimuth_spread: float = math.radians(0.4)  # [rad] lens, pan encoder, and time stamps while turning
    extra_elevation_spread: float = math.radians(0.3)  # [rad] lens and tilt encoder
    landmark_spread: float = 0.03  # [m] lines are painted by hand; which edge of a line or post is seen
    longest_range: float = 8.0  # [m] features further away on the ground are not used
    shortest_line: float = 0.5  # [m] shorter pieces may belong to the centre circle
    false_rate_crossing: float = 0.15  # one in seven, measured
    false_rate_other: float = 0.05  # posts, poles, marks, lines
    gate_probability: float = 0.995  # share of true features inside the chi-square gate
    association_odds: float = 10.0  # the best explanation must be so much likelier than the next
    lost_time: float = 2.0  # [s] with features but none explained, after which uncertainty grows faster
    lost_position_noise: float = 0.3  # [m/sqrt(s)] then
    lost_heading_noise: float = math.radians(10.0)  # [rad/sqrt(s)] then

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{entry.name} is {value}; expected a finite value > 0")
        for name in ("false_rate_crossing", "false_rate_other", "gate_probability"):
            if getattr(self, name) >= 1.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected a probability < 1")
        if self.association_odds <= 1.0:
            raise ValueError(f"association_odds is {self.association_odds}; expected > 1")


LINE_CLUTTER = 1.0 / (math.pi * 4.0)  # false pieces of line: any direction, within some 4 m across


class Localization:
    """Pose of base_footprint in map, with its covariance."""

    def __init__(self, parameters: LocalizationParameters, field: Field, start: Pose2D) -> None:
        """Begin at a known place.

        Args:
            parameters: See `LocalizationParameters`.
            field: The field to be found again.
            start: base_footprint in map, as good as `start_position_spread` and `start_heading_spread` say.
        """
        self._parameters = parameters
        self._landmarks = landmarks_of(field)
        self._unexplained = 0.0  # [s] with features of which none could be used
        p = parameters
        self._filter = ExtendedKalmanFilter(dim_x=6, dim_z=2)
        self._filter.x = np.array([start.x, start.y, start.yaw, 0.0, 0.0, 0.0])
        spreads = (p.start_position_spread, p.start_position_spread, p.start_heading_spread)
        self._filter.P = np.diag(np.square([*spreads, p.tilt_spread, p.tilt_spread, p.drift_spread]))
        self._filter.B = np.eye(6)

    @property
    def pose(self) -> Pose2D:
        """base_footprint in map, at the last prediction."""
        x, y, yaw = self._filter.x[:3]
        return Pose2D(float(x), float(y), wrap_angle(float(yaw)))

    @property
    def covariance(self) -> Array:
        """(3, 3) of x [m], y [m], yaw [rad] in map."""
        return np.array(self._filter.P[:3, :3])

    @property
    def tilt(self) -> Array:
        """(2,) estimated roll and pitch of the camera beyond what its pose says [rad]."""
        return np.array(self._filter.x[3:5])

    def predict(self, moved: Increment) -> None:
        """Move with dead reckoning."""
        state, transition, noise = self._motion(moved)
        self._filter.F = transition
        self._filter.Q = noise
        self._filter.predict(u=state - transition @ self._filter.x)  # so that F x + B u is the exact motion
        self._tidy()

    def predicted(self, moved: Increment) -> tuple[Pose2D, Array]:
        """Return pose and (3, 3) covariance after a movement, without changing the filter."""
        state, transition, noise = self._motion(moved)
        covariance = (transition @ self._filter.P @ transition.T + noise)[:3, :3]
        pose = Pose2D(float(state[0]), float(state[1]), wrap_angle(float(state[2])))
        return pose, np.asarray((covariance + covariance.T) / 2.0)

    def update(self, features: Features, since_last: float) -> tuple[Rejected, ...]:
        """Correct the pose with one picture, taken where the robot is now predicted to be.

        Args:
            features: Of the picture.
            since_last: Time since the last picture [s].

        Returns:
            The landmark features that were not used.
        """
        rejected: list[Rejected] = []
        observations: list[Observation] = []
        for feature in features.features:
            if feature.kind in (FeatureClass.BALL, FeatureClass.OPPONENT):
                continue
            observation, reason = self._observation(feature, features.camera_position)
            if observation is None:
                rejected.append(Rejected(features.stamp, reason, feature))
            else:
                observations.append(observation)
        choices = associate(
            self._filter.x,
            self._filter.P,
            observations,
            [self._false_rate(observation.feature) for observation in observations],
            [LINE_CLUTTER if observation.feature.kind is FeatureClass.LINE else 1.0 for observation in observations],
            self._parameters.gate_probability,
            self._parameters.association_odds,
        )
        used = False
        for choice in choices:
            observation = observations[choice.observation]
            if choice.candidate is None:
                rejected.append(Rejected(features.stamp, choice.reason, observation.feature))
            elif self._correct(observation, choice.candidate):
                used = True
            else:
                rejected.append(Rejected(features.stamp, "outside the gate after the others", observation.feature))
        self._unexplained = 0.0 if used else self._unexplained + (since_last if observations else 0.0)
        return tuple(rejected)

    def _motion(self, moved: Increment) -> tuple[Array, Array, Array]:
        """Return the state after a movement, its Jacobian and the noise added."""
        p = self._parameters
        x, y, yaw, roll, pitch, drift = self._filter.x.tolist()
        c, s = math.cos(yaw), math.sin(yaw)
        step_x, step_y = c * moved.pose.x - s * moved.pose.y, s * moved.pose.x + c * moved.pose.y
        fade = math.exp(-moved.duration / p.tilt_time)
        keep = math.exp(-moved.duration / p.drift_time)
        turned = yaw + moved.pose.yaw + drift * moved.duration
        state = np.array([x + step_x, y + step_y, wrap_angle(turned), roll * fade, pitch * fade, drift * keep])
        transition = np.diag([1.0, 1.0, 1.0, fade, fade, keep])
        transition[0, 2], transition[1, 2] = -step_y, step_x
        transition[2, 5] = moved.duration
        position = (
            p.position_noise_per_metre**2 * moved.distance
            + p.position_noise_per_radian**2 * moved.turned
            + p.position_noise_per_second**2 * moved.duration
        )
        heading = (
            p.heading_noise_per_metre**2 * moved.distance
            + p.heading_noise_per_radian**2 * moved.turned
            + p.heading_noise_per_second**2 * moved.duration
        )
        if self._unexplained > p.lost_time:
            position += p.lost_position_noise**2 * moved.duration
            heading += p.lost_heading_noise**2 * moved.duration
        tilt = p.tilt_spread**2 * (1.0 - fade**2)
        wander = p.drift_spread**2 * (1.0 - keep**2)
        return state, transition, np.diag([position, position, heading, tilt, tilt, wander])

    def _observation(self, feature: Feature, camera_position: Array) -> tuple[Observation | None, str]:
        p = self._parameters
        spreads = (p.extra_azimuth_spread, p.extra_elevation_spread, p.landmark_spread)
        lowest = -math.atan2(float(camera_position[2]), p.longest_range)
        if feature.kind is FeatureClass.LINE:
            if not (feature.elevation < HORIZON and feature.end_elevation < HORIZON):
                return None, "an end of the line is not below the horizon"
            line = LineObservation(feature, self._landmarks.lines, camera_position, spreads)
            ends = line.ground_ends()
            if np.linalg.norm(ends.mean(axis=0)) > p.longest_range:
                return None, "too far away"
            if np.linalg.norm(ends[1] - ends[0]) < p.shortest_line:
                return None, "the piece of line is too short"
            return line, ""
        if feature.elevation > lowest:
            return None, "too far away"
        if math.isnan(feature.elevation) and feature.kind in CROSSINGS:
            return None, "a crossing without elevation"
        return PointObservation(feature, self._landmarks.points[feature.kind], camera_position, spreads), ""

    def _false_rate(self, feature: Feature) -> float:
        p = self._parameters
        return p.false_rate_crossing if feature.kind in CROSSINGS else p.false_rate_other

    def _correct(self, observation: Observation, candidate: int) -> bool:
        """Use an observation; False, and no change, if it misses the gate now that others were used."""
        index = np.array([candidate], dtype=np.intp)
        innovations, jacobians, noises = observation.linearize(self._filter.x, index)
        innovation, jacobian, noise = innovations[0], jacobians[0], noises[0]
        distances, _ = distances_and_determinants(innovations, (jacobian @ self._filter.P @ jacobian.T + noise)[None])
        if distances[0] > gate(self._parameters.gate_probability, len(innovation)):
            return False
        # The innovation is formed above (angles wrapped), so the measurement is 0 and its prediction minus that.
        self._filter.update(
            np.zeros(len(innovation)),
            HJacobian=lambda _: jacobian,
            Hx=lambda _: -innovation,
            R=noise,
        )
        self._tidy()
        return True

    def _tidy(self) -> None:
        """Wrap the heading and keep the covariance symmetric against rounding."""
        self._filter.x[2] = wrap_angle(float(self._filter.x[2]))
        self._filter.P = (self._filter.P + self._filter.P.T) / 2.0
