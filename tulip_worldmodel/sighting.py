"""A sighting of a movable object, in dead-reckoning coordinates, and what the picture should have shown."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_vision.features import Feature, Features
from tulip_worldmodel.camera_error import CameraErrorParameters, by_turn, own_spread, turned
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
        angles, jacobian = self.seen(position, height, np.zeros(3))
        return angles, jacobian[:, :2]

    def seen(self, position: Array, height: float, error: Array) -> tuple[Array, Array]:
        """Return under which angles a camera whose pose errs sees a point.

        Args:
            position: (2,) of odom [m].
            height: Above the ground [m].
            error: (3,) of the camera's pose (camera_error.py) [rad].

        Returns:
            (2,) azimuth and elevation, and their (2, 5) derivatives by position and error.
        """
        offset = self.offset(position, height)
        turn = turned(error)
        angles, by_offset = directions(offset @ turn.T)
        jacobian = np.empty((2, 5))
        jacobian[:, :2] = (by_offset[0] @ turn)[:, :2] @ self.pose.rotation().T
        jacobian[:, 2:] = by_offset[0] @ by_turn(offset)[0]
        return angles[0], jacobian


@dataclass(frozen=True)
class Place:
    """Where an object is by one sighting alone, in odom.

    Attributes:
        position: (2,) [m].
        own: (2, 2) covariance from the feature's own noise [m^2].
        by_error: (2, 3) how it changes with the error of the camera's pose [m/rad].
    """

    position: Array
    own: Array
    by_error: Array

    def covariance(self, camera_variances: Array) -> Array:
        """Return the (2, 2) covariance [m^2], given the (3,) variances of the camera pose's error [rad^2]."""
        return np.asarray(self.own + (self.by_error * camera_variances) @ self.by_error.T)


class Sighting:
    """One feature of a movable object, with the noise that the filter shall believe.

    Attributes:
        feature: As vision gave it.
        observer: Where the camera was.
        height: Of the point seen [m].
        has_range: Whether its elevation tells the range.
        noise: (m, m) of its own angles, without the error of the camera's pose [rad^2].
    """

    def __init__(
        self,
        feature: Feature,
        observer: Observer,
        height: float,
        camera: CameraErrorParameters,
        extra_spread: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Prepare a sighting.

        Args:
            feature: Of a ball or an opponent.
            observer: Where the camera was.
            height: Of the point that the feature shows, above the ground [m].
            camera: How far its pose may be off.
            extra_spread: Added to the feature's spreads: azimuth, elevation [rad].
        """
        own = own_spread(feature, camera)
        self.feature = feature
        self.observer = observer
        self.height = height
        self.has_range = not math.isnan(feature.elevation) and feature.elevation < HORIZON
        rows = 2 if self.has_range else 1
        self._angles = np.array([feature.azimuth, feature.elevation])[:rows]
        self.noise = np.diag(
            [own.azimuth_spread**2 + extra_spread[0] ** 2, own.elevation_spread**2 + extra_spread[1] ** 2]
        )[:rows, :rows]

    def innovation(self, position: Array, error: Array) -> tuple[Array, Array]:
        """Return the (m,) innovation of a point of odom, and the (m, 5) Jacobian of its angles.

        Args:
            position: (2,) of odom [m].
            error: (3,) of the camera's pose [rad].
        """
        angles, jacobian = self.observer.seen(position, self.height, error)
        rows = len(self._angles)
        return wrap(self._angles - angles[:rows]), jacobian[:rows]

    def place(self) -> Place:
        """Return where in odom the ray meets the object's height.

        Raises:
            ValueError: if the elevation is unknown or not below the horizon.
        """
        if not self.has_range:
            raise ValueError("this sighting has no range; expected an elevation below the horizon")
        unit, by_angles = rays(self._angles[None, :])
        point, by_ray = meet_plane(unit, self.observer.camera_position, self.height)
        rotation = self.observer.pose.rotation()
        jacobian = rotation @ by_ray[0] @ by_angles[0]
        by_error = rotation @ by_ray[0] @ -by_turn(unit)[0]  # the ray is turned back by the error
        return Place(np.array(self.observer.pose.transform(point[0])), jacobian @ self.noise @ jacobian.T, by_error)


def in_view(features: Features, angles: Array, margin: float) -> bool:
    """Tell whether a direction lies inside a picture, by at least a margin [rad] from its edges."""
    left, right, lower, upper = (float(edge) for edge in features.view)
    half_width = ((left - right) % (2.0 * math.pi)) / 2.0
    from_middle = wrap_angle(float(angles[0]) - (right + half_width))
    inside = abs(from_middle) < half_width - margin
    return inside and lower + margin < float(angles[1]) < upper - margin
