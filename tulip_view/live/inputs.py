"""What the view listens to, how much of it it keeps, and what is missing from the page without it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from tulip_ros import topics
from tulip_ros.topics import Topic

WINDOW = 10.0
"""[s] How far curves reach back."""


@dataclass(frozen=True)
class Input:
    """One topic.

    Attributes:
        topic: The topic.
        period: Of messages whose stamps lie closer than this, one is taken [s].
        kept: How long messages are kept [s]; 0 for the newest alone.
        without: What the page lacks where the topic is not there, or "" for what is dispensable.
    """

    topic: Topic
    period: float = 0.0
    kept: float = 0.0
    without: str = ""


INPUTS: dict[str, Input] = {
    each.topic.name: each
    for each in (
        Input(topics.JOINT_STATES, 0.02, WINDOW, "angles of the neck, measured torques"),
        Input(topics.HEAD_JOINT_COMMAND, 0.04, WINDOW),
        Input(topics.MOTION_STATE, 0.02, WINDOW, "CoM, ZMP and DCM, soles, curves of the joints"),
        Input(topics.FOOTSTEPS, without="planned footsteps"),
        Input(topics.ODOMETRY, 0.02, 2.0, "the robot's attitude and height, and so its picture"),
        Input(topics.WORLD_STATE, 0.04, WINDOW, "the robot's place, ball and opponents as it believes them to be"),
        Input(topics.GROUND_TRUTH, 0.04, WINDOW, "the truth (as on a real robot)"),
        Input(topics.FEATURES, 0.0, 2.0, "features in the camera's picture"),
        Input(topics.CAMERA_INFO),
        Input(topics.CAMERA_COMPRESSED, 0.2, 2.0, "the camera's picture"),
        Input(topics.CAMERA_IMAGE, 0.2, 2.0),
        Input(topics.VISION_PICTURE, 0.2),
        Input(topics.DECISION, 0.2),
        Input(topics.BEHAVIOUR_TREE, without="the behaviour tree"),
        Input(topics.GAME_STATE, without="the game"),
        Input(topics.EMERGENCY_STOP),
        Input(topics.USER_COMMAND, without="what the user wants"),
        Input(topics.DIAGNOSTICS, without="the nodes' health"),
    )
}
"""By the topics' names within a robot's namespace."""


def not_shown(here: Collection[str]) -> list[str]:
    """Return what the page lacks, in sentences.

    Args:
        here: Names of the topics that there are.
    """
    pictures = {name for name, entry in INPUTS.items() if entry.topic.quality is topics.PICTURE}
    there = {*here, *(pictures if pictures & set(here) else ())}
    lacking = [entry for name, entry in INPUTS.items() if entry.without and name not in there]
    return [f"Not shown: {entry.without} (no {entry.topic.name})." for entry in lacking]
