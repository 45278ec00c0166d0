"""Inertials and shapes of SDF links."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element

from tulip_description.paint import COLOURS
from tulip_description.robot import Vector
from tulip_description.xml_text import child, numbers


def add_inertial(link: Element, mass: float, com: Vector, inertia: Vector) -> None:
    """Add mass [kg], CoM [m] and principal moments about it along the link's axes [kg m^2]."""
    inertial = child(link, "inertial")
    child(inertial, "pose", numbers((*com, 0.0, 0.0, 0.0)))
    child(inertial, "mass", float(mass))
    tensor = child(inertial, "inertia")
    for name, value in zip(("ixx", "iyy", "izz"), inertia, strict=True):
        child(tensor, name, float(value))
    for name in ("ixy", "ixz", "iyz"):
        child(tensor, name, 0.0)


def add_shape(
    link: Element,
    name: str,
    shape: str,
    size: Mapping[str, str | float],
    centre: Vector,
    colour: str,
    friction: float | None,
    turn: Vector = (0.0, 0.0, 0.0),
    opacity: float = 1.0,
) -> Element | None:
    """Add a visual, and where there is friction a collision; return the collision's surface.

    Args:
        link: Where to.
        name: Of visual and collision.
        shape: "box", "cylinder" or "sphere".
        size: Its elements, as in {"radius": 0.1}.
        centre: In the link's frame [m].
        colour: Name.
        friction: Coefficient; None for what takes no part in contacts.
        turn: Roll, pitch and yaw [rad].
        opacity: 0 to 1.
    """
    surface = None
    for kind in ("visual",) if friction is None else ("visual", "collision"):
        element = child(link, kind, name=name)
        child(element, "pose", numbers((*centre, *turn)))
        geometry = child(child(element, "geometry"), shape)
        for key, value in size.items():
            child(geometry, key, value)
        if kind == "visual":
            material = child(element, "material")
            for light in ("ambient", "diffuse"):
                child(material, light, numbers((*COLOURS[colour], opacity)))
            if opacity < 1.0:
                child(element, "transparency", 1.0 - opacity)
        else:
            surface = child(element, "surface")
            ode = child(child(surface, "friction"), "ode")
            child(ode, "mu", friction)
            child(ode, "mu2", friction)
    return surface
