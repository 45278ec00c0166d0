"""The field and the ball as SDF models."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

from tulip_description.export.parts import BALL, FIELD
from tulip_description.export.sdf_shape import add_inertial, add_shape
from tulip_description.field import Field
from tulip_description.field_solids import (
    CARPET_THICKNESS,
    carpet_box,
    goal_frame,
    net_walls,
    painted_strips,
    pole_segments,
)
from tulip_description.materials import BALL_FRICTION, NET_FRICTION, POST_FRICTION, Materials
from tulip_description.xml_text import child, numbers


def add_field(parent: Element, field: Field, materials: Materials) -> None:
    """Add carpet, lines, goals and poles as one model that stays where it is; its frame is map."""
    model = child(parent, "model", name=FIELD)
    child(model, "static", "true")
    link = child(model, "link", name=FIELD)
    carpet = carpet_box(field)
    add_shape(link, "carpet", "box", {"size": numbers(carpet.size)}, carpet.centre, "green", materials.friction)
    for number, strip in enumerate(painted_strips(field)):
        size = {"size": numbers((strip.length, strip.width, CARPET_THICKNESS / 10))}
        add_shape(
            link, f"line_{number}", "box", size, (strip.x, strip.y, 0.0), "white", None, turn=(0.0, 0.0, strip.yaw)
        )
    goals = (field.own_goal, field.opponent_goal)
    for pipe in (*goal_frame(goals[0]), *goal_frame(goals[1]), *pole_segments(field)):
        turn = (0.0 if pipe.upright else math.pi / 2, 0.0, 0.0)
        size_of_pipe: dict[str, str | float] = {"radius": pipe.radius, "length": pipe.length}
        add_shape(link, pipe.name, "cylinder", size_of_pipe, pipe.centre, pipe.colour, POST_FRICTION, turn)
    for goal in goals:
        for number, wall in enumerate(net_walls(goal)):
            name = f"{'opponent' if goal.outward > 0 else 'own'}_net_{number}"
            surface = add_shape(
                link, name, "box", {"size": numbers(wall.size)}, wall.centre, "net", NET_FRICTION, opacity=0.25
            )
            _add_spring(surface, materials.net_stiffness, materials.net_damping)


def add_ball(parent: Element, field: Field, materials: Materials) -> None:
    """Add the ball, a thin shell, at the origin of the ground; the model's frame lies in its centre."""
    radius = field.ball_radius
    model = child(parent, "model", name=BALL)
    child(model, "pose", numbers((0.0, 0.0, radius, 0.0, 0.0, 0.0)))
    link = child(model, "link", name=BALL)
    add_inertial(link, materials.ball_mass, (0.0, 0.0, 0.0), (materials.ball_inertia(radius),) * 3)
    surface = add_shape(link, BALL, "sphere", {"radius": radius}, (0.0, 0.0, 0.0), field.ball_colour, BALL_FRICTION)
    _add_spring(surface, materials.ball_stiffness, materials.ball_damping)
    if surface is not None:
        bullet = child(surface.find("friction") or surface, "bullet")
        child(bullet, "friction", BALL_FRICTION)
        child(bullet, "friction2", BALL_FRICTION)
        child(bullet, "rolling_friction", materials.rolling_arm(radius))


def _add_spring(surface: Element | None, stiffness: float, damping: float) -> None:
    if surface is not None:
        ode = child(child(surface, "contact"), "ode")
        child(ode, "kp", stiffness)
        child(ode, "kd", damping)
