"""Node "vision": pictures, lens, odometry and head angles in, features out."""

from __future__ import annotations

from collections import deque
from functools import partial

import cv2
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image, JointState

from tulip_description.camera_mount import MountFileError, load_mount
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.robot import HEAD_JOINTS, load_robot
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of
from tulip_vision.lens import head_camera_lens
from tulip_vision.messages import features_to_message, lens_from_message, picture_from_message, picture_to_message
from tulip_vision.own_body import OwnBody
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.pose_buffer import MissingPose, PoseBuffer, PoseBufferParameters

WAITING = 3  # pictures that wait for their pose: 0.2 s at 15 Hz; then something is wrong with the poses

JOINT_STATES_WAITING, ODOMETRY_WAITING = 250, 50
"""1 s, as long as readings are kept: one that is lost while a picture is processed makes the next pose less exact, and
a recording does not tell which were."""


class VisionNode(ComponentNode):
    """Turns messages into calls of vision and its answers into messages.

    A picture waits until odometry and head angles of its time have come; the pose is then interpolated.
    """

    def __init__(self) -> None:
        """Make the pose buffer and connect the topics; vision itself needs the lens and is made when it comes."""
        cv2.setNumThreads(1)  # the robot's other nodes need the other cores
        self._robot = load_robot()
        self._own_body = OwnBody(self._robot)
        # Before the node stands in the graph, where others wait for it: loops may have to be compiled.
        Vision(VisionParameters(), head_camera_lens(), self._own_body).rehearse()
        super().__init__("vision")
        self._settings = self.load(VisionParameters())
        try:
            self._mount = load_mount()
        except MountFileError as error:
            raise BadInputError(str(error)) from None
        self._vision: Vision | None = None
        self.begin_anew()
        self._features = self.sender(topics.FEATURES)
        self._drawn = self.sender(topics.VISION_PICTURE)
        self.listen(topics.CAMERA_INFO, self._on_lens)
        self.listen(topics.ODOMETRY, self._on_odometry, depth=ODOMETRY_WAITING)
        self.listen(topics.JOINT_STATES, self._on_joints, depth=JOINT_STATES_WAITING)
        self.listen(topics.CAMERA_IMAGE, self._on_picture)

    def begin_anew(self) -> None:
        """Forget poses, waiting pictures and what was seen; the lens stays."""
        self._poses = PoseBuffer(PoseBufferParameters(), partial(camera_in_footprint, self._robot, mount=self._mount))
        self._pictures: deque[Image] = deque()
        if self._vision is not None:
            self._vision = Vision(self._settings, self._vision.lens, self._own_body)

    def _on_lens(self, message: CameraInfo) -> None:
        try:
            lens = lens_from_message(message)
            if self._vision is None or lens.to_camera_info() != self._vision.lens.to_camera_info():
                self._vision = Vision(self._settings, lens, self._own_body)
                lens.ray_table()  # 20 ms now instead of at the first picture
        except ValueError as error:
            self.health.count("unusable camera info", f"camera info refused: {error}")

    def _on_odometry(self, message: Odometry) -> None:
        pose = message.pose.pose
        turn = pose.orientation
        try:
            self._poses.add_body(stamp_of(message), pose.position.z, (turn.x, turn.y, turn.z, turn.w))
        except ValueError as error:
            self.health.count("unusable odometry", f"odometry refused: {error}")
        self._process()

    def _on_joints(self, message: JointState) -> None:
        angles = dict(zip(message.name, message.position, strict=False))
        missing = [name for name in HEAD_JOINTS if name not in angles]
        if missing:
            self.health.count("joint states without head", f"joint_states lacks {', '.join(missing)}")
            return
        try:
            self._poses.add_head(stamp_of(message), *(angles[name] for name in HEAD_JOINTS))
        except ValueError as error:
            self.health.count("unusable joint states", f"joint states refused: {error}")
        if self._pictures:
            self._process()

    def _on_picture(self, message: Image) -> None:
        self._pictures.append(message)
        if len(self._pictures) > WAITING:
            self._drop("no pose came for it in time")
        self._process()

    def _process(self) -> None:
        """Process the waiting pictures whose pose is known, oldest first."""
        while self._pictures:
            message = self._pictures[0]
            if self._vision is None:
                return
            pose = self._poses.camera_in_footprint(stamp_of(message))
            if isinstance(pose, MissingPose):
                if pose.may_come:
                    return
                self._drop(pose.reason)
                continue
            self._pictures.popleft()
            try:
                picture = picture_from_message(message)
                features = self._vision.process(picture, stamp_of(message), pose)
            except ValueError as error:
                self.health.count("unusable pictures", f"picture refused: {error}")
                continue
            self._features.publish(features_to_message(features))
            if self._drawn.get_subscription_count() > 0:
                drawn = self._vision.annotate(picture, features)
                self._drawn.publish(picture_to_message(drawn, features.stamp))

    def _drop(self, reason: str) -> None:
        message = self._pictures.popleft()
        if self._vision is None:
            reason = "no camera info has come yet"
        self.health.count("pictures without pose", f"picture at {stamp_of(message) / 1e9:.3f} s dropped: {reason}")


def main() -> None:
    """Run the node."""
    run(VisionNode)


if __name__ == "__main__":
    main()
