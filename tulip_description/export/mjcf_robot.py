"""The robot in MJCF: bodies, joints, shapes, motors and sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from tulip_description import frames
from tulip_description.export.camera_view import CameraView
from tulip_description.materials import SOLE_FRICTION, Materials
from tulip_description.paint import COLOURS
from tulip_description.posture import Posture
from tulip_description.robot import CELL_NAMES, SIDES, Box, Foot, Link, Robot, Vector
from tulip_description.xml_text import Value, child

SCENERY = 1  # collision bit of everything that is no robot; robot i has bit i + 1
HARD_SOLREF = (0.004, 1.0)
"""Time constant [s] and damping ratio with which hard bodies are pushed apart: critically damped, twice the shortest
that MuJoCo takes at 1 ms. Under the standing robot the soles are 10 micrometres deep."""
HARD_SOLIMP = (0.98, 0.98, 0.001)
LIMIT_SOLIMP = (0.99, 0.99, 0.001)
"""Of a joint at the end of its range. What the force lacks to stop is made up by depth: an ankle roll, 0.0005 kg m^2,
that is pushed by 12 N m goes 4 mrad too far; MuJoCo's own softness would let it go 0.5 rad."""
SITE_MARGIN = 0.01  # [m] of force cells beyond the sole's edge
SITE_THICKNESS = 0.02  # [m] of a force cell's site, half of it below the sole: contacts lie a little inside or outside


@dataclass(frozen=True)
class Placement:
    """A robot in a file.

    Attributes:
        robot: What it is like.
        prefix: Put before all its names.
        marker: Colour of its team marker.
        height: Of base_link above the ground at the start [m].
        stand: Its standing posture, as key frame; None for none.
        joint_friction: Whether MuJoCo computes the joints' dry friction; not where the simulator does it.
    """

    robot: Robot
    prefix: str = ""
    marker: str = "cyan"
    height: float = 0.0
    stand: Posture | None = None
    joint_friction: bool = True


def add_robot(
    bodies: Element, placement: Placement, number: int, count: int, materials: Materials, camera: CameraView | None
) -> None:
    """Add a floating robot, the `number`-th of `count`."""
    own = SCENERY << (number + 1)
    others = sum(SCENERY << (other + 1) for other in range(count) if other != number)
    shape: dict[str, Value] = {
        "contype": own,
        "conaffinity": SCENERY | others,
        "friction": (SOLE_FRICTION, 0.005, 0.0001),
        "group": 0,
    }
    _add_body(bodies, placement, placement.robot.links[0], (0.0, 0.0, placement.height), shape, materials, camera)


def _add_body(
    parent: Element,
    placement: Placement,
    link: Link,
    origin: Vector,
    shape: dict[str, Value],
    materials: Materials,
    camera: CameraView | None,
) -> None:
    robot, prefix = placement.robot, placement.prefix
    body = child(parent, "body", name=prefix + link.name, pos=origin)
    joint = next((joint for joint in robot.joints if joint.child == link.name), None)
    if joint is None:
        child(body, "freejoint", name=f"{prefix}root")
    elif not joint.fixed:
        friction = materials.joint_friction * joint.effort if placement.joint_friction else 0.0
        child(
            body,
            "joint",
            name=prefix + joint.name,
            axis=joint.axis,
            range=(joint.lower, joint.upper),
            damping=0.0,
            armature=0.0,  # the tables tell nothing of rotors: what they add is not in the model
            frictionloss=friction,
            solreflimit=HARD_SOLREF,
            solimplimit=LIMIT_SOLIMP,
        )
    child(body, "inertial", pos=link.com, mass=float(link.mass), diaginertia=link.inertia)
    for index, box in enumerate(link.boxes):
        _add_box(body, f"{prefix}{link.name}_{index}", box, placement.marker, shape)
    _add_mounts(body, placement, link, camera)
    for other in robot.joints:
        if other.parent == link.name:
            _add_body(body, placement, robot.link(other.child), other.origin, shape, materials, camera)


