"""Camera pictures with the features of the same stamp drawn in."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_mount import load_mount
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.robot import Robot
from tulip_ros import topics
from tulip_view.columns import FEATURES, LINEAR
from tulip_view.recording import Array, Recording, Track
from tulip_view.report.figures import LeftOut, Section, Still
from tulip_view.tables import align
from tulip_vision.annotation import annotate
from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.lines import Lines
from tulip_vision.messages import lens_from_message, picture_from_message
from tulip_vision.view import SpreadParameters, View
from tulip_worldmodel.messages import features_from_message

TITLE = "What the camera saw"
NUMBER = 8
QUALITY = 78  # of the JPEG
NEAR = 0.001  # [s] features of a picture carry its stamp; decimals may differ


def pictures_of(recording: Recording) -> tuple[topics.Topic, Track] | None:
    """Return the topic of pictures that the recording has, and their times: compressed ones, or as they are."""
    found = ((topic, recording.get(topic)) for topic in (topics.CAMERA_COMPRESSED, topics.CAMERA_IMAGE))
    return next(((topic, track) for topic, track in found if track is not None), None)


def stills(recording: Recording, robot: Robot, picture_at: Callable[[topics.Topic, int], Any]) -> Section:
    """Return the section: some pictures, evenly spread over the time, those with a ball or much else preferred.

    Args:
        recording: What was read.
        robot: Carries the camera.
        picture_at: Reads one picture's message.

    Raises:
        LeftOut: if the recording holds no pictures, or no features of them.
    """
    camera, features = pictures_of(recording), recording.get(topics.FEATURES)
    if camera is None or features is None:
        raise LeftOut(TITLE, f"{topics.CAMERA_COMPRESSED.name if camera is None else 'features'} is not recorded")
    topic, pictures = camera
    lens, words = _lens(recording)
    mount = load_mount()
    section = Section("stills", TITLE, [words])
    for index, found in _choose(pictures, features):
        time = float(pictures.times[index])
        picture = _decoded(picture_at(topic, index))
        if picture is None:
            section.words.append(f"The picture of {time:.3f} s cannot be decoded.")
            continue
        seen = ", ".join(_count(features.messages[found]))
        pose = _head(recording, time)
        if pose is None or picture.shape[:2] != (lens.height, lens.width):
            seen += " (not drawn: attitude or lens of this picture is not known)"
        else:
            height, orientation, pan, tilt = pose
            place = camera_in_footprint(robot, height, orientation, pan, tilt, mount)
            view = View(lens, place, SpreadParameters())
            core = features_from_message(features.messages[found])
            picture = annotate(picture, core, view, np.empty((0, 2)), Lines((), None), ())
        encoded, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        if encoded:
            section.stills.append(Still(data.tobytes(), f"{time:.2f} s: {seen or 'nothing'}", time))
    if not section.stills:
        raise LeftOut(TITLE, "no picture has features of the same stamp")
    return section


def _lens(recording: Recording) -> tuple[Lens, str]:
    track = recording.get(topics.CAMERA_INFO)
    if track is not None:
        try:
            return lens_from_message(
                track.messages[-1]
            ), "Features of the same stamp are drawn in, with what vision thinks of their certainty (0 to 1)."
        except ValueError:
            pass
    return head_camera_lens(), (
        "Features of the same stamp are drawn in, through the lens as calibrated here: the recording has none."
    )


def _decoded(message: Any) -> NDArray[np.uint8] | None:
    """Return (height, width, 3) BGR, or None for a picture that cannot be decoded."""
    if isinstance(message, topics.CAMERA_IMAGE.message):
        try:
            return picture_from_message(message)
        except ValueError:
            return None
    data = np.frombuffer(bytes(message.data), np.uint8)
    picture = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    return None if picture is None else picture.astype(np.uint8)


def _choose(pictures: Track, features: Track) -> list[tuple[int, int]]:
    """Return indices of pictures and of their features: the richest of each of NUMBER equal parts of the time."""
    nearest = np.clip(np.searchsorted(features.times, pictures.times - NEAR), 0, len(features) - 1)
    pairs = np.flatnonzero(np.abs(features.times[nearest] - pictures.times) < NEAR)
    chosen = []
    for part in np.array_split(pairs, min(NUMBER, max(len(pairs), 1))):
        if len(part):
            best = max(part, key=lambda index: _worth(features.messages[nearest[index]]))
            chosen.append((int(best), int(nearest[best])))
    return chosen


def _worth(message: Any) -> float:
    kinds = {feature.kind for feature in message.features}
    return len(kinds) + 0.1 * len(message.features) + (3.0 if 0 in kinds else 0.0)


def _count(message: Any) -> list[str]:
    """Return what was seen, in words: ball, 2 goal posts, ..."""
    kinds = [feature.kind for feature in message.features]
    found = []
    for kind, name in FEATURES.items():
        number = kinds.count(kind)
        words = name.replace("_", " ")
        if name.startswith("crossing"):
            words = f"{name[-1].upper()} crossing"
        if number:
            found.append(words if number == 1 else f"{number} {words}s")
    return found


def _head(recording: Recording, time: float) -> tuple[float, Array, float, float] | None:
    """Return height of base_link, its quaternion, pan and tilt at a time, or None where one is not known."""
    odometry, joints = recording.get(topics.ODOMETRY), recording.get(topics.JOINT_STATES)
    if odometry is None or joints is None or not {"head_pan", "head_tilt"} <= set(joints.messages[0].name):
        return None
    index = int(np.clip(np.searchsorted(odometry.times, time), 0, len(odometry) - 1))
    # The nearest of both neighbours: 50 Hz are enough for a drawing.
    if index and time - odometry.times[index - 1] < odometry.times[index] - time:
        index -= 1
    pose = odometry.messages[index].pose.pose
    q = pose.orientation
    angles = []
    for name in ("head_pan", "head_tilt"):
        values = np.array([m.position[list(m.name).index(name)] for m in _around(joints, time).messages])
        angles.append(float(align(_around(joints, time), values, LINEAR, np.array([time]))[0]))
    if any(math.isnan(angle) for angle in angles):
        return None
    return float(pose.position.z), np.array([q.x, q.y, q.z, q.w]), angles[0], angles[1]


def _around(track: Track, time: float) -> Track:
    """Return the few messages round a time."""
    index = int(np.searchsorted(track.times, time))
    part = slice(max(index - 2, 0), index + 2)
    return Track(track.times[part], track.arrivals[part], track.wall[part], track.messages[part])
