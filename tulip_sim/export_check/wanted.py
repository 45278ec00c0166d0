"""What exported files ought to hold."""

from __future__ import annotations

import numpy as np

from tulip_description.field import Field
from tulip_description.materials import Materials
from tulip_description.robot import Joint, Robot
from tulip_sim.export_check.figures import BodyFigures, Figures, JointFigures


def robot_figures(robot: Robot, materials: Materials) -> Figures:
    """Return the figures of every link and every joint that moves."""
    bodies = {link.name: BodyFigures(link.mass, np.array(link.com), np.diag(link.inertia)) for link in robot.links}
    return Figures(bodies, {joint.name: _joint(joint, materials) for joint in robot.moving})


def ball_figures(field: Field, materials: Materials) -> Figures:
    """Return the figures of the ball."""
    inertia = materials.ball_inertia(field.ball_radius) * np.eye(3)
    return Figures({"ball": BodyFigures(materials.ball_mass, np.zeros(3), inertia)}, {})


def _joint(joint: Joint, materials: Materials) -> JointFigures:
    return JointFigures(
        np.array(joint.origin),
        np.array(joint.axis),
        joint.lower,
        joint.upper,
        joint.effort,
        joint.velocity,
        damping=0.0,
        friction=materials.joint_friction * joint.effort,
        armature=0.0,
    )


def merged(robot: Robot, figures: Figures) -> Figures:
    """Return the figures with links on fixed joints made part of the links that carry them, as Pinocchio does."""
    bodies = dict(figures.bodies)
    for joint in reversed(robot.joints):  # children before parents
        if joint.fixed:
            bodies[joint.parent] = _together(bodies[joint.parent], bodies.pop(joint.child), np.array(joint.origin))
    return Figures(bodies, figures.joints)


def _together(first: BodyFigures, second: BodyFigures, origin: np.ndarray) -> BodyFigures:
    mass = first.mass + second.mass
    places = (first.com, second.com + origin)
    com = (first.mass * places[0] + second.mass * places[1]) / mass
    inertia = np.zeros((3, 3))
    for body, place in zip((first, second), places, strict=True):
        arm = place - com
        inertia += body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))  # Huygens and Steiner
    return BodyFigures(mass, com, inertia)
