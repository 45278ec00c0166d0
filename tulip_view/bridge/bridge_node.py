"""Node "bridge": all topics, the menu's services and parameters for Foxglove and viewers like it."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from functools import partial
from queue import Empty, SimpleQueue
from time import time_ns

import foxglove
from foxglove.websocket import Capability, Parameter, StatusLevel

from tulip_ros import topics
from tulip_ros.asking import Asker
from tulip_ros.priority import give_way
from tulip_ros.raw_topic import RawTopic
from tulip_ros.run import ComponentNode, run
from tulip_ros.serialized import time_at
from tulip_ros.timeline import JUMP
from tulip_view.bridge.door import Door
from tulip_view.bridge.feeds import Feeds
from tulip_view.bridge.node_settings import NodeSettings
from tulip_view.bridge.publications import Publications, Source
from tulip_view.bridge.rules import ENCODING
from tulip_view.bridge.services import Services
from tulip_view.bridge.settings import BridgeParameters
from tulip_view.bridge.viewers import Viewers

LOOK = 0.5  # [s] between two looks for new topics, services and nodes
COLLECT = 0.04  # [s] between two times that waiting messages are passed on: one waking for many is cheap
CAPABILITIES = [Capability.ClientPublish, Capability.Parameters, Capability.Services, Capability.Time]


class BridgeNode(ComponentNode):
    """Passes serialized messages on as they are, of the topics that a viewer listens to."""

    def __init__(self, settings: BridgeParameters | None = None) -> None:
        """Open the door.

        Args:
            settings: Values to start from; ROS parameters replace them.

        Raises:
            BadInputError: for parameters that cannot be used, or if the port is taken.
        """
        super().__init__("bridge")
        self.settings = p = self.load(settings or BridgeParameters())
        self._todo: SimpleQueue[Callable[[], None]] = SimpleQueue()
        context = foxglove.Context()
        self._feeds = Feeds(self, context)
        self._publications = Publications(self)
        asker = Asker(self)
        self._node_settings = NodeSettings(self, asker, self._tell_parameters)
        # A loopback address that nobody guesses; only the door knows it.
        address = f"127.{'.'.join(str(1 + secrets.randbelow(254)) for _ in range(3))}"
        self._server = foxglove.start_server(
            name="TUlip",
            host=address,
            port=0,
            capabilities=CAPABILITIES,
            server_listener=Viewers(self, self._todo.put, self._node_settings),
            supported_encodings=[ENCODING],
            context=context,
        )
        self._offered_services = Services(self, asker, self._server)
        clock = topics.CLOCK
        self._clock_topic = RawTopic(self, clock.name, clock.type_name, clock.quality, clock.quality.on_looking, 1)
        self._stamp = 0
        try:
            self.door = Door(p.host, p.port, (address, self._server.port), p.origins, self._on_refused_connection)
        except BaseException:
            self._server.stop()
            raise
        self.get_logger().info(f"listening on ws://{p.host}:{self.door.port}")
        self.every(COLLECT, self._collect)
        self.every(LOOK, self._look)

    def _collect(self) -> None:
        """Do what viewers asked for, and pass on what came in."""
        while True:
            try:
                act = self._todo.get_nowait()
            except Empty:
                break
            act()
        for message in self._clock_topic.take():
            stamp = time_at(message.data)
            if stamp < self._stamp - JUMP:
                self._server.clear_session()  # viewers forget what was before time began anew
            self._stamp = stamp
            self._server.broadcast_time(stamp)
        now = self._stamp or time_ns()
        if not self._stamp and not self._clock_topic.publishers():
            self._server.broadcast_time(now)  # a viewer to which a clock was announced knows no other time
        self._feeds.forward(now)

    def _look(self) -> None:
        """See what is new in the graph."""
        for name, reason in self._feeds.look().items():
            self.health.count("topics of unknown type", f"topic {name} is not shown: {reason}")
        self._offered_services.look()
        self._node_settings.look()

    def on_listen(self, viewer: int, name: str) -> None:
        """See `viewers.Bridge`."""
        self._feeds.listen(viewer, name)

    def on_leave(self, viewer: int, name: str) -> None:
        """See `viewers.Bridge`."""
        self._feeds.leave(viewer, name)

    def on_advertise(self, source: Source, name: str, type_name: str, encoding: str) -> None:
        """See `viewers.Bridge`."""
        self._publications.begin(source, name, type_name, encoding)

    def on_data(self, source: Source, data: bytes) -> None:
        """See `viewers.Bridge`."""
        self._refuse("refused publications", self._publications.publish(source, data))

    def on_unadvertise(self, source: Source) -> None:
        """See `viewers.Bridge`."""
        self._publications.end(source)

    def on_refusals(self, refusals: list[str]) -> None:
        """See `viewers.Bridge`."""
        for refusal in refusals:
            self._refuse("refused parameters", refusal)

    def _on_refused_connection(self, words: str) -> None:
        """Tell of it, from the door's thread."""
        self._todo.put(partial(self.health.count, "refused connections", words))

    def _refuse(self, event: str, refusal: str) -> None:
        """Tell viewers why something was not done, if so. The library cannot tell one of them alone."""
        if refusal:
            self.health.count(event, refusal)
            self._server.publish_status(refusal, StatusLevel.Error)

    def _tell_parameters(self, parameters: list[Parameter]) -> None:
        self._server.publish_parameter_values(parameters)

    def destroy_node(self) -> None:
        """Send the viewers away, then end the node."""
        self.door.close()
        self._server.stop()
        self._feeds.close()
        self._clock_topic.close()
        super().destroy_node()


if __name__ == "__main__":
    give_way()
    run(BridgeNode)
