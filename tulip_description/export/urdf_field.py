"""The field and the ball as URDF: a link that is to be held fast, and one that is to float."""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree.ElementTree import Element

from tulip_description.export.parts import BALL, FIELD
from tulip_description.field import Field
from tulip_description.field_solids import (
    CARPET_THICKNESS,
    carpet_box,
    goal_frame,
    net_walls,
    painted_strips,
    pole_segments,
)
from tulip_description.materials import Materials
from tulip_description.paint import COLOURS
from tulip_description.robot import Vector
from tulip_description.xml_text import child, document

UPRIGHT = (0.0, 0.0, 0.0)


def build_field_urdf(field: Field) -> str:
    """Return carpet, lines, goals and poles as one link, whose frame is map."""
    root = Element("robot", name="tulip_field")
    link = child(root, "link", name=FIELD)
    carpet = carpet_box(field)
    _add(link, "box", {"size": carpet.size}, carpet.centre, "green")
    for strip in painted_strips(field):
        size = (strip.length, strip.width, CARPET_THICKNESS / 10)
        _add(link, "box", {"size": size}, (strip.x, strip.y, 0.0), "white", (0.0, 0.0, strip.yaw), collides=False)
    for goal in (field.own_goal, field.opponent_goal):
        for pipe in goal_frame(goal):
            turn = UPRIGHT if pipe.upright else (math.pi / 2, 0.0, 0.0)
            _add(link, "cylinder", {"radius": pipe.radius, "length": pipe.length}, pipe.centre, pipe.colour, turn)
        for wall in net_walls(goal):
            _add(link, "box", {"size": wall.size}, wall.centre, wall.colour, opacity=0.25)
    for pipe in pole_segments(field):
        _add(link, "cylinder", {"radius": pipe.radius, "length": pipe.length}, pipe.centre, pipe.colour)
    return document(root)


def build_ball_urdf(field: Field, materials: Materials) -> str:
    """Return the ball, whose frame lies in its centre."""
    root = Element("robot", name="tulip_ball")
    link = child(root, "link", name=BALL)
    inertial = child(link, "inertial")
    child(inertial, "mass", value=materials.ball_mass)
    moment = materials.ball_inertia(field.ball_radius)
    child(inertial, "inertia", ixx=moment, iyy=moment, izz=moment, ixy=0.0, ixz=0.0, iyz=0.0)
    _add(link, "sphere", {"radius": field.ball_radius}, (0.0, 0.0, 0.0), field.ball_colour)
    return document(root)


def _add(
    link: Element,
    shape: str,
    size: Mapping[str, float | Vector],
    centre: Vector,
    colour: str,
    turn: Vector = UPRIGHT,
    collides: bool = True,
    opacity: float = 1.0,
) -> None:
    for kind in ("visual", "collision") if collides else ("visual",):
        element = child(link, kind)
        child(element, "origin", xyz=centre, rpy=turn)
        child(child(element, "geometry"), shape, **size)
        if kind == "visual":
            child(child(element, "material", name=colour), "color", rgba=(*COLOURS[colour], opacity))
