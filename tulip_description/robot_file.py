"""Reads robot.yaml into a `Robot`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from tulip_description.frames import BASE_LINK
from tulip_description.robot import (
    CELL_NAMES,
    JOINTS,
    LEG_JOINTS,
    LEG_PARTS,
    SIDES,
    VARIANTS,
    Box,
    Foot,
    Joint,
    Link,
    Mount,
    Robot,
    Variant,
    Vector,
    realizable_inertia,
)
from tulip_description.yaml_file import read_yaml

AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
T = TypeVar("T")


def read_robot(variant: str, path: Path) -> Robot:
    """Read one variant of the robot from a parameter file; see `tulip_description.robot.load_robot`."""
    known: dict[str, Variant] = {name: name for name in VARIANTS}
    if variant not in known:
        raise ValueError(f"variant is {variant!r}; expected one of {', '.join(VARIANTS)}")
    data = read_yaml(path, ValueError)
    if not isinstance(data, dict):
        raise ValueError(
            f"{path} holds {type(data).__name__}; expected a mapping (see the robot.yaml of tulip_description)"
        )
    try:
        return _Reader(data, playing=variant == "playing").robot(known[variant])
    except _BadValueError as error:
        raise ValueError(f"{path}: {error}") from error


class _BadValueError(Exception):
    """A value of the file is missing or wrong."""


class _Reader:
    def __init__(self, data: Mapping[str, Any], playing: bool) -> None:
        self.data = data
        self.playing = playing

    def robot(self, variant: Variant) -> Robot:
        links = [self._trunk()]
        joints: list[Joint] = []
        for side in SIDES:
            self._leg(side, links, joints)
        if self.playing:
            self._head(links, joints)
            self._upper_body(links, joints)
        foot = _get(self.data, "foot", "the file", dict)
        sole = _vector(foot, "sole", "foot")
        imu = _get(self.data, "imu", "the file", dict)
        camera = _get(self.data, "camera", "the file", dict)
        robot = Robot(
            variant=variant,
            links=tuple(links),
            joints=tuple(joints),
            soles=(Mount("left_foot", sole), Mount("right_foot", _mirrored(sole))),
            feet=(self._foot(foot, 1.0), self._foot(foot, -1.0)),
            imu=Mount(_get(imu, "link", "imu", str), _vector(imu, "origin", "imu")),
            camera=Mount(_get(camera, "link", "camera", str), _vector(camera, "origin", "camera"))
            if self.playing
            else None,
        )
        expected = JOINTS if self.playing else LEG_JOINTS
        if robot.joint_names != expected:
            raise _BadValueError(f"the joints are {', '.join(robot.joint_names)}; expected {', '.join(expected)}")
        names = {link.name for link in links}
        for what, mount in (("imu", robot.imu), ("camera", robot.camera)):
            if mount is not None and mount.link not in names:
                raise _BadValueError(f"{what}: link is {mount.link!r}; expected one of {', '.join(sorted(names))}")
        return robot

    def _trunk(self) -> Link:
        boxes = list(self._shapes("trunk", mirror=False))
        if self.playing:
            marker = _get(self.data, "marker", "the file", dict)
            boxes.append(Box(_vector(marker, "box", "marker"), _vector(marker, "centre", "marker"), "marker", False))
        return self._body(BASE_LINK, "trunk", tuple(boxes), mirror=False)

    def _leg(self, side: str, links: list[Link], joints: list[Joint]) -> None:
        mirror = side == "right"
        parent = BASE_LINK
        entries = _get(self.data, "leg", "the file", list)
        velocity = _number(self.data, "leg_velocity", "the file")
        for expected, entry in zip(LEG_PARTS, entries, strict=False):
            where = f"leg, joint {expected}"
            if not isinstance(entry, dict) or entry.get("joint") != expected:
                raise _BadValueError(
                    f"{where}: found {entry!r}; expected the leg's joints in the order {', '.join(LEG_PARTS)}"
                )
            part = _get(entry, "child", where, str)
            joint = _joint(entry, f"{side}_{expected}", parent, f"{side}_{part}", velocity, where)
            if mirror:
                joint = _mirrored_joint(joint)
            boxes = self._foot_boxes() if part == "foot" else self._shapes(part, mirror)
            joints.append(joint)
            links.append(self._body(joint.child, part, boxes, mirror))
            parent = joint.child

    def _head(self, links: list[Link], joints: list[Joint]) -> None:
        parent = BASE_LINK
        for entry in _get(self.data, "head", "the file", list):
            where = f"head, joint {entry.get('joint') if isinstance(entry, dict) else entry!r}"
            child = _get(entry, "child", where, str)
            velocity = _number(entry, "velocity", where)
            joints.append(_joint(entry, _get(entry, "joint", where, str), parent, child, velocity, where))
            links.append(_solid(child, _get(entry, "body", where, dict), (0.0, 0.0, 0.0), where))
            parent = child

    def _upper_body(self, links: list[Link], joints: list[Joint]) -> None:
        for key, entry in _get(self.data, "upper_body", "the file", dict).items():
            name = str(key)
            com = _vector(entry, "com", f"upper_body, {name}")
            joints.append(Joint(f"{name}_mount", BASE_LINK, name, com))
            links.append(_solid(name, entry, com, f"upper_body, {name}"))

    def _body(self, name: str, part: str, boxes: tuple[Box, ...], mirror: bool) -> Link:
        where = f"bodies, {part}"
        entry = _get(_get(self.data, "bodies", "the file", dict), part, "bodies", dict)
        com, inertia = _vector(entry, "com", where), _vector(entry, "inertia", where)
        mass = _number(entry, "mass", where)
        if mass <= 0.0 or min(inertia) <= 0.0:
            raise _BadValueError(f"{where}: mass is {mass} kg, inertia is {inertia} kg m^2; expected all > 0")
        if self.playing:
            inertia = realizable_inertia(inertia)
        return Link(name, mass, _mirrored(com) if mirror else com, inertia, boxes)

    def _shapes(self, part: str, mirror: bool) -> tuple[Box, ...]:
        boxes = []
        for entry in _get(_get(self.data, "shapes", "the file", dict), part, "shapes", list):
            where = f"shapes, {part}"
            centre = _vector(entry, "centre", where)
            colour = _get(entry, "colour", where, str)
            collides = bool(entry.get("collides", True))
            boxes.append(Box(_vector(entry, "box", where), _mirrored(centre) if mirror else centre, colour, collides))
        return tuple(boxes)

    def _foot_boxes(self) -> tuple[Box, ...]:
        foot = _get(self.data, "foot", "the file", dict)
        (x0, x1), (y0, y1) = _pair(foot, "x", "foot"), _pair(foot, "y", "foot")
        height = _number(self.data, "foot_height", "the file")
        sole = _vector(foot, "sole", "foot")
        centre = (sole[0] + (x0 + x1) / 2, sole[1] + (y0 + y1) / 2, sole[2] + height / 2)
        return (Box((x1 - x0, y1 - y0, height), centre, "black", True),)

    def _foot(self, foot: Mapping[str, Any], side: float) -> Foot:
        entry = _get(foot, "cells", "foot", dict)
        cells = [_pair(entry, name, "foot, cells") for name in CELL_NAMES]
        y = sorted(side * value for value in _pair(foot, "y", "foot"))
        return Foot(_pair(foot, "x", "foot"), (y[0], y[1]), tuple((cell[0], side * cell[1]) for cell in cells))


def _joint(entry: Mapping[str, Any], name: str, parent: str, child: str, velocity: float, where: str) -> Joint:
    axis = _get(entry, "axis", where, str)
    if axis not in AXES:
        raise _BadValueError(f"{where}: axis is {axis!r}; expected x, y or z")
    lower, upper = _pair(entry, "range", where)
    effort = _number(entry, "effort", where)
    if not lower < upper or effort <= 0.0 or velocity <= 0.0:
        raise _BadValueError(
            f"{where}: range is [{lower}, {upper}] rad, effort {effort} N m, velocity {velocity} rad/s;"
            " expected lower < upper and positive limits"
        )
    return Joint(name, parent, child, _vector(entry, "origin", where), AXES[axis], lower, upper, velocity, effort)


def _mirrored_joint(joint: Joint) -> Joint:
    """Mirror in the xz plane: rotations about x and z change their sign, so their ranges swap."""
    lower, upper = joint.lower, joint.upper
    if joint.axis[1] == 0.0:
        lower, upper = -upper, -lower
    origin = _mirrored(joint.origin)
    return Joint(joint.name, joint.parent, joint.child, origin, joint.axis, lower, upper, joint.velocity, joint.effort)


def _solid(name: str, entry: Mapping[str, Any], origin: Vector, where: str) -> Link:
    """Make a homogeneous box. Its frame lies at `origin`, in the frame in which the file gives its CoM."""
    mass, size, com = _number(entry, "mass", where), _vector(entry, "box", where), _vector(entry, "com", where)
    if mass <= 0.0 or min(size) <= 0.0:
        raise _BadValueError(f"{where}: mass is {mass} kg, box is {size} m; expected all > 0")
    x, y, z = size
    inertia = (mass / 12 * (y * y + z * z), mass / 12 * (x * x + z * z), mass / 12 * (x * x + y * y))
    centre = (com[0] - origin[0], com[1] - origin[1], com[2] - origin[2])
    return Link(name, mass, centre, inertia, (Box(size, centre, _get(entry, "colour", where, str), True),))


def _mirrored(vector: Vector) -> Vector:
    return vector[0], -vector[1], vector[2]


def _get(entry: Mapping[str, Any], key: str, where: str, kind: type[T]) -> T:
    if not isinstance(entry, Mapping) or key not in entry:
        raise _BadValueError(f"{where}: {key} is missing")
    value = entry[key]
    if not isinstance(value, kind):
        raise _BadValueError(f"{where}: {key} is {value!r}; expected a {kind.__name__}")
    return value


def _number(entry: Mapping[str, Any], key: str, where: str) -> float:
    return _numbers(entry, key, where, 1)[0]


def _pair(entry: Mapping[str, Any], key: str, where: str) -> tuple[float, float]:
    a, b = _numbers(entry, key, where, 2)
    return a, b


def _vector(entry: Mapping[str, Any], key: str, where: str) -> Vector:
    a, b, c = _numbers(entry, key, where, 3)
    return a, b, c


def _numbers(entry: Mapping[str, Any], key: str, where: str, count: int) -> list[float]:
    if not isinstance(entry, Mapping) or key not in entry:
        raise _BadValueError(f"{where}: {key} is missing")
    value = entry[key]
    values = value if isinstance(value, list) else [value]
    good = all(isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in values)
    if len(values) != count or not good:
        raise _BadValueError(
            f"{where}: {key} is {value!r}; expected {'a number' if count == 1 else f'{count} numbers'}"
        )
    return [float(v) for v in values]
