"""Topics as viewers see them: announced when they appear, subscribed while a viewer listens, passed on as they are."""

from __future__ import annotations

from foxglove import Channel, Context, Schema
from rclpy.node import Node

from tulip_ros import schemas
from tulip_ros.raw_topic import RawTopic, message_topics, offered
from tulip_view.bridge.rules import DEFINITIONS, ENCODING


class Feeds:
    """All topics of the graph."""

    def __init__(self, node: Node, context: Context) -> None:
        self._node, self._context = node, context
        self._channels: dict[str, Channel] = {}
        self._types: dict[str, str] = {}
        self._viewers: dict[str, set[int]] = {}
        self._inputs: dict[str, RawTopic] = {}

    def look(self) -> dict[str, str]:
        """Announce topics that appeared; return why some cannot be shown, by name, each once."""
        refused = {}
        for name, type_name in message_topics(self._node):
            if name in self._types:
                continue
            self._types[name] = type_name
            try:
                schemas.message_class(type_name)
                text = schemas.definition(type_name)
            except LookupError as error:
                refused[name] = str(error)
                continue
            schema = Schema(name=type_name, encoding=DEFINITIONS, data=text.encode())
            self._channels[name] = Channel(name, schema=schema, message_encoding=ENCODING, context=self._context)
        return refused

    def listen(self, viewer: int, name: str) -> None:
        """A viewer listens to a topic from now on."""
        viewers = self._viewers.setdefault(name, set())
        viewers.add(viewer)
        before = self._inputs.get(name)
        if before is None or before.quality.latched:  # subscribed anew, a latched topic tells its last message again
            quality, reliability = offered(self._node, name)
            if not quality.latched:
                reliability = quality.on_looking
            self._inputs[name] = RawTopic(self._node, name, self._types[name], quality, reliability)
            if before is not None:
                before.close()

    def leave(self, viewer: int, name: str) -> None:
        """A viewer listens no more."""
        viewers = self._viewers.get(name, set())
        viewers.discard(viewer)
        if not viewers and name in self._inputs:
            self._inputs.pop(name).close()

    def forward(self, stamp: int) -> None:
        """Pass on what came in, at a time [ns]."""
        for name, topic in self._inputs.items():
            channel = self._channels[name]
            for message in topic.take():
                channel.log(message.data, log_time=stamp)

    def close(self) -> None:
        """Listen to nothing more."""
        for topic in self._inputs.values():
            topic.close()
        self._inputs.clear()
        for channel in self._channels.values():
            channel.close()
