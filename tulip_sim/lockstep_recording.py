"""Records a lockstep trial as the graph would: the same topics, types and serialization."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import serialize_message

from tulip_description.robot import load_robot
from tulip_motion.messages import (
    body_transforms,
    head_command_to_message,
    joint_command_to_message,
    motion_state_to_message,
    odometry_to_message,
    progress_to_message,
    sensors_to_messages,
    walk_command_to_message,
)
from tulip_ros import topics
from tulip_ros.bag import Bag
from tulip_ros.errors import unknown
from tulip_ros.log_notes import Notebook
from tulip_ros.picture_rate import PICTURE_RATE, PictureRate
from tulip_ros.topics import Topic
from tulip_sim.messages import jpeg_to_message, lens_to_message, png_to_message, report_to_message, truth_to_message
from tulip_strategy.messages import (
    decision_to_message,
    game_state_to_message,
    tree_to_message,
    user_command_to_message,
)
from tulip_vision.messages import features_to_message
from tulip_worldmodel.messages import (
    map_to_odom_message,
    robot_pose_to_message,
    start_pose_to_message,
    world_state_to_message,
)

Messages = Iterable[tuple[Topic, Any]]
COMPRESS = {"compressed": jpeg_to_message, "png": png_to_message}
KINDS = (*COMPRESS, "none")
"""How pictures can be recorded: vision on a JPEG finds nearly the same as live, on a PNG exactly the same."""


@dataclass(frozen=True)
class RecordedPictures:
    """What of the camera's pictures is recorded.

    Attributes:
        kind: One of `KINDS`.
        rate: How many in a second, by their stamps; 0 for all.
    """

    kind: str = "compressed"
    rate: float = PICTURE_RATE


class LockstepRecording:
    """Writes what passes between the cores into a recording.

    Pictures go in compressed, as `camera/image_raw/compressed`; times are simulated times.
    """

    def __init__(self, folder: Path, pictures: RecordedPictures | None = None) -> None:
        """Begin a recording.

        Args:
            folder: New folder for it.
            pictures: Which; None for the usual ones.

        Raises:
            BadInputError: if it cannot be written, or there is no such kind of pictures.
        """
        pictures = pictures or RecordedPictures()
        if pictures.kind not in KINDS:
            raise unknown("kind of pictures", pictures.kind, KINDS)
        self._compress = COMPRESS.get(pictures.kind)
        self._rate = PictureRate(pictures.rate)
        self._bag = Bag(folder)
        self.path = self._bag.path
        cells = np.array([foot.cells for foot in load_robot().feet])
        self._converters: dict[str, Callable[[int, Any], Messages]] = {
            "sensors": lambda stamp, value: zip(
                (topics.JOINT_STATES, topics.IMU, topics.FOOT_FORCES), sensors_to_messages(value, cells), strict=True
            ),
            "camera/camera_info": lambda stamp, value: [(topics.CAMERA_INFO, lens_to_message(value, stamp))],
            "camera/image_raw": self._picture,
            "legs/joint_command": lambda stamp, value: [(topics.LEG_COMMAND, joint_command_to_message(value))],
            "head/joint_command": lambda stamp, value: [(topics.HEAD_JOINT_COMMAND, joint_command_to_message(value))],
            "features": lambda stamp, value: [(topics.FEATURES, features_to_message(value))],
            "odometry": lambda stamp, value: [
                (topics.ODOMETRY, odometry_to_message(value)),
                (topics.TF, body_transforms(value)),
            ],
            "motion_state": lambda stamp, value: [(topics.MOTION_STATE, motion_state_to_message(*value))],
            "world_state": lambda stamp, value: [
                (topics.WORLD_STATE, world_state_to_message(value)),
                (topics.ROBOT_POSE, robot_pose_to_message(value)),
                (topics.TF, map_to_odom_message(value)),
            ],
            "game_state": lambda stamp, value: [(topics.GAME_STATE, game_state_to_message(value))],
            "user_command": lambda stamp, value: [(topics.USER_COMMAND, user_command_to_message(value))],
            "walk_command": lambda stamp, value: [(topics.WALK_COMMAND, walk_command_to_message(value))],
            "head_command": lambda stamp, value: [(topics.HEAD_COMMAND, head_command_to_message(value))],
            "decision": lambda stamp, value: [(topics.DECISION, decision_to_message(value))],
            "behaviour_tree": lambda stamp, value: [(topics.BEHAVIOUR_TREE, tree_to_message(value))],
            "ground_truth": lambda stamp, value: [(topics.GROUND_TRUTH, truth_to_message(*value))],
            "initialpose": lambda stamp, value: [(topics.START_POSE, start_pose_to_message(value, stamp))],
            "identification/progress": lambda stamp, value: [(topics.IDENTIFICATION, progress_to_message(value))],
            "referee/report": lambda stamp, value: [(topics.REPORT, report_to_message(value))],
        }

    @property
    def notebook(self) -> Notebook:
        """What takes notes about how the recording came to be."""
        return self._bag

    def write(self, topic: str, stamp: int, value: object, namespace: str = "") -> None:
        """Write what was told on a topic at a stamp [ns].

        Args:
            topic: As the cores' listener is told.
            stamp: [ns].
            value: What was told.
            namespace: Of the robot; "" for one that is alone, and for what is of no robot.

        Raises:
            KeyError: for a topic that has no message.
            OSError: if the file cannot be written.
        """
        if topic == "camera/image_raw" and not self._rate.keeps(namespace, stamp):
            return
        for entry, message in self._converters[topic](stamp, value):
            name = f"/{entry.within(namespace).name.lstrip('/')}"
            self._bag.add_topic(name, entry.type_name, entry.quality)
            self._bag.write(name, serialize_message(message), stamp)
        self._bag.flush()

    def _picture(self, stamp: int, value: NDArray[np.uint8]) -> Messages:
        return [(topics.CAMERA_COMPRESSED, self._compress(value, stamp))] if self._compress else []

    def close(self) -> None:
        """End the recording."""
        self._bag.close()
