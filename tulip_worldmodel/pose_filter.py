"""One hypothesis of where the robot is: an extended Kalman filter over dead reckoning and landmarks.

State (landmark_geometry.py): x, y [m], yaw [rad] of base_footprint in map, the error of the camera's pose as a small
rotation [rad], and the drift of the heading [rad/s]. A swaying trunk misjudged by half a degree moves every far feature
by decimetres in the same direction: the camera's error carries that (camera_error.py). The drift is the IMU's bias.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_vision.features import Feature, FeatureClass
from tulip_worldmodel.camera_error import CameraErrorParameters
from tulip_worldmodel.landmark_association import Observation, associate
from tulip_worldmodel.landmark_geometry import ERROR, STATES
from tulip_worldmodel.landmarks import CROSSINGS
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.lost import LostDetector
from tulip_worldmodel.mahalanobis import diagonal, distances_and_determinants, gate
from tulip_worldmodel.odometry_history import Increment

Array = NDArray[np.float64]

LINE_CLUTTER = 1.0 / (math.pi * 4.0)  # false pieces of line: any direction, within some 4 m across


@dataclass(frozen=True)
class Outcome:
    """What one picture did to a hypothesis.

    Attributes:
        rejected: Indices of the observations that were not used, with the reason.
        explained: How many were used.
        log_likelihood: Of the picture's features, given the hypothesis, by its best association.
        nearest: See `Association`.
    """

    rejected: tuple[tuple[int, str], ...]
    explained: int
    log_likelihood: float
    nearest: tuple[tuple[float, int], ...]


class PoseFilter:
    """Pose of base_footprint in map, with its covariance."""

    def __init__(
        self,
        parameters: LocalizationParameters,
        camera: CameraErrorParameters,
        pose: Pose2D,
        spreads: tuple[float, float, float],
    ) -> None:
        """Begin at a place.

        Args:
            parameters: See `LocalizationParameters`.
            camera: How far its pose may be off.
            pose: base_footprint in map.
            spreads: Its standard deviations in x, y [m], yaw [rad].
        """
        p = self._parameters = parameters
        self.detector = LostDetector(parameters)
        self.pictures = 0
        """In which landmarks were found."""
        self.side = 0.0
        """Nats by which poles speak for this side of the field and against the other (side.py)."""
        self._unexplained_time = 0.0  # [s] with features of which none could be used
        self._camera = camera
        self._filter = ExtendedKalmanFilter(dim_x=STATES, dim_z=2)
        self._filter.x = np.array([pose.x, pose.y, pose.yaw, 0.0, 0.0, 0.0, 0.0])
        self._filter.P = np.diag([*np.square(spreads), *camera.variances, p.drift_spread**2])
        self._filter.B = np.eye(STATES)

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
    def camera_error(self) -> Array:
        """(3,) estimated rotation about x, y, z of base_footprint by which the camera's pose errs [rad]."""
        return np.array(self._filter.x[ERROR])

    def predict(self, moved: Increment, scale: float = 1.0) -> None:
        """Move with dead reckoning; the camera's pose errs by so many times what vision says (noise_scale.py)."""
        state, transition, noise = self._motion(moved, scale)
        self._filter.F = transition
        self._filter.Q = noise
        self._filter.predict(u=state - transition @ self._filter.x)  # so that F x + B u is the exact motion
        self._tidy()

    def predicted(self, moved: Increment) -> tuple[Pose2D, Array]:
        """Return pose and (3, 3) covariance after a movement, without changing the filter."""
        state, transition, noise = self._motion(moved, 1.0)
        covariance = (transition @ self._filter.P @ transition.T + noise)[:3, :3]
        pose = Pose2D(float(state[0]), float(state[1]), wrap_angle(float(state[2])))
        return pose, np.asarray((covariance + covariance.T) / 2.0)

    def update(self, observations: Sequence[Observation], since_last: float) -> Outcome:
        """Correct the pose with one picture, taken where the robot is now predicted to be.

        Args:
            observations: What the picture shows of landmarks.
            since_last: Time since the last picture [s].
        """
        association = associate(
            self._filter.x,
            self._filter.P,
            observations,
            [self.false_rate(observation.feature) for observation in observations],
            [LINE_CLUTTER if observation.feature.kind is FeatureClass.LINE else 1.0 for observation in observations],
            self._parameters.gate_probability,
            self._parameters.association_odds,
        )
        rejected: list[tuple[int, str]] = []
        explained = unexplained = 0
        for choice in association.choices:
            observation = observations[choice.observation]
            if choice.candidate is None:
                unexplained += not choice.ambiguous
                rejected.append((choice.observation, choice.reason))
            elif self._correct(observation, choice.candidate):
                explained += 1
            else:
                unexplained += 1
                rejected.append((choice.observation, "outside the gate after the others"))
        self.detector.add(explained, unexplained)
        self.pictures += explained > 0
        self._unexplained_time = 0.0 if explained else self._unexplained_time + (since_last if observations else 0.0)
        return Outcome(tuple(rejected), explained, association.log_likelihood, association.nearest)

    def absorb(self, other: PoseFilter, share: float) -> None:
        """Become the Gaussian with the first two moments of a mixture of this hypothesis and another.

        Args:
            other: The other hypothesis.
            share: Its weight, 0 to 1; that of this one is the rest.
        """
        off = other._filter.x - self._filter.x
        off[2] = wrap_angle(float(off[2]))
        self._filter.x = self._filter.x + share * off
        spread = share * (1.0 - share) * np.outer(off, off)
        self._filter.P = (1.0 - share) * self._filter.P + share * other._filter.P + spread
        self._tidy()

    def _motion(self, moved: Increment, scale: float) -> tuple[Array, Array, Array]:
        """Return the state after a movement, its Jacobian and the noise added."""
        p = self._parameters
        x, y, yaw, roll, pitch, turn, drift = self._filter.x.tolist()
        c, s = math.cos(yaw), math.sin(yaw)
        step_x, step_y = c * moved.pose.x - s * moved.pose.y, s * moved.pose.x + c * moved.pose.y
        fade, anew = self._camera.fading(moved.duration)
        keep = math.exp(-moved.duration / p.drift_time)
        turned = yaw + moved.pose.yaw + drift * moved.duration
        error = (roll * fade, pitch * fade, turn * fade)
        state = np.array([x + step_x, y + step_y, wrap_angle(turned), *error, drift * keep])
        transition = diagonal((1.0, 1.0, 1.0, fade, fade, fade, keep))
        transition[0, 2], transition[1, 2] = -step_y, step_x
        transition[2, 6] = moved.duration
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
        if self._unexplained_time > p.lost_time or self.detector.lost:
            position += p.lost_position_noise**2 * moved.duration
            heading += p.lost_heading_noise**2 * moved.duration
        wander = p.drift_spread**2 * (1.0 - keep**2)
        noise = diagonal((position, position, heading, *(scale**2 * anew).tolist(), wander))
        if moved.slip is not None:
            to_map = np.array([[c, -s], [s, c]])
            noise[:2, :2] += to_map @ moved.slip @ to_map.T
        return state, transition, noise

    def turn_round(self) -> None:
        """Become the hypothesis that the robot is at the mirror image: turned by pi about the field's centre."""
        x, y, yaw = self._filter.x[:3]
        self._filter.x[:3] = -x, -y, wrap_angle(float(yaw) + math.pi)
        turn = np.diag([-1.0, -1.0, *np.ones(STATES - 2)])
        self._filter.P = turn @ self._filter.P @ turn
        self.side = -self.side

    def distance(self, observation: Observation) -> float:
        """Return the squared Mahalanobis distance of an observation to its nearest candidate, infinite without one."""
        possible = observation.possible(self._filter.x)
        if not len(possible):
            return math.inf
        innovations, jacobians, noises = observation.linearize(self._filter.x, possible)
        spreads = jacobians @ self._filter.P @ jacobians.transpose(0, 2, 1) + noises
        return float(distances_and_determinants(innovations, spreads)[0].min())

    def false_rate(self, feature: Feature) -> float:
        """Return the share of such features that show no landmark."""
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
