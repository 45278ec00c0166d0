"""Vision, computed anew from recorded pictures, dead reckoning and head angles."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from functools import partial
from typing import Any

from tulip_description.camera_mount import load_mount
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.robot import HEAD_JOINTS, load_robot
from tulip_ros import topics
from tulip_ros.time import stamp_of
from tulip_sim.recompute.decoding import decoded
from tulip_sim.recompute.heard import OVERDUE, UNIX_TIME, Heard, Made
from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.messages import features_to_message, lens_from_message
from tulip_vision.own_body import OwnBody
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.pose_buffer import MissingPose, PoseBuffer, PoseBufferParameters

FEATURES = topics.FEATURES.name
ODOMETRY, JOINTS = topics.ODOMETRY.name, topics.JOINT_STATES.name
LENS = topics.CAMERA_INFO.name


class VisionStage:
    """Node vision.

    Features do not depend on the order in which a picture and the readings of its camera's pose came, since a picture
    waits for the readings around it. Recorded features tell when they were sent, and which pictures were used: a node
    that is too slow leaves some out.
    """

    writes = frozenset((FEATURES,))
    told_by = frozenset((FEATURES,))

    def __init__(self, parameters: VisionParameters, pictures: str) -> None:
        """Make vision with the head camera's own lens; a recorded one replaces it.

        Args:
            parameters: Of the core.
            pictures: Name of the topic with the pictures.
        """
        self.pictures = pictures
        self.reads = frozenset((ODOMETRY, JOINTS, LENS, pictures))
        self._parameters = parameters
        self._robot = load_robot()
        self._own_body = OwnBody(self._robot)
        self._vision = self._make(head_camera_lens())
        self._vision.rehearse()
        self._poses = PoseBuffer(PoseBufferParameters(), partial(camera_in_footprint, self._robot, mount=load_mount()))
        self._pictures: deque[Heard] = deque()
        self._joints: Heard | None = None
        self._asked: deque[Heard] = deque()
        self._counts: Counter[str] = Counter()

    def hear(self, heard: Heard | Made) -> Iterator[Made]:
        """Take a reading or a picture."""
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
        """Send the features whose readings never came."""
        yield from self._process(None)

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
        """Answer the recorded features whose picture and pose are here.

        Args:
            now: Log time [ns], by which some may have waited too long; None at the end.
        """
        while self._asked:
            asked = self._asked[0]
            while self._pictures and self._pictures[0].stamp < asked.stamp:
                self._pictures.popleft()
                self._counts["pictures that the run's vision left out, and this one too"] += 1
            waited = now is None or now - asked.log_time >= OVERDUE
            if not self._pictures or self._pictures[0].stamp > asked.stamp:
                if not (self._pictures or waited):
                    return
                # A recorder keeps every second picture unless told otherwise; who hears vision needs all features.
                self._counts["features taken over as they were recorded, since their picture was not"] += 1
                self._asked.popleft()
                yield Made(FEATURES, asked.log_time, asked.stamp, asked.message)
                continue
            pose = self._poses.camera_in_footprint(asked.stamp)
            if isinstance(pose, MissingPose) and pose.may_come and not waited:
                return
            self._asked.popleft()
            picture = self._pictures.popleft()
            if isinstance(pose, MissingPose):
                self._counts["features whose camera pose is not recorded"] += 1
                continue
            try:
                features = self._vision.process(decoded(picture), asked.stamp, pose)
            except ValueError:
                self._counts["unusable pictures"] += 1
                continue
            yield Made(FEATURES, asked.log_time, asked.stamp, features_to_message(features))
