"""Node "perception": features from the simulator's truth, in the place of node "vision". For fast tests of behaviour.

It is part of the simulator, not of the robot: no playing node hears the truth. Start it instead of vision, with
`trial_plan(..., perception=PerceptionParameters())` or by its name, and the driver with `camera: false`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from tulip_description.camera_mount import load_mount
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import load_field
from tulip_description.robot import HEAD_JOINTS, load_robot
from tulip_msgs.msg import GroundTruth
from tulip_ros import topics
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of
from tulip_sim.camera import CameraParameters
from tulip_sim.messages import truth_from_message
from tulip_sim.perception import Glimpse, Perception, PerceptionParameters
from tulip_vision.lens import head_camera_lens
from tulip_vision.messages import features_to_message
from tulip_vision.pose_buffer import MissingPose, PoseBuffer, PoseBufferParameters
from tulip_vision.view import SpreadParameters


@dataclass(frozen=True)
class PerceptionNodeParameters:
    """What the node makes up, and how often."""

    every: int = 3  # of the truth's messages at 50 Hz gives a picture: 60 ms, as the camera does
    seed: int = 0
    poles: bool = True  # the truth's message does not tell whether the landmark poles stand
    quality: PerceptionParameters = field(default_factory=PerceptionParameters)
    camera: CameraParameters = field(default_factory=CameraParameters)  # how it is mounted counts
    spread: SpreadParameters = field(default_factory=SpreadParameters)

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        if self.every < 1 or self.seed < 0:
            raise ValueError(f"every is {self.every}, seed {self.seed}; expected >= 1 and >= 0")


class PerceptionNode(ComponentNode):
    """Turns the truth into features, with the camera pose that odometry and head angles give."""

    def __init__(self) -> None:
        """Make the core and connect it."""
        super().__init__("perception")
        p = self._settings = self.load(PerceptionNodeParameters())
        self._robot = load_robot()
        self._perception = Perception(p.quality, load_field(), self._robot, head_camera_lens(), p.camera, p.spread)
        self.begin_anew()
        self._features = self.sender(topics.FEATURES)
        self.listen(topics.ODOMETRY, self._on_odometry)
        self.listen(topics.JOINT_STATES, self._on_joints)
        self.listen(topics.GROUND_TRUTH, self._on_truth)

    def begin_anew(self) -> None:
        """Forget poses and what was seen."""
        pose = partial(camera_in_footprint, self._robot, mount=load_mount())
        self._poses = PoseBuffer(PoseBufferParameters(), pose)
        self._rng = np.random.default_rng([self._settings.seed, 1])
        self._waiting: list[tuple[int, tuple[Glimpse, ...]]] = []
        self._heard = 0

    def _on_odometry(self, message: Odometry) -> None:
        pose = message.pose.pose
        turn = pose.orientation
        self._poses.add_body(stamp_of(message), pose.position.z, (turn.x, turn.y, turn.z, turn.w))

    def _on_joints(self, message: JointState) -> None:
        angles = dict(zip(message.name, message.position, strict=False))
        now = stamp_of(message)
        self._poses.add_head(now, *(angles[name] for name in HEAD_JOINTS))
        while self._waiting and now - self._waiting[0][0] >= self._settings.quality.latency * 1e9:
            stamp, glimpses = self._waiting[0]
            pose = self._poses.camera_in_footprint(stamp)
            if isinstance(pose, MissingPose) and pose.may_come:
                return
            del self._waiting[0]
            if isinstance(pose, MissingPose):
                self.health.count("views without pose", f"view at {stamp / 1e9:.3f} s dropped: {pose.reason}")
            elif pose[2, 3] > 0.0:  # a fallen robot's belief puts the camera below the ground: nothing to see
                features = self._perception.features(glimpses, stamp, pose, self._rng)
                self._features.publish(features_to_message(features))

    def _on_truth(self, message: GroundTruth) -> None:
        if self._heard % self._settings.every == 0:
            truth = truth_from_message(message, self._settings.poles)
            self._waiting.append((truth.stamp, self._perception.expose(truth, self._rng)))
        self._heard += 1


def main() -> None:
    """Run the node."""
    run(PerceptionNode)


if __name__ == "__main__":
    main()
