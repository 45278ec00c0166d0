"""The body file: masses, CoMs and inertias that an identification found, with where they come from."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from tulip_description.pseudo_inertia import why_impossible
from tulip_description.robot import Link, Robot, Vector
from tulip_description.yaml_file import read_yaml, write_lines

Array = NDArray[np.float64]
VERSION = 1
HEAD = """\
# Masses [kg], CoMs [m] in the links' frames, and principal moments about the CoMs [kg m^2] of a robot's links. They
# take the place of those of robot.yaml: load_robot(body=...), and the parameter body_file of motion control.
# Static postures and motion tell the base parameters [m], by the whole mass, with their covariance [m^2]; model_error
# [m] is what they leave of each CoP. How they are shared among links is the most probable way beside robot.yaml;
# inertias are robot.yaml's, scaled by the masses. See docs/identification.md."""


class BodyFileError(ValueError):
    """A body file cannot be used; the message says why."""


@dataclass(frozen=True)
class BodySource:
    """Where a body comes from.

    Attributes:
        recording: The log that was fitted.
        date: Of the experiment, as in 2013-06-24.
        postures: How many static postures it was fitted to; 0 for motion.
    """

    recording: str
    date: str
    postures: int


@dataclass(frozen=True)
class Body:
    """What a body file holds.

    Attributes:
        variant: Of the robot.
        source: Where it comes from.
        links: Of all links name, mass [kg], CoM [m], and principal moments about the CoM along its axes [kg m^2].
        base_names: The r combinations that were identified, in words.
        base_values: (r,) these, by the whole mass [m]; the last, the sum of masses, is 1.
        base_covariance: (r, r) [m^2].
        model_error: What the fit left of each CoP beside the cells' noise, standard deviation [m].
    """

    variant: str
    source: BodySource
    links: tuple[tuple[str, float, Vector, Vector], ...]
    base_names: tuple[str, ...]
    base_values: Array
    base_covariance: Array
    model_error: float

    def on(self, robot: Robot) -> Robot:
        """Return a robot with this body; kinematics, limits and shapes stay its own.

        Raises:
            BodyFileError: if it is not of this variant or has not these links.
        """
        mine, theirs = [name for name, *_ in self.links], [link.name for link in robot.links]
        if self.variant != robot.variant or mine != theirs:
            raise BodyFileError(
                f"the body is of a robot {self.variant} with links {', '.join(mine)}; expected {robot.variant} with"
                f" {', '.join(theirs)}"
            )
        changed = (
            replace(link, mass=mass, com=com, inertia=inertia)
            for link, (_, mass, com, inertia) in zip(robot.links, self.links, strict=True)
        )
        return replace(robot, links=tuple(changed))


def links_of(links: Sequence[Link]) -> tuple[tuple[str, float, Vector, Vector], ...]:
    """Return what a `Body` keeps of links."""
    return tuple((link.name, link.mass, link.com, link.inertia) for link in links)


def write_body(path: Path, body: Body) -> None:
    """Write a body file; one that was there stays whole until the new one is. Its folder is made.

    Raises:
        BodyFileError: if it cannot be written.
    """
    content = {
        "version": VERSION,
        "variant": body.variant,
        "source": asdict(body.source),
        "links": {
            name: {"mass": mass, "com": list(com), "inertia": list(inertia)} for name, mass, com, inertia in body.links
        },
        "base_parameters": [
            {"value": value, "is": name} for name, value in zip(body.base_names, body.base_values.tolist(), strict=True)
        ],
        "base_covariance": body.base_covariance.tolist(),
        "model_error": body.model_error,
    }
    text = yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=math.inf)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_lines(path, (HEAD, text.rstrip()))
    except OSError as error:
        raise BodyFileError(f"{path} cannot be written: {error.strerror}") from error


