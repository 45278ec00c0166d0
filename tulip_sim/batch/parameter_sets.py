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
from tulip_sim.parameters import WorldParameters
from tulip_sim.perception import PerceptionParameters
from tulip_sim.referee import RefereeParameters

S = TypeVar("S")

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


def read_sets(path: Path, base: S, change: Callable[[Mapping[str, Values], S], S]) -> dict[str, S]:
    """Read a file of named parameter sets.

    Args:
        path: YAML or JSON.
        base: Settings that the sets change.
        change: Returns settings with some parameters changed, given by node and name, as `make_settings` does.

    Raises:
        BadInputError: if the file cannot be read or holds no set, or for an unknown node, name or value.
    """
    content = read_yaml(path)
    if not isinstance(content, dict) or not content:
        raise BadInputError(f"File of parameter sets {path} holds no set; expected `set: {{node: {{name: value}}}}`.")
    return {
        str(name): change(as_parameters({} if blocks is None else blocks, f"{path}, set {name}"), base)
        for name, blocks in content.items()
    }


def make_settings(values: Mapping[str, Values], base: Settings) -> Settings:
    """Return settings with some parameters changed.

    Args:
        values: By node and name; nested blocks and dotted names are the same.
        base: What they change.

    Raises:
        BadInputError: for a node without parameters here, an unknown name or a value that does not fit.
    """
    settings = base
    for node, block in values.items():
        own = dict(_flat(block))
        if node == "driver":
            driver = parameters.replace(_Driver(settings.world, settings.camera, settings.referee), own, node)
            settings = replace(settings, world=driver.world, camera=driver.pictures, referee=driver.rules)
        elif node == "perception" and settings.perception is not None:
            perception = parameters.replace(_Perception(settings.perception), own, node)
            settings = replace(settings, perception=perception.quality)
        elif node in CORES:
            settings = replace(settings, **{node: parameters.replace(getattr(settings, node), own, node)})
        else:
            known = ["driver", *CORES] + (["perception"] if settings.perception is not None else [])
            raise unknown("node with parameters in lockstep called", node, known)
    return settings


def _flat(block: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in block.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
