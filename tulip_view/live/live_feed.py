"""Feeds a scene from the topics of a running robot, and from none of them while nobody looks."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from tulip_ros import topics
from tulip_ros.topics import Topic
from tulip_view.live.inputs import INPUTS, not_shown
from tulip_view.live.intake import Intake
from tulip_view.live.scene import Scene
from tulip_view.recording import STEADY

DEPTH = 30
"""Messages of a topic that wait until the page is drawn next: 0.6 s of 50 Hz."""
PICTURES: dict[str, Topic | None] = {
    "camera, with features": topics.CAMERA_COMPRESSED,
    "vision's own": topics.VISION_PICTURE,
    "none": None,
}
"""What the page's user can choose; senders make these pictures only while someone listens."""


class LiveFeed:
    """Looks after the topics whenever the page is drawn.

    The subscriptions belong to a node that no executor serves: messages wait in the middleware, where new ones push old
    ones out, and are taken when the page is drawn, several at a time.

    Attributes:
        robot: Namespace of the robot that is shown.
    """

    def __init__(self, node: Node, scene: Scene, robot: str) -> None:
        """Begin without listening.

        Args:
            node: Makes the subscriptions; no executor may serve it.
            scene: Is fed.
            robot: Namespace, as in "striker"; "" for a robot that is alone, or for whichever there is.
        """
        self._node = node
        self._intake = Intake(scene)
        self._scene = scene
        self._picture: Topic | None = topics.CAMERA_COMPRESSED
        self._ears: dict[str, tuple[str, Subscription]] = {}  # by full name, with the name in INPUTS
        self.robot = robot

    @property
    def robots(self) -> tuple[str, ...]:
        """Namespaces of the robots that publish at present, and of the one that is shown."""
        return tuple(sorted({*self._publishing(), self.robot}))

    def choose(self, robot: str) -> None:
        """Show another robot."""
        if robot != self.robot:
            self.rest()
            self.robot = robot

    def choose_picture(self, name: str) -> None:
        """Show other pictures.

        Args:
            name: One of `PICTURES`.
        """
        self._picture = PICTURES[name]  # `update`, which another thread calls, ends the listening to the others

    def update(self) -> bool:
        """Take what has come since the last time; begin to listen if need be. Return False: time only goes on."""
        if not self._ears and not self.robot:
            self.robot = min(self._publishing(), default="", key=lambda name: (name != "", name != "striker", name))
        for full, (name, _) in list(self._ears.items()):
            topic = INPUTS[name].topic
            if topic.quality is topics.PICTURE and topic is not self._picture:
                self._close(full)
                self._scene.forget(topic)
        for entry in INPUTS.values():
            if entry.topic.quality is topics.PICTURE and entry.topic is not self._picture:
                continue
            # Nodes that are of no robot, as the simulator of a match, tell of themselves outside all namespaces.
            outside = ("",) if entry.topic is topics.DIAGNOSTICS else ()
            for robot in dict.fromkeys((self.robot, *outside)):
                self._listen(entry.topic, robot)
        now = time.monotonic()
        for name, ear in self._ears.values():
            kind = INPUTS[name].topic.message
            while (data := _taken(ear)) is not None:
                self._intake.take(name, data, now, partial(deserialize_message, data, kind))
        return False

    def remarks(self) -> list[str]:
        """Return what does not come, in sentences."""
        return not_shown(self._scene.told(lambda buffers: {name for name in INPUTS if buffers.has(name)}))

    def rest(self) -> None:
        """Stop listening, and forget: nobody looks."""
        for full in list(self._ears):
            self._close(full)
        self._intake.begin_anew()

    def _listen(self, topic: Topic, robot: str) -> None:
        full = f"/{topic.within(robot).name}"
        if full not in self._ears:
            seldom = topic.quality.latched or topic.quality is topics.PICTURE
            ear = replace(topic, name=full).subscribe_from(
                self._node, lambda message: None, raw=True, depth=1 if seldom else DEPTH, only_looks=True
            )
            self._ears[full] = topic.name, ear

    def _publishing(self) -> set[str]:
        return {
            full.removesuffix(f"/{name}").strip("/")
            for full, _ in self._node.get_topic_names_and_types()
            for name in STEADY
            if full.endswith(f"/{name}")
        }

    def _close(self, full: str) -> None:
        _, ear = self._ears.pop(full)
        self._node.destroy_subscription(ear)


def _taken(ear: Subscription) -> bytes | None:
    """Return the next serialized message that waits, or None."""
    with ear.handle:
        found: tuple[bytes, Any] | None = ear.handle.take_message(ear.msg_type, True)
    return found[0] if found is not None else None
