"""Named parameter sets: a file of `set: {node: {name: value}}`, addressed as the graph's parameter files are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from tulip_ros import parameters
from tulip_ros.errors import BadInputError, unknown
from tulip_ros.plan import Values, as_parameters, read_yaml
from tulip_sim.camera import CameraParameters
from tulip_sim.lockstep import Settings
from tulip_sim.match_rules import NAMESPACES, MatchRules
from tulip_sim.match_settings import MatchSettings
from tulip_sim.parameters import WorldParameters
from tulip_sim.perception import PerceptionParameters
from tulip_sim.referee import RefereeParameters
from tulip_sim.robot_stack import RobotSettings

S = TypeVar("S")
R = TypeVar("R", bound=RobotSettings)

DEFAULT = "default"
"""The set that a batch plays without a file."""
CORES = ("vision", "worldmodel", "motion", "head", "strategy", "game_input")
"""Nodes whose parameters are a part of `Settings` of the same name."""


@dataclass(frozen=True)
class _Driver:
    """The parameters of node driver that mean something without a graph, under the names that they have there."""

    world: WorldParameters
    pictures: CameraParameters
    rules: RefereeParameters


@dataclass(frozen=True)
class _Perception:
    """The same of node perception."""

    quality: PerceptionParameters


@dataclass(frozen=True)
class _MatchDriver:
    """The same of the node driver of a match."""

    world: WorldParameters
    pictures: CameraParameters
    rules: MatchRules
    striker: str
    keeper: str


def read_sets(path: Path, base: S, change: Callable[[Mapping[str, Values], S], S]) -> dict[str, S]:
    """Read a file of named parameter sets.

    Args:
        path: YAML or JSON.
        base: Settings that the sets change.
        change: Returns settings with some parameters changed, given by node and name: `make_settings` for a trial,
            `make_match_settings` for a match.

    Raises:
        BadInputError: if the file cannot be read or holds no set, or for an unknown node, name or value.
    """
    content = read_yaml(path)
    if not isinstance(content, dict) or not content:
        raise BadInputError(f"File of parameter sets {path} holds no set; expected `set: {{node: {{name: value}}}}`.")
    return {
        str(name): change(as_parameters({} if blocks is None else blocks, f"{path}, set {name}", NAMESPACES), base)
        for name, blocks in content.items()
    }


def make_settings(values: Mapping[str, Values], base: Settings) -> Settings:
    """Return the settings of a trial with some parameters changed.

    Args:
        values: By node and name, the node with or without a robot's namespace; nested blocks and dotted names are the
            same.
        base: What they change.

    Raises:
        BadInputError: for a node without parameters here, an unknown name or a value that does not fit.
    """
    settings = base
    for name, block in values.items():
        node, own = name.rpartition("/")[2], dict(_flat(block))
        if node == "driver":
            driver = parameters.replace(_Driver(settings.world, settings.camera, settings.referee), own, node)
            settings = replace(settings, world=driver.world, camera=driver.pictures, referee=driver.rules)
        else:
            settings = _changed(settings, node, own)
    return settings


def make_match_settings(values: Mapping[str, Values], base: MatchSettings) -> MatchSettings:
    """Return the settings of a match with some parameters changed.

    Args:
        values: As for `make_settings`; of one robot alone with its namespace, "striker" for the first one and "keeper"
            for the second as in the graph, else of both.
        base: What they change.

    Raises:
        BadInputError: as `make_settings`, and if a robot shall have a driver of its own.
    """
    settings = base
    for name, block in sorted(values.items(), key=lambda item: "/" in item[0]):  # what is said of one robot alone wins
        namespace, _, node = name.rpartition("/")
        own = dict(_flat(block))
        if node == "driver" and namespace:
            raise BadInputError(f"{name}: the two robots share one simulator; expected `driver` without a namespace.")
        if node == "driver":
            s = settings
            given = _MatchDriver(s.world, s.robots[0].camera, s.rules, s.striker, s.keeper)
            d = parameters.replace(given, own, node)
            first, second = (replace(robot, camera=d.pictures) for robot in s.robots)
            settings = MatchSettings(d.world, d.rules, (first, second), d.striker, d.keeper)
        else:
            first, second = (
                _changed(robot, node, own) if namespace in ("", NAMESPACES[team]) else robot
                for team, robot in enumerate(settings.robots)
            )
            settings = replace(settings, robots=(first, second))
    return settings


def _changed(settings: R, node: str, own: Mapping[str, Any]) -> R:
    """Return a robot's settings with some parameters of one of its nodes changed."""
    if node == "perception" and settings.perception is not None:
        perception = parameters.replace(_Perception(settings.perception), own, node)
        return replace(settings, perception=perception.quality)
    if node in CORES:
        return replace(settings, **{node: parameters.replace(getattr(settings, node), own, node)})
    known = ["driver", *CORES] + (["perception"] if settings.perception is not None else [])
    raise unknown("node with parameters in lockstep called", node, known)


def _flat(block: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in block.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
