"""The robot as URDF text."""

from __future__ import annotations

from xml.etree import ElementTree

from tulip_description import frames
from tulip_description.paint import COLOURS
from tulip_description.robot import Box, Link, Robot, Vector
from tulip_description.xml_text import document, numbers


def build_urdf(robot: Robot, marker: str = "cyan", mount_frames: bool = True, joint_friction: float = 0.0) -> str:
    """Return the robot as URDF.

    Args:
        robot: What to describe.
        marker: Colour of the team marker: "cyan" or "magenta".
        mount_frames: Whether soles, IMU and camera appear as links without mass, as tf and viewers want them. A physics
            engine is better off without: pybullet gives a link without inertia a mass of 1 kg.
        joint_friction: Dry friction of each joint as a share of its torque limit.

    Raises:
        ValueError: if the marker's colour is unknown.
    """
    if marker not in ("cyan", "magenta"):
        raise ValueError(f"marker is {marker!r}; expected cyan or magenta")
    root = ElementTree.Element("robot", name="tulip")
    for link in robot.links:
        _add_link(root, link, marker)
    for joint in robot.joints:
        element = _add_joint(
            root, joint.name, "fixed" if joint.fixed else "revolute", joint.parent, joint.child, joint.origin
        )
        if not joint.fixed:
            ElementTree.SubElement(element, "axis", xyz=numbers(joint.axis))
            limits = {"lower": joint.lower, "upper": joint.upper, "effort": joint.effort, "velocity": joint.velocity}
            ElementTree.SubElement(element, "limit", {key: repr(float(value)) for key, value in limits.items()})
            ElementTree.SubElement(element, "dynamics", damping="0", friction=repr(joint_friction * joint.effort))
    if mount_frames:
        mounts = [(frames.LEFT_SOLE, robot.soles[0]), (frames.RIGHT_SOLE, robot.soles[1]), (frames.IMU, robot.imu)]
        if robot.camera is not None:
            mounts.append((frames.CAMERA, robot.camera))
        for name, mount in mounts:
            ElementTree.SubElement(root, "link", name=name)
            _add_joint(root, f"{name}_mount", "fixed", mount.link, name, mount.origin)
        if robot.camera is not None:
            ElementTree.SubElement(root, "link", name=frames.CAMERA_OPTICAL)
            turn = "-1.5707963267948966 0 -1.5707963267948966"  # z forward, x right, y down (REP 103)
            _add_joint(
                root, "camera_optical_mount", "fixed", frames.CAMERA, frames.CAMERA_OPTICAL, (0.0, 0.0, 0.0), turn
            )
    return document(root)


def _add_link(root: ElementTree.Element, link: Link, marker: str) -> None:
    element = ElementTree.SubElement(root, "link", name=link.name)
    inertial = ElementTree.SubElement(element, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=numbers(link.com), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=repr(float(link.mass)))
    ixx, iyy, izz = (repr(float(value)) for value in link.inertia)
    ElementTree.SubElement(inertial, "inertia", ixx=ixx, iyy=iyy, izz=izz, ixy="0", ixz="0", iyz="0")
    for box in link.boxes:
        colour = marker if box.colour == "marker" else box.colour
        visual = _add_box(element, "visual", box)
        material = ElementTree.SubElement(visual, "material", name=colour)
        ElementTree.SubElement(material, "color", rgba=numbers(COLOURS[colour]) + " 1")
        if box.collides:
            _add_box(element, "collision", box)


def _add_box(link: ElementTree.Element, kind: str, box: Box) -> ElementTree.Element:
    element = ElementTree.SubElement(link, kind)
    ElementTree.SubElement(element, "origin", xyz=numbers(box.centre), rpy="0 0 0")
    ElementTree.SubElement(ElementTree.SubElement(element, "geometry"), "box", size=numbers(box.size))
    return element


def _add_joint(
    root: ElementTree.Element, name: str, kind: str, parent: str, child: str, origin: Vector, rpy: str = "0 0 0"
) -> ElementTree.Element:
    element = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(element, "parent", link=parent)
    ElementTree.SubElement(element, "child", link=child)
    ElementTree.SubElement(element, "origin", xyz=numbers(origin), rpy=rpy)
    return element
