"""Robot, field and ball as SDF, the format of Gazebo."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element

from tulip_description.export.camera_view import CameraView
from tulip_description.export.parts import BALL, FIELD, PARTS, ROBOT, check_parts, check_realizable
from tulip_description.export.sdf_field import add_ball, add_field
from tulip_description.export.sdf_robot import add_robot
from tulip_description.field import Field
from tulip_description.materials import GRAVITY, Materials
from tulip_description.robot import Robot
from tulip_description.xml_text import child, document

VERSION = "1.9"


def build_sdf(
    robot: Robot,
    field: Field,
    materials: Materials,
    camera: CameraView | None = None,
    parts: Sequence[str] = PARTS,
    height: float = 0.0,
    marker: str = "cyan",
) -> str:
    """Return one part as a model, or several as a world of models.

    Args:
        robot: What to write as "robot".
        field: What to write as "field"; also tells the ball's size.
        materials: Of everything.
        camera: What the head camera sees; None to leave it out.
        parts: Which parts.
        height: Of the robot's base_link above the ground, in a world [m].
        marker: Colour of the team marker.

    Raises:
        ExportError: if a part is unknown or the robot has an inertia that belongs to no body.
    """
    parts = check_parts(parts)
    root = Element("sdf", version=VERSION)
    world = _add_world(root) if len(parts) > 1 else root
    if FIELD in parts:
        add_field(world, field, materials)
    if BALL in parts:
        add_ball(world, field, materials)
    if ROBOT in parts:
        check_realizable(robot, "SDF")
        add_robot(world, robot, materials, camera, height if len(parts) > 1 else 0.0, marker)
    return document(root)


def _add_world(root: Element) -> Element:
    world = child(root, "world", name="tulip")
    child(world, "gravity", f"0 0 {-GRAVITY!r}")
    light = child(world, "light", name="sun", type="directional")
    child(light, "pose", "0 0 10 0 0 0")
    child(light, "direction", "-0.3 0.2 -1")
    return world
