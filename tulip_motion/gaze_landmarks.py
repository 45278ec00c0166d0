"""What a look at the field's landmarks would tell about the robot's pose, and what a look at the ball about the ball.

A landmark is seen under azimuth and elevation, in the axes of base_footprint. Besides its own noise, each picture has
three errors in common: roll and pitch of the camera beyond what its pose says, and an error of all azimuths. They are
estimated along with the pose and then left out (Schur complement), so that many landmarks in one picture are worth no
more than they are: n landmarks average their own noise, not the common error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tulip_description.field import Field
from tulip_description.planar import Pose2D

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sight:
    """How the camera sees.

    Attributes:
        half_width, half_height: Of the picture, less a margin at its edge [rad].
        azimuth_spread, elevation_spread: Of one feature's own angles [rad].
        common_azimuth_spread, tilt_spread: Of what all features of a picture have in common [rad].
        landmark_spread: Of a landmark's place on the field [m].
        found: Share of the landmarks and balls in the picture that vision finds.
    """

    half_width: float
    half_height: float
    azimuth_spread: float
    elevation_spread: float
    common_azimuth_spread: float
    tilt_spread: float
    landmark_spread: float
    found: float


class Landmarks:
    """The places of a field that vision recognizes.

    Attributes:
        places: (n, 2) in map [m].
        reaches: (n,) up to which range each is found [m].
    """

    def __init__(self, field: Field, post: float, pole: float, crossing: float, mark: float) -> None:
        """Gather them, with the ranges up to which each kind is found [m]."""
        kinds = (
            ([(post_.x, post_.y) for post_ in field.goal_posts], post),
            ([(pole_.x, pole_.y) for pole_ in field.poles], pole),
            ([(crossing_.x, crossing_.y) for crossing_ in field.crossings], crossing),
            (list(field.penalty_marks), mark),
        )
        self.places = np.array([place for places, _ in kinds for place in places])
        self.reaches = np.concatenate([np.full(len(places), reach) for places, reach in kinds])


def angles_of(offsets: Array) -> tuple[Array, Array]:
    """Return (n, 2) azimuth and elevation [rad] of (n, 3) offsets [m], and (n, 2, 3) their derivatives [rad/m]."""
    x, y, z = offsets.T
    ground = np.maximum(np.hypot(x, y), 1e-3)
    whole = ground**2 + z**2
    jacobian = np.zeros((len(offsets), 2, 3))
    jacobian[:, 0, 0], jacobian[:, 0, 1] = -y / ground**2, x / ground**2
    jacobian[:, 1, 0], jacobian[:, 1, 1] = -z * x / (ground * whole), -z * y / (ground * whole)
    jacobian[:, 1, 2] = ground / whole
    return np.column_stack((np.arctan2(y, x), np.arctan2(z, ground))), jacobian


def landmark_angles(pose: Array, places: Array, eye: Array) -> tuple[Array, Array]:
    """Return how landmarks appear, and how that depends on pose and camera.

    Args:
        pose: (6,) x, y [m], yaw [rad] of base_footprint in map; small roll and pitch of the camera, and the common
            error of the azimuths [rad].
        places: (n, 2) in map [m].
        eye: (3,) the camera in base_footprint [m].

    Returns:
        (n, 2) azimuth and elevation [rad], and (n, 2, 6) their derivatives by `pose`.
    """
    x, y, yaw, roll, pitch, bias = pose.tolist()
    c, s = math.cos(yaw), math.sin(yaw)
    to_footprint = np.array([[c, s], [-s, c]])
    relative = (places - (x, y)) @ to_footprint.T
    offset = np.column_stack((relative - eye[:2], np.full(len(places), -eye[2])))
    turn = np.array([[1.0, 0.0, pitch], [0.0, 1.0, -roll], [-pitch, roll, 1.0]])
    angles, by_offset = angles_of(offset @ turn.T)
    angles[:, 0] += bias
    offset_by_pose = np.zeros((len(places), 3, 6))
    offset_by_pose[:, :2, :2] = -to_footprint
    offset_by_pose[:, 0, 2], offset_by_pose[:, 1, 2] = relative[:, 1], -relative[:, 0]
    offset_by_pose[:, :, :3] = turn @ offset_by_pose[:, :, :3]
    offset_by_pose[:, 1, 3], offset_by_pose[:, 2, 3] = -offset[:, 2], offset[:, 1]
    offset_by_pose[:, 0, 4], offset_by_pose[:, 2, 4] = offset[:, 2], -offset[:, 0]
    jacobian = by_offset @ offset_by_pose
    jacobian[:, 0, 5] = 1.0
    return angles, jacobian


def chance_in_picture(gazes: Array, angles: Array, spreads: Array, sight: Sight) -> Array:
    """Return how likely each point is in the picture of each gaze.

    Args:
        gazes: (g, 2) pan and tilt (positive looks down) [rad].
        angles: (n, 2), or (g, n, 2) one set a gaze: azimuth and elevation of the points [rad].
        spreads: Of the same shape, standard deviations of these: what is not known of robot and points [rad].
        sight: Of the camera.

    Returns:
        (g, n) from 0 to 1.
    """
    aside = angles[..., 0] - gazes[:, None, 0]
    tilt = gazes[:, None, 1]
    level, up = np.cos(angles[..., 1]), np.sin(angles[..., 1])
    forward = level * np.cos(aside) * np.cos(tilt) - up * np.sin(tilt)
    left = level * np.sin(aside)
    above = level * np.cos(aside) * np.sin(tilt) + up * np.cos(tilt)
    across, along = np.arctan2(left, forward), np.arctan2(above, forward)
    across_spread = np.maximum(spreads[..., 0] * level / np.maximum(np.hypot(left, forward), 0.1), 1e-3)
    along_spread = np.maximum(spreads[..., 1], 1e-3)
    width, height = sight.half_width, sight.half_height
    inside: Array = (ndtr((width - across) / across_spread) - ndtr((-width - across) / across_spread)) * (
        ndtr((height - along) / along_spread) - ndtr((-height - along) / along_spread)
    )
    return np.where(forward > 0.05, inside, 0.0)


def pose_after_look(
    pose: Pose2D, covariance: Array, gazes: Array, landmarks: Landmarks, eye: Array, sight: Sight
) -> Array:
    """Return the pose's covariance that one look along each gaze leaves, to be expected.

    The errors of the camera's pose last as long as a look; all pictures of a look therefore count as one.

    Args:
        pose: base_footprint in map.
        covariance: (3, 3) of x [m], y [m], yaw [rad] in map.
        gazes: (g, 2) pan and tilt [rad].
        landmarks: Of the field.
        eye: (3,) the camera in base_footprint [m].
        sight: Of the camera.

    Returns:
        (g, 3, 3).
    """
    state = np.array([pose.x, pose.y, pose.yaw, 0.0, 0.0, 0.0])
    angles, jacobian = landmark_angles(state, landmarks.places, eye)
    ranges = np.hypot(*(landmarks.places - (pose.x, pose.y)).T)
    spreads = np.sqrt(np.einsum("nij,jk,nik->ni", jacobian[:, :, :3], covariance, jacobian[:, :, :3]))
    fade = np.clip(5.0 * (1.0 - ranges / landmarks.reaches), 0.0, 1.0)  # found less and less on the last fifth
    # The chance of information is worth less than the same share of it for sure: what is more likely outside the
    # picture than inside counts for nothing.
    inside = np.maximum(0.0, 2.0 * chance_in_picture(gazes, angles, spreads, sight) - 1.0)
    chance = inside * (sight.found * fade)
    ground = np.maximum(ranges, 0.1)
    height = float(eye[2])
    noise = np.column_stack(
        (
            sight.azimuth_spread**2 + (sight.landmark_spread / ground) ** 2,
            sight.elevation_spread**2 + (sight.landmark_spread * height / (ground**2 + height**2)) ** 2,
        )
    )
    each = np.einsum("nia,ni,nib->nab", jacobian, 1.0 / noise, jacobian)
    whole = np.einsum("gn,nab->gab", chance, each)
    whole[:, 3, 3] += sight.tilt_spread**-2
    whole[:, 4, 4] += sight.tilt_spread**-2
    whole[:, 5, 5] += sight.common_azimuth_spread**-2
    whole[:, :3, :3] += np.linalg.inv(covariance)
    after: Array = np.linalg.inv(whole)[:, :3, :3]  # the pose's part: the common errors are left out
    return after


def ball_after_look(
    ball: Array, covariance: Array, gazes: Array, radius: float, eye: Array, sight: Sight, reach: float
) -> Array:
    """Return the covariance of the ball's position that one look along each gaze leaves, to be expected.

    Args:
        ball: (g, 2) where it will be at each look, in base_footprint [m].
        covariance: (2, 2) of its place without the look [m^2].
        gazes: (g, 2) pan and tilt [rad].
        radius: Of the ball [m].
        eye: (3,) the camera in base_footprint [m].
        sight: Of the camera.
        reach: Up to which range the ball is found [m].

    Returns:
        (g, 2, 2): the mean over seeing the ball or not, weighed by the chance of it.
    """
    offset = np.column_stack((ball - eye[:2], np.full(len(ball), radius - eye[2])))
    angles, by_offset = angles_of(offset)
    jacobian = by_offset[:, :, :2]
    spreads = np.sqrt(np.einsum("gij,jk,gik->gi", jacobian, covariance, jacobian))
    inside = chance_in_picture(gazes, angles[:, None], spreads[:, None], sight)[:, 0]
    fade = np.clip(5.0 * (1.0 - np.hypot(*ball.T) / reach), 0.0, 1.0)
    chance = (inside * fade * sight.found)[:, None, None]
    noise = np.diag(
        [
            sight.azimuth_spread**2 + sight.common_azimuth_spread**2,
            sight.elevation_spread**2 + sight.tilt_spread**2,
        ]
    )
    gain = covariance @ jacobian.transpose(0, 2, 1)
    gain = gain @ np.linalg.inv(jacobian @ gain + noise)
    seen = covariance - gain @ jacobian @ covariance
    after: Array = chance * seen + (1.0 - chance) * covariance
    return after