def read_body(path: Path) -> Body:
    """Read a body file.

    Raises:
        BodyFileError: if it cannot be read, something is missing or wrong, or a link's body cannot be.
    """
    data = read_yaml(path, BodyFileError)
    try:
        return _body(data)
    except _WrongError as error:
        raise BodyFileError(f"{path}: {error}") from error


class _WrongError(Exception):
    """Something is missing or wrong."""


def _body(data: Any) -> Body:
    version = _get(data, "version", "the file")
    if version != VERSION:
        raise _WrongError(f"version is {version!r}; expected {VERSION}")
    variant = _get(data, "variant", "the file")
    links = []
    for name, entry in _mapping(data, "links", "the file").items():
        where = f"links, {name}"
        (mass,) = _numbers([_get(entry, "mass", where)], 1, f"{where}: mass")
        com = _vector(entry, "com", where)
        inertia = _vector(entry, "inertia", where)
        reason = why_impossible(mass, com, inertia)
        if reason:
            raise _WrongError(f"{where}: {reason}")
        links.append((str(name), mass, com, inertia))
    source = _mapping(data, "source", "the file")
    base = _get(data, "base_parameters", "the file")
    rows = _get(data, "base_covariance", "the file")
    if not isinstance(base, list) or not isinstance(rows, list) or len(rows) != len(base):
        raise _WrongError("base_parameters and base_covariance are expected to be lists of one length")
    covariance = np.array([_numbers(row, len(base), "base_covariance") for row in rows]).reshape(len(base), len(base))
    (model_error,) = _numbers([_get(data, "model_error", "the file")], 1, "model_error")
    if model_error < 0.0:
        raise _WrongError(f"model_error is {model_error} m; expected >= 0")
    rounding = 1e-9 * np.abs(covariance).max(initial=0.0)
    asymmetry = np.abs(covariance - covariance.T).max(initial=0.0)
    if asymmetry > rounding or np.linalg.eigvalsh(covariance).min(initial=0.0) < -rounding:
        raise _WrongError("base_covariance is not symmetric and positive semidefinite")
    return Body(
        variant=str(variant),
        source=_source(source),
        links=tuple(links),
        base_names=tuple(str(_get(entry, "is", "base_parameters")) for entry in base),
        base_values=np.array(
            [_numbers([_get(entry, "value", "base_parameters")], 1, "base_parameters: value")[0] for entry in base]
        ),
        base_covariance=covariance,
        model_error=model_error,
    )


def _source(entry: Mapping[str, Any]) -> BodySource:
    recording, day, postures = (_get(entry, key, "source") for key in ("recording", "date", "postures"))
    try:
        date.fromisoformat(str(day))
    except ValueError:
        raise _WrongError(f"source: date is {day!r}; expected as in 2013-06-24") from None
    if not isinstance(postures, int) or isinstance(postures, bool) or postures < 0:
        raise _WrongError(f"source: postures is {postures!r}; expected a count")
    return BodySource(str(recording), str(day), postures)


def _get(entry: Any, key: str, where: str) -> Any:
    if not isinstance(entry, Mapping):
        raise _WrongError(f"{where} is {reprlib.repr(entry)}; expected a mapping")
    if key not in entry:
        raise _WrongError(f"{where}: {key} is missing")
    return entry[key]


def _mapping(entry: Any, key: str, where: str) -> Mapping[str, Any]:
    value = _get(entry, key, where)
    if not isinstance(value, Mapping):
        raise _WrongError(f"{where}: {key} is {value!r}; expected a mapping")
    return value


def _vector(entry: Any, key: str, where: str) -> Vector:
    x, y, z = _numbers(_get(entry, key, where), 3, f"{where}: {key}")
    return x, y, z


def _numbers(values: Any, count: int, where: str) -> list[float]:
    good = isinstance(values, list) and len(values) == count
    if not good or not all(isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in values):
        shown = values[0] if count == 1 and isinstance(values, list) else values
        raise _WrongError(f"{where} is {shown!r}; expected {'a number' if count == 1 else f'{count} numbers'}")
    return [float(value) for value in values]
