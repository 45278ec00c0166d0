"""What makes a recording explain itself: which program wrote it, with which parameters, for which robot."""

from __future__ import annotations

import platform
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any, Protocol

import yaml

import tulip_description
import tulip_motion
import tulip_vision
from tulip_description.yaml_text import load_yaml
from tulip_ros import parameters
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log

RECORDING, LOST = "recording", "lost messages"
"""Notes: how the recording came to be; how many messages were lost before the recorder, by topic."""
PARAMETERS = "parameters/"
"""Begins the names of attached parameter files, as in parameters/striker/vision.yaml."""
PACKAGES = (
    *("tulip-soccer", "ros-jazzy-rclpy", "ros-rmw-fastrtps-cpp", "mcap", "numpy", "scipy", "pin", "filterpy", "numba"),
    *("opencv-python-headless", "pybullet", "mujoco", "py_trees"),
)
FILES = (
    (tulip_description, ("robot.yaml", "field.yaml", "camera_mount.yaml")),
    (tulip_motion, ("gait.yaml",)),
    (tulip_vision, ("colours.yaml",)),
)
"""What is attached: the files that robot and field are read from."""


class Notebook(Protocol):
    """What takes notes: a `Bag`."""

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Write names and values."""

    def attach(self, name: str, media_type: str, data: bytes, moment: int = 0) -> None:
        """Write a file."""


def explain(bag: Notebook, own: Mapping[str, str]) -> None:
    """Note the program's versions, and attach the files of robot and field.

    Args:
        bag: A recording that was begun.
        own: What else there is to say, as in {"seed": "1"}.

    Raises:
        OSError: if the recording cannot be written.
    """
    bag.note(RECORDING, {**own, "begun": datetime.now(UTC).isoformat(timespec="seconds"), **versions()})
    for package, names in FILES:
        for name in names:
            path = Path(str(package.__file__)).with_name(name)
            if path.exists():
                bag.attach(name, "text/yaml", path.read_bytes())


def versions() -> dict[str, str]:
    """Return git revision, whether files differ from it, and versions of Python and of the packages that matter."""
    found = {"git revision": "none: not run from a git working tree", "python": platform.python_version()}
    root = Path(__file__).resolve().parent.parent
    revision = _git(root, "rev-parse", "HEAD")
    if revision:
        found["git revision"] = revision
        found["changed files"] = _git(root, "status", "--porcelain", "--untracked-files=no") or "none"
    found["system"] = f"{platform.system()} {platform.machine()}"
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def attach_parameters(bag: Notebook, node: str, values: Mapping[str, Any], moment: int = 0) -> None:
    """Attach a node's parameters as a file that the programs read again (`--parameters`).

    Args:
        bag: A recording that was begun.
        node: Full name of the node, as in "/striker/vision".
        values: By dotted name, of the types of YAML.
        moment: When they were found [ns], or 0.

    Raises:
        OSError: if the recording cannot be written.
    """
    name = node.strip("/")
    text = yaml.safe_dump({name: dict(values)}, sort_keys=True, width=120, default_flow_style=None)
    bag.attach(f"{PARAMETERS}{name}.yaml", "text/yaml", text.encode(), moment)


def attach_settings(bag: Notebook, node: str, settings: Any = None, **others: Any) -> None:
    """Attach what a core runs with as the parameters that its node would have.

    Args:
        bag: A recording that was begun.
        node: Full name of the node, as in "/striker/vision".
        settings: Object of the core's parameters dataclass, or None.
        others: More parameters of the node; those that are dataclasses are put below their name.

    Raises:
        OSError: if the recording cannot be written.
    """
    values = {} if settings is None else parameters.plain(settings)
    for name, value in others.items():
        values.update(parameters.plain(value, f"{name}.") if hasattr(value, "__dataclass_fields__") else {name: value})
    attach_parameters(bag, node, values)


def parameters_of(log: Log) -> dict[str, dict[str, Any]]:
    """Return the parameters that a recording's nodes had, by full name of the node without the first slash.

    A node that was started again with other values has the last ones.

    Raises:
        BadInputError: if the recording's files of parameters are no such YAML.
    """
    found: dict[str, dict[str, Any]] = {}
    for each in log.attachments():
        if each.name.startswith(PARAMETERS):
            try:
                content = load_yaml(each.data)
            except yaml.YAMLError as error:
                raise _unreadable(log, each.name, " ".join(str(error).split())) from error
            if not isinstance(content, dict) or not all(isinstance(block, dict) for block in content.values()):
                raise _unreadable(log, each.name, "it is no `node: {name: value}`")
            found.update({str(node): block for node, block in content.items()})
    return found


def _unreadable(log: Log, name: str, reason: str) -> BadInputError:
    return BadInputError(
        f"Recording {log.path} holds parameters {name} that cannot be read ({reason}); expected YAML, as record.py has"
        " it."
    )


def _git(root: Path, *arguments: str) -> str:
    """Return what git says about the program's own files, or "" if it does not know them."""
    try:
        done = subprocess.run(
            ["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=10.0, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 and (root / ".git").exists() else ""
