"""With which parameters a recorded robot played, as far as the recording or the user tells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from tulip_description.field import Field, FieldError, load_field
from tulip_description.planar import Pose2D
from tulip_motion.head import HeadParameters
from tulip_ros import parameters, plan
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_sim.match_rules import COLOUR_NAMES, NAMESPACES
from tulip_strategy.game_input import GameInputParameters
from tulip_strategy.strategy_node import StrategyNodeParameters
from tulip_vision.pipeline import VisionParameters
from tulip_worldmodel.worldmodel_node import WorldModelNodeParameters

START = ("start_x", "start_y", "start_yaw")
NOTE = "parameters"
"""Name of the metadata that hold parameters: by full node name, a YAML text of each."""

Values = Mapping[str, Any]


@dataclass(frozen=True)
class RobotParameters:
    """Parameters of the components of one robot.

    Attributes:
        start: Where it was told to stand, or None where nobody noted it.
        field: As its team sees it.
    """

    vision: VisionParameters = field(default_factory=VisionParameters)
    worldmodel: WorldModelNodeParameters = field(default_factory=WorldModelNodeParameters)
    strategy: StrategyNodeParameters = field(default_factory=StrategyNodeParameters)
    head: HeadParameters = field(default_factory=HeadParameters)
    game_input: GameInputParameters = field(default_factory=GameInputParameters)
    start: Pose2D | None = None
    field: Field = field(default_factory=load_field)


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
    values: dict[str, dict[str, Any]] = {}
    if namespace == NAMESPACES[1]:  # of a match's two robots the second attacks the other goal, in the other colour
        plan.merge(values, {"worldmodel": {"field_turned": True}, "strategy": {"field_turned": True}})
        plan.merge(values, {"vision": {"opponents": {"team_colour": COLOUR_NAMES[1]}}})
    for layer in (noted(log), *(plan.as_parameters(plan.read_yaml(path) or {}, str(path), [namespace]) for path in files)):
        for name in ("vision", "worldmodel", "strategy", "head", "game_input"):
            for key in dict.fromkeys((plan.EVERY_NODE, name, f"{namespace}/{name}" if namespace else name)):
                plan.merge(values.setdefault(name, {}), layer.get(key, {}))
    flat = {name: flattened(block) for name, block in values.items()}
    for block in flat.values():
        block.pop("use_sim_time", None)
    defaults = RobotParameters()
    start = None
    if any(name in flat.get("worldmodel", {}) for name in START):
        p = parameters.replace(defaults.worldmodel, flat["worldmodel"], "worldmodel")
        start = Pose2D(p.start_x, p.start_y, p.start_yaw)
    known = set(parameters.flatten(defaults.game_input))
    flat["game_input"] = {key: value for key, value in flat.get("game_input", {}).items() if key in known}
    made: dict[str, Any] = {
        name: parameters.replace(getattr(defaults, name), flat.get(name, {}), name)
        for name in ("vision", "worldmodel", "strategy", "head", "game_input")
    }
    return replace(defaults, **made, start=start, field=field_of(made["worldmodel"]))


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
    """Return the parameters that a recording notes, by full node name.

    Raises:
        BadInputError: if a note is no YAML.
    """
    found: dict[str, dict[str, Any]] = {}
    for node, text in log.metadata.get(NOTE, {}).items():
        try:
            block = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise BadInputError(
                f"Recording {log.path} notes parameters of node {node} that are no YAML; give them by --parameters."
            ) from error
        found[node.strip("/")] = block if isinstance(block, dict) else {}
    return found


def flattened(block: Values, prefix: str = "") -> dict[str, Any]:
    """Return nested values by dotted names."""
    result: dict[str, Any] = {}
    for key, value in block.items():
        if isinstance(value, Mapping):
            result.update(flattened(value, f"{prefix}{key}."))
        else:
            result[f"{prefix}{key}"] = value
    return result
