"""A picture of the head camera, with the features that vision found in it drawn in."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_mount import MountOffsets
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.robot import Robot
from tulip_ros import topics
from tulip_view.columns import FEATURES
from tulip_vision.annotation import annotate
from tulip_vision.coded_picture import decode_picture
from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.lines import Lines
from tulip_vision.messages import lens_from_message, picture_from_message
from tulip_vision.view import SpreadParameters, View
from tulip_worldmodel.messages import features_from_message

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]


class HeadPose(NamedTuple):
    """What the place of the camera follows from.

    Attributes:
        height: Of base_link above the ground [m].
        orientation: (4,) quaternion x, y, z, w of base_link in any level frame.
        pan, tilt: Angles of the head [rad].
    """

    height: float
    orientation: Array
    pan: float
    tilt: float


def lens_of(info: Any | None) -> tuple[Lens, bool]:
    """Return the lens of a CameraInfo message, and whether it is that one and not the one calibrated here."""
    if info is not None:
        try:
            return lens_from_message(info), True
        except ValueError:
            pass
    return head_camera_lens(), False


def decoded(message: Any) -> Picture | None:
    """Return (height, width, 3) BGR of an Image or CompressedImage, or None for one that cannot be decoded."""
    try:
        if isinstance(message, topics.CAMERA_IMAGE.message):
            return picture_from_message(message)
        return decode_picture(bytes(message.data))
    except ValueError:
        return None


def with_features(
    picture: Picture, features: Any, head: HeadPose | None, lens: Lens, robot: Robot, mount: MountOffsets
) -> Picture | None:
    """Return a copy of a picture with features drawn in; None if the lens is another camera's or the head is not known.

    Args:
        picture: (height, width, 3) BGR.
        features: Message with the features of the same stamp.
        head: Of that instant.
        lens: Of the camera.
        robot: Carries the camera.
        mount: How the camera sits on it.
    """
    if head is None or picture.shape[:2] != (lens.height, lens.width):
        return None
    place = camera_in_footprint(robot, head.height, head.orientation, head.pan, head.tilt, mount)
    view = View(lens, place, SpreadParameters())
    return annotate(picture, features_from_message(features), view, np.empty((0, 2)), Lines((), None), ())


def seen(features: Any) -> list[str]:
    """Return what was seen, in words: ball, 2 goal posts, ..."""
    kinds = [feature.kind for feature in features.features]
    found = []
    for kind, name in FEATURES.items():
        number = kinds.count(kind)
        words = name.replace("_", " ")
        if name.startswith("crossing"):
            words = f"{name[-1].upper()} crossing"
        if number:
            found.append(words if number == 1 else f"{number} {words}s")
    return found
