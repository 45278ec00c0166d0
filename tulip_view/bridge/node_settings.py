"""Parameters of all nodes, as viewers show and set them: /NODE.NAME, as in /striker/motion.gait."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from foxglove.websocket import Parameter
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from tulip_ros.asking import Asker, NotServedError, ServiceClient
from tulip_ros.node_parameters import ParameterAsker


class Answer(NamedTuple):
    """What came of setting parameters: how they are now, and why some did not change."""

    parameters: list[Parameter]
    refusals: list[str]


class NodeSettings:
    """Knows the parameters of all nodes; asks each node when it appears."""

    def __init__(self, node: Node, asker: Asker, learned: Callable[[list[Parameter]], None]) -> None:
        """Begin without any.

        Args:
            node: Who asks.
            asker: Calls the nodes' services.
            learned: Is told the parameters of each node that appears.
        """
        self._asker, self._learned = asker, learned
        self._parameters = ParameterAsker(node, self._learn)
        self._values: dict[str, dict[str, Any]] = {}
        self._setters: dict[str, ServiceClient] = {}

    def look(self) -> None:
        """Look for nodes; call it about twice a second."""
        self._parameters.look()

    def get(self, names: Iterable[str] = ()) -> list[Parameter]:
        """Return the parameters of those names, or all of them; unknown ones are left out. From any thread."""
        wanted = set(names)
        return [
            _parameter(node, name, value)
            for node, values in dict(self._values).items()
            for name, value in dict(values).items()
            if value is not None and (not wanted or f"{node}.{name}" in wanted)
        ]

    def set(self, parameters: Iterable[Parameter]) -> Answer:
        """Ask the nodes to change parameters. From any thread but the node's own, which must be running it."""
        names, refusals = [], []
        for parameter in parameters:
            names.append(parameter.name)
            refusal = self._set(parameter.name, parameter.get_value())
            if refusal:
                refusals.append(f"{parameter.name} stays as it is: {refusal}")
        return Answer(self.get(names) if names else [], refusals)

    def _set(self, full_name: str, value: Any) -> str:
        node, _, name = full_name.partition(".")
        values = self._values.get(node, {})
        if name not in values:
            return "there is no such parameter"
        if isinstance(values[name], float) and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)  # JSON does not tell 1.0 from 1
        try:
            request = SetParameters.Request(parameters=[RosParameter(name, value=value).to_parameter_msg()])
            [result] = self._asker.wait_for(self._setters[node], request).results
        except (NotServedError, TypeError, ValueError, AssertionError) as error:
            return str(error)
        if not result.successful:
            return result.reason or "the node refuses"
        values[name] = value
        return ""

    def _learn(self, node: str, values: dict[str, Any]) -> None:
        if node not in self._setters:
            self._setters[node] = self._asker.client(SetParameters, f"{node}/set_parameters")
        self._values[node] = values
        self._learned([_parameter(node, name, value) for name, value in values.items() if value is not None])


def _parameter(node: str, name: str, value: Any) -> Parameter:
    if isinstance(value, list) and value and isinstance(value[0], bytes):  # as ROS has single bytes
        value = b"".join(value)
    return Parameter(f"{node}.{name}", value=value)
