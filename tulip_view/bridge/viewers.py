"""What viewers do, told to the node's own thread: the server library calls from threads of its own."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol

from foxglove.websocket import ChannelView, Client, ClientChannel, Parameter, ServerListener

from tulip_view.bridge.node_settings import Answer, NodeSettings
from tulip_view.bridge.publications import Source


class Bridge(Protocol):
    """Who is told."""

    def on_listen(self, viewer: int, name: str) -> None:
        """A viewer listens to a topic from now on."""

    def on_leave(self, viewer: int, name: str) -> None:
        """A viewer listens to a topic no more."""

    def on_advertise(self, source: Source, name: str, type_name: str, encoding: str) -> None:
        """A viewer wants to publish."""

    def on_data(self, source: Source, data: bytes) -> None:
        """A viewer publishes."""

    def on_unadvertise(self, source: Source) -> None:
        """A viewer publishes no more."""

    def on_refusals(self, refusals: list[str]) -> None:
        """Parameters were not set, for these reasons."""


class Viewers(ServerListener):
    """All viewers that are connected."""

    def __init__(self, bridge: Bridge, later: Callable[[Callable[[], None]], None], settings: NodeSettings) -> None:
        """Prepare.

        Args:
            bridge: Who is told.
            later: Has its argument called in the node's own thread, in the order given.
            settings: Parameters of the nodes, which a viewer is answered at once.
        """
        self._bridge, self._later, self._settings = bridge, later, settings

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """See `ServerListener`."""
        self._later(partial(self._bridge.on_listen, client.id, channel.topic))

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """See `ServerListener`; also called when a viewer goes away."""
        self._later(partial(self._bridge.on_leave, client.id, channel.topic))

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        """See `ServerListener`."""
        source = (client.id, channel.id)
        self._later(partial(self._bridge.on_advertise, source, channel.topic, channel.schema_name, channel.encoding))

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        """See `ServerListener`."""
        self._later(partial(self._bridge.on_data, (client.id, client_channel_id), data))

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        """See `ServerListener`; also called when a viewer goes away."""
        self._later(partial(self._bridge.on_unadvertise, (client.id, client_channel_id)))

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[Parameter]:
        """See `ServerListener`."""
        return self._settings.get(param_names)

    def on_set_parameters(
        self, client: Client, parameters: list[Parameter], request_id: str | None = None
    ) -> list[Parameter]:
        """See `ServerListener`."""
        answer: Answer = self._settings.set(parameters)
        if answer.refusals:
            self._later(partial(self._bridge.on_refusals, answer.refusals))
        return answer.parameters
