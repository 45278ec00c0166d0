"""Robot, field and ball as MJCF, the format of MuJoCo.

Pairs of bodies get their contacts by these rules: a contact takes friction and softness of the geom of higher priority
(net 3, ball 2, carpet 1, all others 0), and ball and carpet, whose frictions are multiplied, are a pair of their own.
Parts of one robot do not collide with each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from tulip_description.export.camera_view import CameraView
from tulip_description.export.mjcf_field import add_ball, add_carpet, add_figure, add_solids
from tulip_description.export.mjcf_robot import Placement, add_robot, add_robot_devices
from tulip_description.export.parts import BALL, FIELD, PARTS, check_parts, check_realizable
from tulip_description.field import Field
from tulip_description.materials import GRAVITY, Materials
from tulip_description.xml_text import Value, child, document

STEP = 0.001  # [s] that of the joint driver
SKY: dict[str, Value] = {"rgb1": (0.75, 0.8, 0.85), "rgb2": (0.45, 0.55, 0.65)}


@dataclass(frozen=True)
class MjcfWorld:
    """What an MJCF file holds.

    Attributes:
        field: Geometry; its carpet, goals and poles are written if `parts` holds "field".
        materials: Of everything.
        robots: Each with its place.
        parts: "field", "ball", and "robot" for `robots`.
        camera: What the head cameras see.
        figures: How many opponents' figures there are; whoever runs the model moves them (mocap bodies).
        poles: Whether the field's landmark poles stand.
    """

    field: Field
    materials: Materials
    robots: Sequence[Placement] = ()
    parts: Sequence[str] = PARTS
    camera: CameraView | None = None
    figures: int = 0
    poles: bool = True


def build_mjcf(world: MjcfWorld) -> str:
    """Return an MJCF file.

    Raises:
        ExportError: if a part is unknown or a robot has an inertia that belongs to no body.
    """
    parts = check_parts(world.parts)
    root = Element("mujoco", model="tulip")
    child(root, "compiler", angle="radian", autolimits="true")
    # Elliptic cones and a high impratio: dry friction then holds a sole without creep. Euler's method is semi-implicit.
    child(
        root, "option", timestep=STEP, gravity=(0.0, 0.0, -GRAVITY), integrator="Euler", cone="elliptic", impratio=10.0
    )
    visual = child(root, "visual")
    child(visual, "global", offwidth=1280, offheight=960)
    child(visual, "quality", shadowsize=4096)
    child(child(root, "asset"), "texture", name="sky", type="skybox", builtin="gradient", width=256, height=256, **SKY)
    bodies = Element("worldbody")
    child(bodies, "light", pos=(0.0, 0.0, 6.0), dir=(0.0, 0.0, -1.0), directional="true", diffuse=(0.6, 0.6, 0.6))
    contact, actuator, sensor, custom = (Element(tag) for tag in ("contact", "actuator", "sensor", "custom"))
    if FIELD in parts:
        add_carpet(bodies, world.field, world.materials)
        add_solids(bodies, world.field, world.materials, world.poles)
    if BALL in parts:
        add_ball(bodies, contact, world.field.ball_radius, world.materials, on_carpet=FIELD in parts)
    for number in range(world.figures):
        add_figure(bodies, number)
    for number, placement in enumerate(world.robots):
        check_realizable(placement.robot, "MJCF")
        add_robot(bodies, placement, number, len(world.robots), world.materials, world.camera)
        add_robot_devices(actuator, sensor, custom, placement)
    keyframe = Element("keyframe")
    if any(placement.stand for placement in world.robots):
        child(keyframe, "key", name="stand", qpos=_standing(world))
    for section in (bodies, contact, actuator, sensor, custom, keyframe):
        if len(section):
            root.append(section)
    return document(root)


def _standing(world: MjcfWorld) -> list[float]:
    """Return qpos of robots that stand where they are put, in the order of the bodies."""
    qpos = [0.0, 0.0, world.field.ball_radius, 1.0, 0.0, 0.0, 0.0] if BALL in world.parts else []
    for placement in world.robots:
        joints = placement.stand.joint_positions.tolist() if placement.stand else [0.0] * len(placement.robot.moving)
        height = placement.stand.base_height if placement.stand else placement.height
        qpos += [0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0, *joints]
    return qpos
