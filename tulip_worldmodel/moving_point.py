"""An extended Kalman filter for a point that moves on the ground, seen under two angles.

State: position [m] and velocity [m/s] in odom, (4,).
"""

from __future__ import annotations

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray

from tulip_worldmodel.sighting import Sighting

Array = NDArray[np.float64]


class MovingPoint:
    """Position and velocity of one object in odom."""

    def __init__(
        self, position: Array, position_covariance: Array, velocity: Array, velocity_covariance: Array
    ) -> None:
        """Begin with (2,) position [m] and velocity [m/s] and their (2, 2) covariances."""
        self._filter = ExtendedKalmanFilter(dim_x=4, dim_z=2)
        self._filter.x = np.concatenate((position, velocity))
        self._filter.P = np.zeros((4, 4))
        self._filter.P[:2, :2] = position_covariance
        self._filter.P[2:, 2:] = velocity_covariance

    @property
    def state(self) -> Array:
        """(4,) position [m] and velocity [m/s] in odom."""
        return np.array(self._filter.x)

    @property
    def covariance(self) -> Array:
        """(4, 4) of the state."""
        return np.array(self._filter.P)

    def predict(self, duration: float, keep: float, position_noise: Array, velocity_variance: float) -> None:
        """Move on.

        Args:
            duration: [s].
            keep: Share of the velocity that is left afterwards, 0 to 1; its mean acts on the position.
            position_noise: (2, 2) covariance added to the position [m^2].
            velocity_variance: Variance added to each component of the velocity [m^2/s^2].
        """
        transition = np.eye(4)
        transition[0, 2] = transition[1, 3] = duration * (1.0 + keep) / 2.0
        transition[2, 2] = transition[3, 3] = keep
        noise = np.zeros((4, 4))
        for axis in (0, 1):  # velocity as a random walk: its integral moves the position too
            noise[axis, axis] = velocity_variance * duration**2 / 3.0
            noise[axis, axis + 2] = noise[axis + 2, axis] = velocity_variance * duration / 2.0
            noise[axis + 2, axis + 2] = velocity_variance
        noise[:2, :2] += position_noise
        self._filter.F = transition
        self._filter.Q = noise
        self._filter.predict()
        self._tidy()

    def distance(self, sighting: Sighting) -> float:
        """Return the squared Mahalanobis distance of a sighting."""
        innovation, jacobian = sighting.innovation(self._filter.x[:2])
        spread = jacobian @ self._filter.P[:2, :2] @ jacobian.T + sighting.noise
        return float(innovation @ np.linalg.solve(spread, innovation))

    def correct(self, innovation: Array, jacobian: Array, noise: Array) -> None:
        """Apply a measurement of the position: (m,) innovation, (m, 2) Jacobian, (m, m) noise."""
        whole = np.zeros((len(innovation), 4))
        whole[:, :2] = jacobian
        # The innovation comes with its angles wrapped: the measurement is 0 and its prediction minus that.
        self._filter.update(np.zeros(len(innovation)), HJacobian=lambda _: whole, Hx=lambda _: -innovation, R=noise)
        self._tidy()

    def see(self, sighting: Sighting) -> None:
        """Apply a sighting."""
        self.correct(*sighting.innovation(self._filter.x[:2]), sighting.noise)

    def _tidy(self) -> None:
        self._filter.P = (self._filter.P + self._filter.P.T) / 2.0
