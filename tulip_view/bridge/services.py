"""The project's services as viewers see them: offered while a node serves them."""

from __future__ import annotations

from functools import partial

from foxglove import Schema
from foxglove.websocket import MessageSchema, Service, ServiceRequest, ServiceSchema, WebSocketServer
from rclpy.node import Node

from tulip_ros import schemas, topics
from tulip_ros.asking import Asker, ServiceClient
from tulip_view.bridge.asking import ask_serialized
from tulip_view.bridge.rules import DEFINITIONS, ENCODING, known_service


class Services:
    """Services of all robots in the graph."""

    def __init__(self, node: Node, asker: Asker, server: WebSocketServer) -> None:
        self._node, self._asker, self._server = node, asker, server
        self._clients: dict[str, ServiceClient] = {}
        self._offered: set[str] = set()

    def look(self) -> None:
        """Offer what is served now, and nothing else."""
        for name, types in self._node.get_service_names_and_types():
            known = known_service(name, types[0])
            if known is not None and name not in self._clients:
                self._clients[name] = self._asker.client(known.type, name)
        served = {name for name, client in self._clients.items() if client.service_is_ready()}
        if served - self._offered:
            self._server.add_services([self._service(name) for name in sorted(served - self._offered)])
        if self._offered - served:
            self._server.remove_services(sorted(self._offered - served))
        self._offered = served

    def _service(self, name: str) -> Service:
        client = self._clients[name]
        type_name = topics.type_name(client.srv_type)
        request, response = (
            MessageSchema(
                encoding=ENCODING,
                schema=Schema(name=f"{type_name}_{part}", encoding=DEFINITIONS, data=text.encode()),
            )
            for part, text in zip(("Request", "Response"), schemas.service_definitions(type_name), strict=True)
        )
        schema = ServiceSchema(type_name, request=request, response=response)
        return Service(name, schema=schema, handler=partial(_answer, self._asker, client))


def _answer(asker: Asker, client: ServiceClient, request: ServiceRequest) -> bytes:
    return ask_serialized(asker, client, request.payload)
