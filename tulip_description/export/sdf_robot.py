"""The robot as an SDF model: links, joints, frames, sensors."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from tulip_description import frames
from tulip_description.export.camera_view import CameraView
from tulip_description.export.sdf_shape import add_inertial, add_shape
from tulip_description.materials import SOLE_FRICTION, Materials
from tulip_description.robot import SIDES, Joint, Link, Mount, Robot, Vector
from tulip_description.xml_text import child, numbers

NO_TURN = (0.0, 0.0, 0.0)
SENSOR_RATE = 250.0  # [Hz] of IMU and feet: that of the control cycle


def add_robot(
    parent: Element, robot: Robot, materials: Materials, camera: CameraView | None, height: float, marker: str
) -> None:
    """Add the model; its frame is base_link."""
    model = child(parent, "model", name="tulip", canonical_link=robot.links[0].name)
    child(model, "pose", numbers((0.0, 0.0, height, *NO_TURN)))
    for link in robot.links:
        _add_link(model, robot, link, camera, marker)
    for joint in robot.joints:
        _add_joint(model, joint, materials)
    mounts = [(frames.LEFT_SOLE, robot.soles[0]), (frames.RIGHT_SOLE, robot.soles[1]), (frames.IMU, robot.imu)]
    if robot.camera is not None:
        mounts.append((frames.CAMERA, robot.camera))
    for name, mount in mounts:
        child(child(model, "frame", name=name, attached_to=mount.link), "pose", _at(mount.origin))


def _add_link(model: Element, robot: Robot, link: Link, camera: CameraView | None, marker: str) -> None:
    element = child(model, "link", name=link.name)
    joint = next((joint for joint in robot.joints if joint.child == link.name), None)
    if joint is not None:  # the link's frame lies in its joint
        child(element, "pose", _at(NO_TURN), relative_to=joint.name)
    add_inertial(element, link.mass, link.com, link.inertia)
    for index, box in enumerate(link.boxes):
        colour = marker if box.colour == "marker" else box.colour
        friction = SOLE_FRICTION if box.collides else None
        add_shape(element, f"{link.name}_{index}", "box", {"size": numbers(box.size)}, box.centre, colour, friction)
    if robot.imu.link == link.name:
        _add_sensor(element, frames.IMU, "imu", robot.imu, SENSOR_RATE)
    if camera is not None and robot.camera is not None and robot.camera.link == link.name:
        sensor = _add_sensor(element, "head_camera", "camera", robot.camera, camera.rate)
        pinhole = child(sensor, "camera", name="head_camera")
        child(pinhole, "horizontal_fov", camera.horizontal_angle)
        image = child(pinhole, "image")
        child(image, "width", camera.width)
        child(image, "height", camera.height)
        clip = child(pinhole, "clip")
        child(clip, "near", 0.02)
        child(clip, "far", 30.0)
    for side, sole in zip(SIDES, robot.soles, strict=True):
        if sole.link == link.name:
            sensor = _add_sensor(element, f"{side}_sole_contact", "contact", sole, SENSOR_RATE)
            child(child(sensor, "contact"), "collision", f"{link.name}_0")


def _add_sensor(link: Element, name: str, kind: str, mount: Mount, rate: float) -> Element:
    sensor = child(link, "sensor", name=name, type=kind)
    child(sensor, "pose", _at(mount.origin))
    child(sensor, "update_rate", rate)
    child(sensor, "always_on", "true")
    return sensor


def _add_joint(model: Element, joint: Joint, materials: Materials) -> None:
    element = child(model, "joint", name=joint.name, type="fixed" if joint.fixed else "revolute")
    child(element, "pose", _at(joint.origin), relative_to=joint.parent)
    child(element, "parent", joint.parent)
    child(element, "child", joint.child)
    if not joint.fixed:
        axis = child(element, "axis")
        child(axis, "xyz", numbers(joint.axis))
        limit = child(axis, "limit")
        for name in ("lower", "upper", "effort", "velocity"):
            child(limit, name, float(getattr(joint, name)))
        dynamics = child(axis, "dynamics")
        child(dynamics, "damping", 0.0)
        child(dynamics, "friction", float(materials.joint_friction * joint.effort))


def _at(origin: Vector) -> str:
    return numbers((*origin, *NO_TURN))
