"""What viewers publish: checked, and passed on to the graph."""

from __future__ import annotations

from time import time_ns

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message

from tulip_msgs.msg import EmergencyStop
from tulip_ros.topics import FROM_PEOPLE, RELEASE_STOP, is_called
from tulip_view.bridge.rules import why_not_publish

Source = tuple[int, int]
"""A viewer, and its own number for what it publishes on."""
MOST = 100  # topics that all viewers together may announce; one has as many as there are things that people say


class Publications:
    """Topics that viewers publish on."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[Source, Publisher] = {}
        self._refusals: dict[Source, str] = {}

    def begin(self, source: Source, name: str, type_name: str, encoding: str) -> None:
        """A viewer may want to publish. Some announce what their buttons could publish: that alone is no fault."""
        self.end(source)  # announced anew
        refusal = why_not_publish(name, type_name, encoding)
        if len(self._publishers) + len(self._refusals) >= MOST:
            return  # what comes on it is refused as not announced
        if refusal:
            self._refusals[source] = refusal
            return
        [topic] = [each for each in FROM_PEOPLE if is_called(name, each)]
        self._publishers[source] = self._node.create_publisher(topic.message, name, topic.quality.profile())

    def publish(self, source: Source, data: bytes) -> str:
        """Publish a serialized message; return why not, or ""."""
        publisher = self._publishers.get(source)
        if publisher is None:
            return self._refusals.get(source, "messages on a channel that was not announced")
        try:  # a message that no listener can read would be an error in each of them
            message = deserialize_message(data, publisher.msg_type)
        except rclpy_implementation.RMWError:
            return f"{len(data)} bytes are no message of {publisher.topic_name}"
        if isinstance(message, EmergencyStop):
            if not message.engaged:
                return f"an emergency stop is released by the service {RELEASE_STOP.name} alone"
            message.by, message.sequence = message.by or "viewer", time_ns()  # viewers have heard no numbers
        publisher.publish(message)
        return ""

    def end(self, source: Source) -> None:
        """A viewer publishes no more."""
        self._refusals.pop(source, None)
        publisher = self._publishers.pop(source, None)
        if publisher is not None:
            self._node.destroy_publisher(publisher)
