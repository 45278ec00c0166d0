"""Serialized messages of a topic, as they are, taken all at once."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from typing import NamedTuple

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.type_support import check_is_valid_msg_type

from tulip_ros import schemas, topics
from tulip_ros.topics import Quality

WAITING = 200
"""Messages of one topic that wait while the listener is busy: 0.8 s at 250 Hz."""
HIDDEN = re.compile(r"(^|/)_|^/parameter_events$")
"""Topics of the middleware itself, which tools leave out."""


class Taken(NamedTuple):
    """One message.

    Attributes:
        received: When the middleware received it [ns since 1970].
        sent: When it was sent [ns since 1970].
        data: The serialized message.
        number: That its publisher gave it.
    """

    received: int
    sent: int
    data: bytes
    number: int


class RawTopic:
    """A subscription whose messages wait in the middleware until they are taken.

    No executor knows of it: one waking for many messages is cheap, and the quick executor cannot tell a callback a
    message's number.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        type_name: str,
        quality: Quality,
        reliability: ReliabilityPolicy = ReliabilityPolicy.RELIABLE,
        waiting: int = WAITING,
    ) -> None:
        """Subscribe.

        Args:
            node: The node that listens.
            name: Full name, as in /striker/odometry.
            type_name: As in nav_msgs/msg/Odometry.
            quality: That of the topic.
            reliability: What all publishers can serve.
            waiting: How many messages may wait here.

        Raises:
            LookupError: if the type is not installed.
        """
        self.name, self.type_name, self.quality = name, type_name, quality
        self._class, self._waiting = schemas.message_class(type_name), waiting
        profile = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=waiting,
            reliability=reliability,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if quality.latched else DurabilityPolicy.VOLATILE,
        )
        check_is_valid_msg_type(self._class)  # loads what the middleware needs to know of the type
        with node.handle:
            self._subscription = rclpy_implementation.Subscription(
                node.handle, self._class, name, profile.get_c_qos_profile()
            )

    def take(self) -> Iterator[Taken]:
        """Yield what came in since the last time, at most what may wait: others want their turn, too."""
        subscription, message_class = self._subscription, self._class
        for _ in range(self._waiting):
            taken = subscription.take_message(message_class, True)
            if taken is None:
                return
            data, about = taken
            # A clock that another machine has set is no reason to refuse a message.
            received = about["received_timestamp"] or time.time_ns()
            yield Taken(received, about["source_timestamp"], data, about["publication_sequence_number"])

    def publishers(self) -> int:
        """Return how many publishers this subscription hears."""
        return int(self._subscription.get_publisher_count())

    def close(self) -> None:
        """Listen no more."""
        self._subscription.destroy_when_not_in_use()


def offered(node: Node, name: str) -> tuple[Quality, ReliabilityPolicy]:
    """Return the quality that all publishers of a topic can serve; of a topic of this project, what it is to have.

    Args:
        node: Who asks.
        name: Full name of the topic.
    """
    profiles = [each.qos_profile for each in node.get_publishers_info_by_topic(name)]
    if not profiles:
        latched = any(topic.quality.latched for topic in topics.TOPICS if topics.is_called(name, topic))
        return Quality(WAITING, latched), ReliabilityPolicy.RELIABLE
    latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in profiles)
    reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in profiles)
    return Quality(WAITING, latched), ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT


def message_topics(node: Node) -> Iterator[tuple[str, str]]:
    """Yield name and type of each topic in the graph that has one type, and messages."""
    for name, types in node.get_topic_names_and_types():
        if len(types) == 1 and "/msg/" in types[0] and not HIDDEN.search(name):
            yield name, types[0]
