"""The error of the camera's pose: what all features of a picture, and of the next ones, have in common.

Kinematics and IMU say how the camera looks; a small rotation w about the x, y and z axes of base_footprint is missing.
An observed ray is the true offset o turned by it: o' = o + w x o. It dies out with a time constant, as
w' = -w / T + noise, with a standard deviation that stays the same. Averaging does not get rid of it as of a feature's
own noise, so every filter that sees through the camera has w in its state.

How large it is, vision states (`SpreadParameters`): it puts it into the spreads of its features, as each of them errs
by it. Here it is taken out again, so that nothing is counted twice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tulip_description.positive import check_positive
from tulip_vision.features import Feature
from tulip_vision.view import SpreadParameters

Array = NDArray[np.float64]

LEAST_SPREAD = math.radians(0.03)  # [rad] of a feature's own direction: a third of a pixel


@dataclass(frozen=True)
class CameraErrorParameters:
    """How far the camera's pose may be off. The spreads are vision's numbers, stated there."""

    pose_azimuth_spread: float = SpreadParameters.pose_azimuth  # [rad] heading
    pose_elevation_spread: float = SpreadParameters.pose_elevation  # [rad] roll and pitch
    pose_error_time: float = 5.0  # [s] how long an error lasts: mount and IMU always, the gait's a step, turns of the
    # head in between. Too short, and errors that stay are averaged away in belief only.

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        check_positive(self)

    @property
    def variances(self) -> Array:
        """(3,) of the rotation about x, y and z [rad^2]."""
        return np.square([self.pose_elevation_spread, self.pose_elevation_spread, self.pose_azimuth_spread])

    def fading(self, duration: float) -> tuple[float, Array]:
        """Return which share of an error is left after a time [s], and the (3,) variances that come anew [rad^2]."""
        left = math.exp(-duration / self.pose_error_time)
        return left, self.variances * (1.0 - left**2)


def own_spread(feature: Feature, camera: CameraErrorParameters, scale: float = 1.0) -> Feature:
    """Return a feature with the spread that it does not share with all others of its picture.

    What is taken out is what `View.spreads` puts in. A roll about the line of sight moves the azimuth of what lies
    below the horizon.

    Args:
        feature: As vision gives it.
        camera: How far its pose may be off.
        scale: How many times worse vision is than it says (noise_scale.py).
    """
    azimuth = feature.azimuth_spread**2 - camera.pose_azimuth_spread**2
    elevation = feature.elevation_spread**2
    if not math.isnan(feature.elevation):
        azimuth -= (camera.pose_elevation_spread * math.tan(feature.elevation)) ** 2
        elevation = max(elevation - camera.pose_elevation_spread**2, LEAST_SPREAD**2)
    azimuth = max(azimuth, LEAST_SPREAD**2)
    return replace(feature, azimuth_spread=scale * math.sqrt(azimuth), elevation_spread=scale * math.sqrt(elevation))


def turned(rotation: Array) -> Array:
    """Return (3, 3) that turns by a small rotation vector (3,): v + w x v."""
    roll, pitch, turn = rotation.tolist()
    return np.array([[1.0, -turn, pitch], [turn, 1.0, -roll], [-pitch, roll, 1.0]])


def by_turn(vectors: Array) -> Array:
    """Return (n, 3, 3) the derivative of w x v by w, for (n, 3) vectors v."""
    jacobian = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    jacobian[:, 0, 1], jacobian[:, 0, 2] = z, -y
    jacobian[:, 1, 0], jacobian[:, 1, 2] = -z, x
    jacobian[:, 2, 0], jacobian[:, 2, 1] = y, -x
    return jacobian
