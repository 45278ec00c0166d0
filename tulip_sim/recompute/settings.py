"""With which parameters a recorded robot played, as far as the recording or the user tells."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tulip_description.field import Field, FieldError, load_field
from tulip_description.planar import Pose2D
from tulip_motion.head import HeadParameters
from tulip_ros import log_notes, parameters, plan
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_sim.match_rules import COLOUR_NAMES, NAMESPACES
from tulip_strategy.game_input import GameInputParameters
from tulip_strategy.strategy_node import StrategyNodeParameters
from tulip_vision.pipeline import VisionParameters
from tulip_worldmodel.worldmodel_node import WorldModelNodeParameters

START = ("start_x", "start_y", "start_yaw")
NODES = ("vision", "worldmodel", "strategy", "head", "game_input")

Values = Mapping[str, Any]


@dataclass(frozen=True)
class RobotParameters:
    """Parameters of the components of one robot.

    Attributes:
        start: Where it was told to stand, or None where nobody noted it.
        field: As its team sees it.
        forgotten: Names of parameters that the recording notes and today's components do not have.
        noted: Names of the nodes whose parameters the recording notes.
    """

    vision: VisionParameters = dataclasses.field(default_factory=VisionParameters)
    worldmodel: WorldModelNodeParameters = dataclasses.field(default_factory=WorldModelNodeParameters)
    strategy: StrategyNodeParameters = dataclasses.field(default_factory=StrategyNodeParameters)
    head: HeadParameters = dataclasses.field(default_factory=HeadParameters)
    game_input: GameInputParameters = dataclasses.field(default_factory=GameInputParameters)
    start: Pose2D | None = None
    field: Field = dataclasses.field(default_factory=load_field)
    forgotten: tuple[str, ...] = ()
    noted: frozenset[str] = frozenset()


def parameters_of(log: Log, namespace: str, files: Sequence[Path] = ()) -> RobotParameters:
    """Return the parameters of a recorded robot.

    The defaults of the code, then what the recording notes, then the user's files; later ones win.

    Args:
        log: The recording.
        namespace: Of the robot, as in "striker", or "".
        files: YAML files as nodes take them.

    Raises:
        BadInputError: if a file or a note cannot be used.
    """
    values: dict[str, dict[str, Any]] = {name: {} for name in NODES}
    if namespace == NAMESPACES[1]:  # of a match's two robots the second attacks the other goal, in the other colour
        values["worldmodel"]["field_turned"] = values["strategy"]["field_turned"] = True
        values["vision"]["opponents.team_colour"] = COLOUR_NAMES[1]
    defaults = RobotParameters()
    every, forgotten = noted(log), []
    recorded = {name: every[full] for name in NODES if (full := f"{namespace}/{name}" if namespace else name) in every}
    for name, block in recorded.items():
        known = parameters.flatten(getattr(defaults, name))
        for key, value in block.items():
            if key in known:
                values[name][key] = value
            elif name != "game_input":  # of its node only a part is needed here
                forgotten.append(f"{name}.{key}")
    for path in files:
        layer = plan.as_parameters(plan.read_yaml(path) or {}, str(path), [namespace] if namespace else [])
        for name in NODES:
            for key in dict.fromkeys((plan.EVERY_NODE, name, f"{namespace}/{name}" if namespace else name)):
                values[name].update(flattened(layer.get(key, {})))
    made: dict[str, Any] = {name: parameters.replace(getattr(defaults, name), values[name], name) for name in NODES}
    p = made["worldmodel"]
    start = Pose2D(p.start_x, p.start_y, p.start_yaw) if any(name in values["worldmodel"] for name in START) else None
    return replace(
        defaults, **made, start=start, field=field_of(p), forgotten=tuple(forgotten), noted=frozenset(recorded)
    )


def field_of(p: WorldModelNodeParameters) -> Field:
    """Return the field as the robot's team sees it.

    Raises:
        BadInputError: if its file cannot be used.
    """
    try:
        playing_field = load_field(p.field_file or None)
    except FieldError as error:
        raise BadInputError(f"Parameter field_file of node 'worldmodel': {error}") from error
    return playing_field.turned() if p.field_turned else playing_field


def noted(log: Log) -> dict[str, dict[str, Any]]:
    """Return the parameters that a recording's nodes had, by full node name, without those that are ROS's own.

    Raises:
        BadInputError: if the recording's files of parameters are no such YAML.
    """
    return {
        node: {str(name): value for name, value in block.items() if not _is_of_ros(str(name))}
        for node, block in log_notes.parameters_of(log).items()
    }


def _is_of_ros(name: str) -> bool:
    return name in parameters.ROS_NAMES or name.startswith("qos_overrides.")


def flattened(block: Values, prefix: str = "") -> dict[str, Any]:
    """Return nested values by dotted names."""
    result: dict[str, Any] = {}
    for key, value in block.items():
        if isinstance(value, Mapping):
            result.update(flattened(value, f"{prefix}{key}."))
        else:
            result[f"{prefix}{key}"] = value
    return result
