"""An extended Kalman filter for a point that moves on the ground, seen under two angles.

State, (7,): position [m] and velocity [m/s] in odom, and the error of the camera's pose [rad] (camera_error.py).
With it, successive pictures tell precisely how the point moves, and still not where it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray

from tulip_description.positive import check_positive
from tulip_worldmodel.camera_error import CameraErrorParameters
from tulip_worldmodel.mahalanobis import diagonal, distances_and_determinants
from tulip_worldmodel.rolling import Slowing
from tulip_worldmodel.sighting import Place, Sighting

Array = NDArray[np.float64]

STATES = 7
UNITY = np.eye(2)
SEEN = np.ix_((0, 1, 4, 5, 6), (0, 1, 4, 5, 6))  # what an angle depends on


def check_tracking(parameters: Any) -> None:
    """Check the parameters of a filter that tracks a moving point: all positive, shares and confidences below one.

    Args:
        parameters: Object of a dataclass of numbers.

    Raises:
        ValueError: if one is out of range.
    """
    check_positive(parameters)
    for name in ("gate_probability", "confidence_gain", "confirmed", "forgotten"):
        if getattr(parameters, name) >= 1.0:
            raise ValueError(f"{name} is {getattr(parameters, name)}; expected < 1")


@dataclass(frozen=True)
class PointEstimate:
    """What is known of a moving point.

    Attributes:
        state: (4,) position [m] and velocity [m/s] in odom.
        covariance: (4, 4) of the state.
    """

    state: Array
    covariance: Array


@dataclass(frozen=True)
class PointMotion:
    """How a point moves on.

    Attributes:
        duration: [s].
        slowing: What becomes of the velocity; the mean of before and after acts on the position.
        position_noise: (2, 2) covariance added to the position [m^2].
        velocity_variance: Variance added to each component of the velocity [m^2/s^2].
    """

    duration: float
    slowing: Slowing
    position_noise: Array
    velocity_variance: float


class MovingPoint:
    """Position and velocity of one object in odom."""

    def __init__(
        self,
        place: Place,
        velocity: Array,
        velocity_covariance: Array,
        camera: CameraErrorParameters,
    ) -> None:
        """Begin.

        Args:
            place: By a first sighting.
            velocity: (2,) [m/s].
            velocity_covariance: (2, 2).
            camera: How far its pose may be off.
        """
        self._camera = camera
        self._filter = ExtendedKalmanFilter(dim_x=STATES, dim_z=2)
        self._filter.x = np.concatenate((place.position, velocity, np.zeros(3)))
        self._filter.P = np.zeros((STATES, STATES))
        self._filter.P[:2, :2] = place.covariance(camera.variances)
        self._filter.P[2:4, 2:4] = velocity_covariance
        self._filter.P[4:, 4:] = np.diag(camera.variances)
        self._filter.P[:2, 4:] = place.by_error * camera.variances
        self._filter.P[4:, :2] = self._filter.P[:2, 4:].T
        self._tidy()

    @property
    def state(self) -> Array:
        """(4,) position [m] and velocity [m/s] in odom."""
        return np.array(self._filter.x[:4])

    @property
    def covariance(self) -> Array:
        """(4, 4) of position and velocity."""
        return np.array(self._filter.P[:4, :4])

    def predict(self, motion: PointMotion) -> None:
        """Move on."""
        self._filter.x, self._filter.P = self._moved(motion)

    def predicted(self, motion: PointMotion) -> PointEstimate:
        """Return what `predict` leads to, without changing the filter."""
        state, covariance = self._moved(motion)
        return PointEstimate(state[:4], covariance[:4, :4])

    def _moved(self, motion: PointMotion) -> tuple[Array, Array]:
        left, anew = self._camera.fading(motion.duration)
        transition, noise = diagonal((left,) * STATES), diagonal((0.0, 0.0, 0.0, 0.0, *anew.tolist()))
        transition[:4, :4], offset, noise[:4, :4] = _transition(motion)
        state = transition @ self._filter.x
        state[:4] += offset
        covariance = transition @ self._filter.P @ transition.T + noise
        return state, (covariance + covariance.T) / 2.0

    def distance(self, sighting: Sighting) -> float:
        """Return the squared Mahalanobis distance of a sighting."""
        innovation, jacobian = sighting.innovation(self._filter.x[:2], self._filter.x[4:])
        spread = jacobian @ self._filter.P[SEEN] @ jacobian.T + sighting.noise
        return float(distances_and_determinants(innovation[None], spread[None])[0][0])

    def correct(self, innovation: Array, jacobian: Array, noise: Array) -> None:
        """Apply a measurement: (m,) innovation, (m, 5) Jacobian by position and camera error, (m, m) noise."""
        whole = np.zeros((len(innovation), STATES))
        whole[:, (0, 1, 4, 5, 6)] = jacobian
        # The innovation comes with its angles wrapped: the measurement is 0 and its prediction minus that.
        self._filter.update(np.zeros(len(innovation)), HJacobian=lambda _: whole, Hx=lambda _: -innovation, R=noise)
        self._tidy()

    def see(self, sighting: Sighting) -> None:
        """Apply a sighting."""
        self.correct(*sighting.innovation(self._filter.x[:2], self._filter.x[4:]), sighting.noise)

    def _tidy(self) -> None:
        self._filter.P = (self._filter.P + self._filter.P.T) / 2.0


def _transition(motion: PointMotion) -> tuple[Array, Array, Array]:
    """Return the (4, 4) transition of the state, what is added to it (4,), and the (4, 4) covariance added."""
    duration, slowing, variance = motion.duration, motion.slowing, motion.velocity_variance
    transition = diagonal((1.0, 1.0, 1.0, 1.0))
    transition[:2, 2:] = 0.5 * duration * (UNITY + slowing.keep)
    transition[2:, 2:] = slowing.keep
    offset = np.concatenate((0.5 * duration * slowing.drop, slowing.drop))
    # Velocity as a random walk: its integral moves the position too.
    noise = np.empty((4, 4))
    noise[:2, :2] = 0.25 * duration**2 * slowing.noise + (variance * duration**2 / 3.0) * UNITY + motion.position_noise
    noise[:2, 2:] = noise[2:, :2] = 0.5 * duration * slowing.noise + (variance * duration / 2.0) * UNITY
    noise[2:, 2:] = slowing.noise + variance * UNITY
    return transition, offset, noise


def position_noise(offset: tuple[float, float], everywhere: float, across: float) -> Array:
    """Return the (2, 2) covariance [m^2] by which dead reckoning of the observer makes a place less sure.

    Args:
        offset: From the observer to the point [m].
        everywhere: Variance in all directions [m^2].
        across: Variance of the observer's heading [rad^2], which acts across the offset.
    """
    x, y = offset
    both = -across * x * y
    return np.array([[everywhere + across * y**2, both], [both, everywhere + across * x**2]])
