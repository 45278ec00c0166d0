"""Vision, computed anew from recorded pictures, dead reckoning and head angles."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_mount import load_mount
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.robot import HEAD_JOINTS, load_robot
from tulip_ros import topics
from tulip_ros.time import stamp_of
from tulip_sim.recompute.heard import OVERDUE, UNIX_TIME, Heard, Made
from tulip_vision.features import Features
from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.messages import features_to_message, lens_from_message, picture_from_message
from tulip_vision.own_body import OwnBody
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.pose_buffer import MissingPose, PoseBuffer, PoseBufferParameters

FEATURES = topics.FEATURES.name
ODOMETRY, JOINTS = topics.ODOMETRY.name, topics.JOINT_STATES.name
RAW, COMPRESSED, LENS = topics.CAMERA_IMAGE.name, topics.CAMERA_COMPRESSED.name, topics.CAMERA_INFO.name


class VisionStage:
    """Node vision.

    Features do not depend on the order in which a picture and the readings of its camera's pose came, since a picture
    waits for the readings around it. So recorded features tell only when they were sent.
    """

    writes = frozenset((FEATURES,))
    told_by = frozenset((FEATURES,))

    def __init__(self, parameters: VisionParameters, pictures: str) -> None:
        """Make vision with the head camera's own lens; a recorded one replaces it.

        Args:
            parameters: Of the core.
            pictures: Name of the topic with the pictures.
        """
        self.reads = frozenset((ODOMETRY, JOINTS, LENS, pictures))
        self._parameters = parameters
        self._robot = load_robot()
        self._own_body = OwnBody(self._robot)
        self._vision = self._make(head_camera_lens())
        self._vision.rehearse()
        self._poses = PoseBuffer(PoseBufferParameters(), partial(camera_in_footprint, self._robot, mount=load_mount()))
        self._pictures: deque[Heard] = deque()
        self._joints: Heard | None = None
        self._found: dict[int, Features] = {}
        self._asked: deque[Heard] = deque()
        self._counts: Counter[str] = Counter()
        self._delay = 0  # [ns] of log time from a picture to its features, as recorded last

    def hear(self, heard: Heard | Made) -> Iterator[Made]:
        """Take a reading or a picture; process the pictures whose pose is known."""
        message = heard.message if heard.name in (ODOMETRY, LENS) else None
        if heard.name == ODOMETRY:
            self._add_body(heard, message)
        elif heard.name == LENS:
            lens = lens_from_message(message)
            if lens.to_camera_info() != self._vision.lens.to_camera_info():
                self._vision = self._make(lens)
        elif isinstance(heard, Heard):
            if heard.name != JOINTS:
                self._pictures.append(heard)
            elif heard.log_time < UNIX_TIME:
                self._joints = heard  # lockstep keeps head angles at the odometry's instants alone
            else:
                self._add_head(heard)
        yield from self._process(heard.log_time)

    def answer(self, recorded: Heard) -> Iterator[Made]:
        """Send the features of a picture at the time when they were sent."""
        self._asked.append(recorded)
        yield from self._process(recorded.log_time)

    def finish(self) -> Iterator[Made]:
        """Send what is left."""
        yield from self._process(None)
        for stamp in sorted(self._found):
            yield from self._send(stamp, stamp + self._delay)

    def shortcomings(self) -> dict[str, int]:
        """Return what could not be computed, by reason."""
        return dict(self._counts)

    def _make(self, lens: Lens) -> Vision:
        lens.ray_table()
        return Vision(self._parameters, lens, self._own_body)

    def _add_body(self, heard: Heard | Made, message: Any) -> None:
        turn, stamp = message.pose.pose.orientation, stamp_of(message)
        self._poses.add_body(stamp, message.pose.pose.position.z, (turn.x, turn.y, turn.z, turn.w))
        if self._joints is not None and self._joints.stamp == stamp:
            self._add_head(self._joints)

    def _add_head(self, heard: Heard) -> None:
        angles = dict(zip(heard.message.name, heard.message.position, strict=False))
        if all(name in angles for name in HEAD_JOINTS):
            self._poses.add_head(stamp_of(heard.message), *(float(angles[name]) for name in HEAD_JOINTS))

    def _process(self, now: int | None) -> Iterator[Made]:
        while self._pictures:
            heard = self._pictures[0]
            pose = self._poses.camera_in_footprint(heard.stamp)
            if isinstance(pose, MissingPose):
                if pose.may_come and now is not None and now - heard.log_time < OVERDUE:
                    break
                self._counts["pictures without a camera pose"] += 1
            elif pose[2, 3] > 0.0:  # a fallen robot's belief puts the camera below the ground: nothing to see
                try:
                    picture = decoded(heard)
                    self._found[heard.stamp] = self._vision.process(picture, heard.stamp, pose)
                except ValueError:
                    self._counts["unusable pictures"] += 1
            self._pictures.popleft()
        while self._asked:
            asked = self._asked[0]
            if asked.stamp not in self._found:
                if now is not None and now - asked.log_time < OVERDUE:
                    return
                self._counts["features whose picture is not recorded"] += 1
            self._asked.popleft()
            self._delay = max(0, asked.log_time - asked.stamp) if asked.log_time < UNIX_TIME else 0
            yield from self._send(asked.stamp, asked.log_time)
            for stamp in [each for each in self._found if each < asked.stamp - OVERDUE]:
                yield from self._send(stamp, asked.log_time)  # the run had no features of that picture

    def _send(self, stamp: int, log_time: int) -> Iterator[Made]:
        features = self._found.pop(stamp, None)
        if features is not None:
            yield Made(FEATURES, log_time, stamp, features_to_message(features))


def decoded(heard: Heard) -> NDArray[np.uint8]:
    """Return the (height, width, 3) BGR picture of a recorded message, compressed or not.

    Raises:
        ValueError: if it is none.
    """
    if heard.name == RAW:
        return picture_from_message(heard.message)
    picture = cv2.imdecode(np.frombuffer(heard.message.data, np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise ValueError(f"data of format {heard.message.format!r} is no picture; expected JPEG or PNG")
    return np.asarray(picture, np.uint8)
