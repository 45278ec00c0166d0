"""The nodes of the graph: name, module, and the file of parameter values that they start with."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path

from tulip_ros.errors import unknown


@dataclass(frozen=True)
class NodeEntry:
    """One node.

    Attributes:
        name: Name in the graph.
        module: Module that runs it, as in `python -m MODULE`.
        playing: Part of the robot that plays; such a node never sees the ground truth.
        parameters: Values that it always starts with, by name.
    """

    name: str
    module: str
    playing: bool = True
    parameters: tuple[tuple[str, str], ...] = ()

    @property
    def package(self) -> str:
        """The Python package that holds the node."""
        return self.module.split(".")[0]

    @property
    def default_parameters(self) -> Path | None:
        """The file NAME.parameters.yaml in the node's package, or None: the values in the code hold."""
        spec = importlib.util.find_spec(self.package)
        for folder in (spec.submodule_search_locations or []) if spec else []:
            path = Path(folder) / f"{self.name}.parameters.yaml"
            if path.exists():
                return path
        return None


AGGREGATOR = "aggregator"
"""Name in the graph of the node that sums up the others' health."""

NODES: dict[str, NodeEntry] = {
    entry.name: entry
    for entry in (
        NodeEntry("vision", "tulip_vision.vision_node"),
        NodeEntry("worldmodel", "tulip_worldmodel.worldmodel_node"),
        NodeEntry("head", "tulip_motion.head_node"),
        NodeEntry("motion", "tulip_motion.motion_node"),
        NodeEntry("strategy", "tulip_strategy.strategy_node"),
        NodeEntry("game_input", "tulip_strategy.game_input_node"),
        NodeEntry("user_input", "tulip_strategy.user_input_node"),
        NodeEntry("emulator", "tulip_sim.emulator_node", playing=False),
        NodeEntry("disturber", "tulip_sim.disturber_node", playing=False),
        NodeEntry("perception", "tulip_sim.perception_node", playing=False),
        NodeEntry("identify", "tulip_motion.identification.identify_node", playing=False),
        NodeEntry(AGGREGATOR, "tulip_ros.aggregator_node", playing=False),
        NodeEntry("markers", "tulip_view.markers_node", playing=False),
        NodeEntry("recorder", "tulip_ros.recorder_node", playing=False),
        NodeEntry("replay", "tulip_ros.replay_node", playing=False),
        NodeEntry("view", "tulip_view.live.view_node", playing=False),
        NodeEntry("bridge", "tulip_view.bridge.bridge_node", playing=False),
    )
}
"""All nodes but the driver, by name."""

DRIVER = "driver"
"""Name in the graph of whatever stands for the robot's body."""


def driver_of(body: str, *parameters: tuple[str, str]) -> NodeEntry:
    """Return the driver that runs a body's class, as in package.module:Class."""
    return NodeEntry(DRIVER, "tulip_driver.body_node", playing=False, parameters=(("body", body), *parameters))


DRIVERS: dict[str, NodeEntry] = {
    "sim": NodeEntry(DRIVER, "tulip_sim.driver_node", playing=False),
    "mujoco": NodeEntry(DRIVER, "tulip_sim.driver_node", playing=False, parameters=(("world.engine", "mujoco"),)),
    "match": NodeEntry(DRIVER, "tulip_sim.match_driver_node", playing=False),
    "log": NodeEntry(DRIVER, "tulip_sim.log_driver_node", playing=False),
    "echo": driver_of("tulip_driver.echo:EchoBody"),
    "wire": driver_of("tulip_driver.wire.body:WireBody", ("clock", "body")),
}
"""What can stand for the robot's body, for the bodies of two, or for a recorded one: each is a node named DRIVER."""

ROBOT: tuple[str, ...] = tuple(name for name, entry in NODES.items() if entry.playing)
"""The nodes that make the robot play, in the order of the data flow."""


LOOKERS = frozenset({AGGREGATOR, "markers", "recorder", "view", "bridge"})
"""The nodes that only look at a robot: alone they want no driver, as the robot's may run on another computer."""


def find_node(name: str) -> NodeEntry:
    """Return a node's entry.

    Raises:
        BadInputError: if there is no node of that name.
    """
    if name not in NODES:
        raise unknown("node", name, NODES)
    return NODES[name]


def find_driver(name: str) -> NodeEntry:
    """Return a driver's entry.

    Args:
        name: One of DRIVERS, or anybody's body as package.module:Class, which the node itself looks for.

    Raises:
        BadInputError: if there is no driver of that name.
    """
    if ":" in name:
        return driver_of(name)
    if name not in DRIVERS:
        raise unknown("driver", name, DRIVERS)
    return DRIVERS[name]
