"""Asks the nodes of the graph for their parameters, each once when it appears."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

AGAIN = 10  # looks, five seconds, without an answer after which the question was lost and is asked again
PATIENCE = 240  # looks, two minutes, that a node has to start and to answer; then it is asked no more

Told = Callable[[str, dict[str, Any]], None]
"""Is told a node's full name, as in /striker/vision, and its parameters by name."""


class ParameterAsker:
    """Asks on behalf of a node. A node that goes and comes again is asked again."""

    def __init__(self, node: Node, told: Told) -> None:
        self._node, self._told = node, told
        self._asked: dict[str, _Question] = {}

    def look(self) -> None:
        """Look which nodes there are; call it about twice a second."""
        own = self._node.get_fully_qualified_name()
        present = {
            f"{namespace.rstrip('/')}/{name}"
            for name, namespace in self._node.get_node_names_and_namespaces()
            if not name.startswith("_")
        } - {own}
        for gone in self._asked.keys() - present:
            self._asked.pop(gone).forget()
        for name in present - self._asked.keys():
            self._asked[name] = _Question(self._node, name, self._told)
        for question in self._asked.values():
            question.look()


class _Question:
    def __init__(self, node: Node, name: str, told: Told) -> None:
        self._node, self._name, self._told = node, name, told
        self._list: Client | None = node.create_client(ListParameters, f"{name}/list_parameters")
        self._get: Client | None = node.create_client(GetParameters, f"{name}/get_parameters")
        self._names: list[str] | None = None
        self._waiting: Any = None  # future
        self._looks = 0
        self._asked_at = 0  # look

    def look(self) -> None:
        """Go on where the answer before is in."""
        if self._list is None or self._get is None:
            return
        self._looks += 1
        if self._looks > PATIENCE:
            self.forget()
        elif self._waiting is None or self._looks - self._asked_at > AGAIN:
            if self._list.service_is_ready() and self._get.service_is_ready():
                self._ask()
        elif self._waiting.done():
            answer = self._waiting.result()
            if self._names is None:
                self._names = list(answer.result.names)
                self._ask()
            else:
                values = {
                    name: _plain(parameter_value_to_python(value))
                    for name, value in zip(self._names, answer.values, strict=True)
                }
                self.forget()
                self._told(self._name, values)

    def _ask(self) -> None:
        assert self._list is not None and self._get is not None
        self._asked_at = self._looks
        if self._names is None:
            self._waiting = self._list.call_async(ListParameters.Request())
        else:
            self._waiting = self._get.call_async(GetParameters.Request(names=self._names))

    def forget(self) -> None:
        """Ask no more."""
        for client in (self._list, self._get):
            if client is not None:
                self._node.destroy_client(client)
        self._list = self._get = None


def _plain(value: Any) -> Any:
    """Return a value as YAML has it: arrays as lists."""
    return value.tolist() if hasattr(value, "tolist") else value
