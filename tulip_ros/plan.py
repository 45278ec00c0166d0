"""What to launch: from the names and files that a user gives to one command line a node."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from tulip_description.yaml_file import read_start
from tulip_description.yaml_text import DEEPEST, load_yaml
from tulip_ros.errors import BadInputError, unknown
from tulip_ros.nodes import DRIVERS, NODES, ROBOT, NodeEntry, find_driver, find_node

Values = Mapping[str, Any]
EVERY_NODE = "/**"
NAMESPACE = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*")
SIMULATED = frozenset({"sim", "mujoco", "match", "log", "wire"})
"""Drivers that publish /clock, which the other nodes follow then."""


@dataclass(frozen=True)
class Start:
    """One node to start.

    Attributes:
        name: Name in the graph.
        entry: Which program it is.
        parameters: Values that differ from those in the code, nested as in YAML.
        namespace: As in "striker", or "".
        renamed: Topics that this node knows by another name: its own name for it, and the name in the graph.
    """

    name: str
    entry: NodeEntry
    parameters: Values
    namespace: str
    renamed: tuple[tuple[str, str], ...] = ()

    @property
    def full_name(self) -> str:
        """Name with namespace, as in "striker/vision"."""
        return f"{self.namespace}/{self.name}" if self.namespace else self.name

    def command(self, parameter_file: Path) -> list[str]:
        """Write the parameters to a file and return the command line that uses it."""
        parameter_file.write_text(yaml.safe_dump({EVERY_NODE: {"ros__parameters": dict(self.parameters)}}))
        command = [sys.executable, "-m", self.entry.module, "--ros-args", "--params-file", str(parameter_file)]
        if self.namespace:
            command += ["-r", f"__ns:=/{self.namespace}"]
        for own, name in self.renamed:
            command += ["-r", f"{own}:={name}"]
        return command


def make_plan(
    nodes: Sequence[str] = (),
    driver: str | None = "sim",
    namespace: str = "",
    parameter_files: Sequence[Path] = (),
    values: Mapping[str, Values] | None = None,
    simulated: bool | None = None,
) -> tuple[Start, ...]:
    """Return the nodes to start, in order.

    Args:
        nodes: Names of nodes; none means the whole robot.
        driver: Name of the driver or package.module:Class of a body, or None for no driver.
        namespace: For all nodes, as in "striker".
        parameter_files: YAML files, later ones win.
        values: Parameters by node name, which win over the files.
        simulated: Whether the nodes follow /clock; None: they do if the driver publishes it.

    Raises:
        BadInputError: for an unknown name, a bad namespace, or a file that cannot be used.
    """
    follows = driver in SIMULATED if simulated is None else simulated
    entries = [find_driver(driver)] if driver else []
    entries += [find_node(name) for name in dict.fromkeys(nodes or ROBOT)]
    entries.sort(key=lambda entry: entry.name != "recorder")  # starts first, so that it misses nothing
    namespace = check_namespace(namespace)
    given: list[Mapping[str, Values]] = [read_parameters(path) for path in parameter_files]
    if values:
        given.append(values)
    starts = []
    for entry in entries:
        merged: dict[str, Any] = {"use_sim_time": follows and entry.name != "driver"}
        own = entry.default_parameters
        for layer in ([read_parameters(own)] if own else []) + given:
            merge(merged, layer.get(EVERY_NODE, {}))
            merge(merged, layer.get(entry.name, {}))
        merge(merged, dict(entry.parameters))
        starts.append(Start(entry.name, entry, merged, namespace))
    return tuple(starts)


def check_namespace(namespace: str) -> str:
    """Return a namespace without slashes around it.

    Raises:
        BadInputError: if ROS would not take it.
    """
    namespace = namespace.strip("/")
    if namespace and not NAMESPACE.fullmatch(namespace):
        raise BadInputError(f"Namespace is {namespace!r}; expected letters, digits and _, as in striker.")
    return namespace


def read_parameters(path: Path) -> dict[str, Values]:
    """Read a parameter file: `node: {name: value}`, or ROS's form with ros__parameters in between.

    Raises:
        BadInputError: if it cannot be read, is no such YAML, or names a node that does not exist.
    """
    content = read_yaml(path)
    return {} if content is None else as_parameters(content, str(path))


def read_yaml(path: Path) -> Any:
    """Read a file of parameters, in YAML or JSON.

    Raises:
        BadInputError: if it cannot be read or is no such file.
    """
    try:
        return load_yaml(read_start(path).decode())
    except OSError as error:
        raise BadInputError(f"Parameter file {path} cannot be read: {error.strerror}.") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise BadInputError(f"Parameter file {path} is no valid YAML: {_what_is_wrong(error)}.") from error


def as_parameters(content: Any, where: str, namespaces: Sequence[str] = ()) -> dict[str, Values]:
    """Return parameters by node.

    Args:
        content: As in a parameter file.
        where: That file, for messages.
        namespaces: Those that are kept before the names of nodes, as in "keeper/strategy"; others are dropped.

    Raises:
        BadInputError: if it does not name nodes and values.
    """
    if not isinstance(content, dict):
        raise BadInputError(f"Parameter file {where} holds {type(content).__name__}; expected `node: {{name: value}}`.")
    result: dict[str, Values] = {}
    for key, block in content.items():
        namespace, _, name = ("", "", EVERY_NODE) if key == EVERY_NODE else str(key).strip("/").rpartition("/")
        if name not in (EVERY_NODE, "driver", *NODES):
            raise unknown(f"node in {where} called", str(key), [*NODES, "driver", EVERY_NODE])
        if isinstance(block, dict) and set(block) == {"ros__parameters"}:
            block = block["ros__parameters"]
        if not isinstance(block, dict):
            raise BadInputError(f"Parameter file {where}: {key} holds {block!r}; expected `name: value` lines.")
        result[f"{namespace}/{name}" if namespace in namespaces else name] = block
    return result


def _what_is_wrong(error: yaml.YAMLError | UnicodeDecodeError) -> str:
    """Return a parser's complaint in one line."""
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        mark = error.problem_mark
        return f"{error.problem} in line {mark.line + 1}, column {mark.column + 1}"
    return " ".join(str(error).split())


def merge(values: dict[str, Any], newer: Values, level: int = 1) -> None:
    """Put newer values over older ones; nested blocks are merged, dotted names are blocks.

    Raises:
        BadInputError: if names have more parts than any parameter.
    """
    for key, value in newer.items():
        *blocks, name = str(key).split(".")
        if level + len(blocks) > DEEPEST:
            raise BadInputError(f"Parameter {str(key)[:100]}... has too many parts; expected at most {DEEPEST}.")
        target = values
        for block in blocks:
            target = _block(target, block)
        if isinstance(value, Mapping):
            merge(_block(target, name), value, level + len(blocks) + 1)
        else:
            target[name] = value


def _block(values: dict[str, Any], name: str) -> dict[str, Any]:
    """Return the block of a name; it takes the place of a value of that name."""
    block = values.get(name)
    if not isinstance(block, dict):
        block = values[name] = {}
    return block


def known_names() -> str:
    """Return all names of nodes and drivers, for help texts."""
    return f"nodes: {', '.join(NODES)}; drivers: {', '.join(DRIVERS)}, or package.module:Class"
