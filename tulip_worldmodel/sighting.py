"""A sighting of a movable object, in dead-reckoning coordinates, and what the picture should have shown."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_vision.features import Feature, Features
from tulip_worldmodel.direction import HORIZON, directions, meet_plane, rays, wrap

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Observer:
    """Where the camera was when a picture was taken.

    Attributes:
        stamp: Of the picture [ns].
        pose: base_footprint in odom.
        camera_position: (3,) optical centre in base_footprint [m].
    """

    stamp: int
    pose: Pose2D
    camera_position: Array

    def offset(self, position: Array, height: float) -> Array:
        """Return (1, 3) from the optical centre to a point (2,) of odom at a height, in base_footprint axes [m]."""
        camera_x, camera_y, camera_z = self.camera_position.tolist()
        x, y = self.pose.inverse().transform(position)
        return np.array([[x - camera_x, y - camera_y, height - camera_z]])

    def direction(self, position: Array, height: float) -> tuple[Array, Array]:
        """Return the (2,) angles of a point (2,) of odom at a height, and their (2, 2) derivatives by the point."""
        angles, jacobian = directions(self.offset(position, height))
        return angles[0], jacobian[0, :, :2] @ self.pose.rotation().T


class Sighting:
    """One feature of a movable object, with the noise that the filter shall believe."""

    def __init__(
        self, feature: Feature, observer: Observer, height: float, extra_spread: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Prepare a sighting.

        Args:
            feature: Of a ball or an opponent.
            observer: Where the camera was.
            height: Of the point that the feature shows, above the ground [m].
            extra_spread: Added to the feature's spreads: azimuth, elevation [rad].
        """
        self.feature = feature
        self.observer = observer
        self.height = height
        self.has_range = not math.isnan(feature.elevation) and feature.elevation < HORIZON
        rows = 2 if self.has_range else 1
        self._angles = np.array([feature.azimuth, feature.elevation])[:rows]
        self.noise = np.diag(
            [
                feature.azimuth_spread**2 + extra_spread[0] ** 2,
                feature.elevation_spread**2 + extra_spread[1] ** 2,
            ]
        )[:rows, :rows]

    def innovation(self, position: Array) -> tuple[Array, Array]:
        """Return the (m,) innovation of a point of odom and the (m, 2) Jacobian of its angles by the point."""
        angles, jacobian = self.observer.direction(position, self.height)
        rows = len(self._angles)
        return wrap(self._angles - angles[:rows]), jacobian[:rows]

    def position(self) -> tuple[Array, Array]:
        """Return where in odom (2,) the ray meets the object's height, and its (2, 2) covariance [m].

        Raises:
            ValueError: if the elevation is unknown or not below the horizon.
        """
        if not self.has_range:
            raise ValueError("this sighting has no range; expected an elevation below the horizon")
        unit, by_angles = rays(self._angles[None, :])
        point, by_ray = meet_plane(unit, self.observer.camera_position, self.height)
        rotation = self.observer.pose.rotation()
        jacobian = rotation @ by_ray[0] @ by_angles[0]
        return np.array(self.observer.pose.transform(point[0])), jacobian @ self.noise @ jacobian.T


def lasting_spread(spread: float, lasts: float, period: float) -> float:
    """Return what must be added to an error's standard deviation because successive measurements share it.

    An error that dies out with a time constant T, sampled every dt, averages out like white noise whose variance is
    coth(dt / 2T) times larger: a filter that takes it for white must be told that one.

    Args:
        spread: Standard deviation of the error.
        lasts: T [s].
        period: dt [s]; 0 for a first measurement.

    Returns:
        The standard deviation e with spread^2 + e^2 = spread^2 coth(dt / 2T).
    """
    return 0.0 if period <= 0.0 else spread * math.sqrt(1.0 / math.tanh(0.5 * period / lasts) - 1.0)


def in_view(features: Features, angles: Array, margin: float) -> bool:
    """Tell whether a direction lies inside a picture, by at least a margin [rad] from its edges."""
    left, right, lower, upper = (float(edge) for edge in features.view)
    half_width = ((left - right) % (2.0 * math.pi)) / 2.0
    from_middle = wrap_angle(float(angles[0]) - (right + half_width))
    inside = abs(from_middle) < half_width - margin
    return inside and lower + margin < float(angles[1]) < upper - margin
