"""The field and the ball in MJCF."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

from tulip_description.export.mjcf_robot import HARD_SOLIMP, HARD_SOLREF, SCENERY
from tulip_description.field import Field
from tulip_description.field_solids import goal_frame, net_walls, painted_strips, pole_segments
from tulip_description.keeper import keeper_parts
from tulip_description.materials import BALL_FRICTION, NET_FRICTION, POST_FRICTION, Materials
from tulip_description.paint import COLOURS
from tulip_description.xml_text import Value, child

CARPET, BALL_NAME = "carpet", "ball"
PRIORITY = {"net": 3, "ball": 2, "carpet": 1}
SPRING_SOLIMP = (0.95, 0.95, 0.001)
TORSION, ROLLING = 0.005, 0.0001  # [m] MuJoCo's own; contacts of three dimensions do not use them
TWO_SIDED: dict[str, Value] = {"contype": SCENERY, "conaffinity": SCENERY}
SEEN_ONLY: dict[str, Value] = {"contype": 0, "conaffinity": 0, "group": 1}
HARD: dict[str, Value] = {
    "friction": (POST_FRICTION, TORSION, ROLLING),
    "solref": HARD_SOLREF,
    "solimp": HARD_SOLIMP,
    **TWO_SIDED,
}
"""Posts, poles and figures."""
PAINT_HEIGHT = 0.002  # [m] of lines above the carpet; less, and pictures show them torn


def spring(stiffness: float, damping: float, mass: float) -> tuple[float, float]:
    """Return the solref of a contact that is a spring and a damper on a body of that mass.

    MuJoCo's direct form (-k, -b) is by the mass that the contact moves, and with a constant impedance d its force is
    f = m_eff (k depth + b speed) beside d times what would stop the body at once under other forces. So k = K / m.

    Args:
        stiffness: K [N/m].
        damping: [N s/m].
        mass: Of the body that is pushed away [kg].
    """
    return -stiffness / mass, -damping / mass


def add_carpet(bodies: Element, field: Field, materials: Materials) -> None:
    """Add the ground z = 0, endless for contacts, as large as the carpet for the eye, and its lines."""
    size = (field.carpet_length / 2, field.carpet_width / 2, 0.1)
    child(
        bodies,
        "geom",
        name=CARPET,
        type="plane",
        size=size,
        rgba=(*COLOURS["green"], 1.0),
        priority=PRIORITY["carpet"],
        condim=3,
        friction=(materials.friction, TORSION, ROLLING),
        solref=HARD_SOLREF,
        solimp=HARD_SOLIMP,
        **TWO_SIDED,
    )
    for number, strip in enumerate(painted_strips(field)):
        child(
            bodies,
            "geom",
            name=f"line_{number}",
            type="box",
            pos=(strip.x, strip.y, 0.0),
            euler=(0.0, 0.0, strip.yaw),
            size=(strip.length / 2, strip.width / 2, PAINT_HEIGHT),
            rgba=(*COLOURS["white"], 1.0),
            **SEEN_ONLY,
        )


def add_solids(bodies: Element, field: Field, materials: Materials, poles: bool) -> None:
    """Add goals with their nets, and poles."""
    goals = (field.own_goal, field.opponent_goal)
    for pipe in (*goal_frame(goals[0]), *goal_frame(goals[1]), *(pole_segments(field) if poles else ())):
        child(
            bodies,
            "geom",
            name=pipe.name,
            type="cylinder",
            pos=pipe.centre,
            euler=(0.0 if pipe.upright else math.pi / 2, 0.0, 0.0),
            size=(pipe.radius, pipe.length / 2),
            rgba=(*COLOURS[pipe.colour], 1.0),
            **HARD,
        )
    soft = spring(materials.net_stiffness, materials.net_damping, materials.ball_mass)
    for goal in goals:
        for number, wall in enumerate(net_walls(goal)):
            child(
                bodies,
                "geom",
                name=f"{'opponent' if goal.outward > 0 else 'own'}_net_{number}",
                type="box",
                pos=wall.centre,
                size=tuple(size / 2 for size in wall.size),
                rgba=(*COLOURS[wall.colour], 0.25),
                priority=PRIORITY["net"],
                friction=(NET_FRICTION * BALL_FRICTION, TORSION, ROLLING),
                solref=soft,
                solimp=SPRING_SOLIMP,
                **TWO_SIDED,
            )


def add_ball(bodies: Element, contact: Element, radius: float, materials: Materials, on_carpet: bool) -> None:
    """Add the ball, a thin shell, at the origin; with the carpet it is a pair, whose friction also brakes rolling."""
    mass, inertia = materials.ball_mass, materials.ball_inertia(radius)
    body = child(bodies, "body", name=BALL_NAME, pos=(0.0, 0.0, radius))
    child(body, "freejoint", name=BALL_NAME)
    child(body, "inertial", pos=(0.0, 0.0, 0.0), mass=mass, diaginertia=(inertia,) * 3)
    soft = spring(materials.ball_stiffness, materials.ball_damping, mass)
    child(
        body,
        "geom",
        name=BALL_NAME,
        type="sphere",
        size=(radius,),
        rgba=(*COLOURS["orange"], 1.0),
        priority=PRIORITY["ball"],
        friction=(BALL_FRICTION, TORSION, ROLLING),
        solref=soft,
        solimp=SPRING_SOLIMP,
        **TWO_SIDED,
    )
    if on_carpet:
        slide, arm = BALL_FRICTION * materials.friction, materials.rolling_arm(radius)
        child(
            contact,
            "pair",
            geom1=BALL_NAME,
            geom2=CARPET,
            condim=6,
            friction=(slide, slide, arm, arm, arm),
            solref=soft,
            solimp=SPRING_SOLIMP,
        )


def figure_name(number: int) -> str:
    """Return the name of the body of an opponent's figure."""
    return f"figure_{number}"


def add_figure(bodies: Element, number: int) -> None:
    """Add a figure like the keeper's, which nothing pushes away."""
    body = child(bodies, "body", name=figure_name(number), mocap="true")
    for part in keeper_parts():
        child(
            body,
            "geom",
            name=f"{figure_name(number)}_{part.name}",
            type="box",
            pos=part.centre,
            size=tuple(size / 2 for size in part.size),
            rgba=(*COLOURS[part.colour], 1.0),
            mass=0.0,
            **(HARD if part.solid else SEEN_ONLY),
        )