def _add_box(body: Element, name: str, box: Box, marker: str, shape: dict[str, Value]) -> None:
    colour = marker if box.colour == "marker" else box.colour
    contacts: dict[str, Value] = shape if box.collides else {"contype": 0, "conaffinity": 0, "group": 1}
    half = tuple(size / 2 for size in box.size)
    child(body, "geom", name=name, type="box", pos=box.centre, size=half, rgba=(*COLOURS[colour], 1.0), **contacts)


def _add_mounts(body: Element, placement: Placement, link: Link, camera: CameraView | None) -> None:
    robot, prefix = placement.robot, placement.prefix
    for side, name, sole, foot in zip(
        SIDES, (frames.LEFT_SOLE, frames.RIGHT_SOLE), robot.soles, robot.feet, strict=True
    ):
        if sole.link == link.name:
            child(body, "site", name=prefix + name, pos=sole.origin, size=(0.005,))
            for cell, (place, size) in zip(CELL_NAMES, cell_areas(foot), strict=True):
                centre = (sole.origin[0] + place[0], sole.origin[1] + place[1], sole.origin[2])
                half = (size[0] / 2, size[1] / 2, SITE_THICKNESS / 2)
                child(body, "site", name=f"{prefix}{side}_{cell}", type="box", pos=centre, size=half, group=4)
    if robot.imu.link == link.name:
        child(body, "site", name=prefix + frames.IMU, pos=robot.imu.origin, size=(0.01,))
    if robot.camera is not None and robot.camera.link == link.name:
        child(body, "site", name=prefix + frames.CAMERA, pos=robot.camera.origin, size=(0.005,))
        if camera is not None:
            # MuJoCo's cameras look along -z, x to the right, y up.
            child(
                body,
                "camera",
                name=f"{prefix}head_camera",
                pos=robot.camera.origin,
                xyaxes=(0.0, -1.0, 0.0, 0.0, 0.0, 1.0),
                fovy=math.degrees(camera.vertical_angle),  # whatever the compiler says of angles
                resolution=f"{camera.width} {camera.height}",
            )


def cell_areas(foot: Foot) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return middle and size [m] of what each force cell feels, in the sole frame.

    That is its quarter of the sole, and a margin beyond the edge: contacts lie on corners, which rounding puts outside.
    """
    (x0, x1), (y0, y1) = foot.x, foot.y
    length, width = (x1 - x0) / 2 + SITE_MARGIN, (y1 - y0) / 2 + SITE_MARGIN
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    return [
        ((x + math.copysign(length / 2, cell[0] - x), y + math.copysign(width / 2, cell[1] - y)), (length, width))
        for cell in foot.cells
    ]


def add_robot_devices(actuator: Element, sensor: Element, custom: Element, placement: Placement) -> None:
    """Add motors, sensors, and what MJCF has no place for: the joints' top speeds."""
    robot, prefix = placement.robot, placement.prefix
    for joint in robot.moving:
        limit = (-joint.effort, joint.effort)
        child(actuator, "motor", name=prefix + joint.name, joint=prefix + joint.name, ctrlrange=limit)
        child(sensor, "jointpos", name=f"{prefix}{joint.name}_position", joint=prefix + joint.name)
        child(sensor, "jointvel", name=f"{prefix}{joint.name}_velocity", joint=prefix + joint.name)
        child(custom, "numeric", name=f"{prefix}{joint.name}_velocity_limit", data=(joint.velocity,))
    imu = prefix + frames.IMU
    child(sensor, "framequat", name=f"{imu}_orientation", objtype="site", objname=imu)
    child(sensor, "gyro", name=f"{imu}_angular_velocity", site=imu)
    child(sensor, "accelerometer", name=f"{imu}_linear_acceleration", site=imu)
    for side in SIDES:
        for cell in CELL_NAMES:
            child(sensor, "touch", name=f"{prefix}{side}_{cell}", site=f"{prefix}{side}_{cell}")
