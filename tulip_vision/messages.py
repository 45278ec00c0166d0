"""Messages that the vision node sends and reads."""

from __future__ import annotations

import array

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image

from tulip_description import frames
from tulip_msgs.msg import Feature as FeatureMessage
from tulip_msgs.msg import Features as FeaturesMessage
from tulip_ros.time import header
from tulip_vision.features import Features
from tulip_vision.lens import Lens

CHANNELS = {"bgr8": 3, "rgb8": 3, "mono8": 1}
"""Encodings that can be read, with their bytes a pixel."""


def features_to_message(features: Features) -> FeaturesMessage:
    """Return the features of one picture as a message."""
    message = FeaturesMessage(header=header(features.stamp, frames.BASE_FOOTPRINT))
    message.camera_position = np.asarray(features.camera_position, dtype=np.float64)
    message.view = np.asarray(features.view, dtype=np.float64)
    message.features = [
        FeatureMessage(
            kind=int(feature.kind),
            azimuth=float(feature.azimuth),
            elevation=float(feature.elevation),
            azimuth_spread=float(feature.azimuth_spread),
            elevation_spread=float(feature.elevation_spread),
            confidence=float(feature.confidence),
            end_azimuth=float(feature.end_azimuth),
            end_elevation=float(feature.end_elevation),
            angular_radius=float(feature.angular_radius),
            side=int(feature.side),
        )
        for feature in features.features
    ]
    return message


def picture_from_message(message: Image) -> NDArray[np.uint8]:
    """Return (height, width, 3) BGR.

    Raises:
        ValueError: if the encoding is not one of `CHANNELS`, or the data does not fit the size.
    """
    if message.encoding not in CHANNELS:
        raise ValueError(f"encoding is {message.encoding!r}; expected {', '.join(CHANNELS)}")
    channels = CHANNELS[message.encoding]
    row = channels * message.width
    data = np.frombuffer(message.data, dtype=np.uint8)
    if not row or not message.height or message.step < row or data.size != message.step * message.height:
        raise ValueError(
            f"picture has {data.size} bytes, {message.step} a row;"
            f" expected {message.height} rows of at least {row} bytes, and not none"
        )
    picture = data.reshape(message.height, message.step)[:, :row].reshape(message.height, message.width, channels)
    if message.encoding == "rgb8":
        picture = picture[:, :, ::-1]
    elif message.encoding == "mono8":
        picture = picture.repeat(3, axis=2)
    return np.ascontiguousarray(picture)


def picture_to_message(picture: NDArray[np.uint8], stamp: int) -> Image:
    """Return a picture, (height, width, 3) BGR, as a message of camera_optical_frame."""
    height, width, _ = picture.shape
    message = Image(header=header(stamp, frames.CAMERA_OPTICAL), height=height, width=width, encoding="bgr8")
    message.step = 3 * width
    # Assigning an array('B') costs 0.05 ms; rosidl checks a numpy array element by element for 97 ms.
    data = array.array("B")
    data.frombytes(np.ascontiguousarray(picture).data.cast("B"))
    message.data = data
    return message


def lens_from_message(message: CameraInfo) -> Lens:
    """Return the lens that a camera info describes.

    Raises:
        ValueError: if it describes none, as that of a camera that is not calibrated.
    """
    entries = ("width", "height", "distortion_model", "d", "k")
    return Lens.from_camera_info({name: getattr(message, name) for name in entries})
