"""Camera pictures with the features of the same stamp drawn in."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from tulip_description.camera_mount import load_mount
from tulip_description.robot import Robot
from tulip_ros import topics
from tulip_view.camera_picture import HeadPose, decoded, lens_of, seen, with_features
from tulip_view.columns import LINEAR
from tulip_view.recording import Recording, Track
from tulip_view.report.figures import LeftOut, Section, Still
from tulip_view.tables import align

TITLE = "What the camera saw"
NUMBER = 8
QUALITY = 78  # of the JPEG
WORDS = "Features of the same stamp are drawn in, with what vision thinks of their certainty (0 to 1)."
WORDS_HERE = "Features of the same stamp are drawn in, through the lens as calibrated here: the recording has none."
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
    info = recording.get(topics.CAMERA_INFO)
    lens, recorded = lens_of(info.messages[-1] if info is not None else None)
    mount = load_mount()
    section = Section("stills", TITLE, [WORDS if recorded else WORDS_HERE])
    for index, found in _choose(pictures, features):
        time = float(pictures.times[index])
        picture = decoded(picture_at(topic, index))
        if picture is None:
            section.words.append(f"The picture of {time:.3f} s cannot be decoded.")
            continue
        words = ", ".join(seen(features.messages[found]))
        drawn = with_features(picture, features.messages[found], _head(recording, time), lens, robot, mount)
        if drawn is None:
            words += " (not drawn: attitude or lens of this picture is not known)"
        drawn = picture if drawn is None else drawn
        encoded, data = cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        if encoded:
            section.stills.append(Still(data.tobytes(), f"{time:.2f} s: {words or 'nothing'}", time))
    if not section.stills:
        raise LeftOut(TITLE, "no picture has features of the same stamp")
    return section


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


def _head(recording: Recording, time: float) -> HeadPose | None:
    """Return how the head was at a time, or None where that is not known."""
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
    return HeadPose(float(pose.position.z), np.array([q.x, q.y, q.z, q.w]), angles[0], angles[1])


def _around(track: Track, time: float) -> Track:
    """Return the few messages round a time."""
    index = int(np.searchsorted(track.times, time))
    part = slice(max(index - 2, 0), index + 2)
    return Track(track.times[part], track.arrivals[part], track.wall[part], track.messages[part])
