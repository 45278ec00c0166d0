"""The robot as data: links, joints, limits, soles and mounts.

Read from robot.yaml by `load_robot`; everything else in the project that depends on the body (URDF, Pinocchio
models, simulator, limits of the driver) is made from these objects.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Variant = Literal["playing", "table"]

VARIANTS: tuple[Variant, ...] = ("playing", "table")
SIDES = ("left", "right")
LEG_PARTS = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll")
LEG_JOINTS = tuple(f"{side}_{part}" for side in SIDES for part in LEG_PARTS)
"""The twelve leg joints, left leg first, from the trunk down."""
HEAD_JOINTS = ("head_pan", "head_tilt")
CELL_NAMES = ("heel_inner", "heel_outer", "toe_inner", "toe_outer")
"""The force cells of a foot, in the order of all arrays of cells."""
JOINTS = LEG_JOINTS + HEAD_JOINTS
"""All joints of the playing robot: the order of every array of 14. The `table` variant has only LEG_JOINTS."""


@dataclass(frozen=True)
class Box:
    """A box fixed to a link, for pictures and contacts.

    Attributes:
        size: Full edge lengths along the link's axes [m].
        centre: In the link's frame [m].
        colour: Name of the colour: "grey", "black" or "marker" (the team's marker colour).
        collides: Whether it takes part in contacts.
    """

    size: Vector
    centre: Vector
    colour: str
    collides: bool


@dataclass(frozen=True)
class Link:
    """A rigid body.

    Attributes:
        name: Unique name.
        mass: [kg].
        com: Centre of mass in the link's frame [m].
        inertia: Principal moments about the CoM, along the link's axes [kg m^2].
        boxes: Its shapes.
    """

    name: str
    mass: float
    com: Vector
    inertia: Vector
    boxes: tuple[Box, ...]


@dataclass(frozen=True)
class Joint:
    """A revolute joint, or a fixed one (axis all zero).

    Attributes:
        name: Unique name.
        parent, child: Link names. The child's frame lies in the joint.
        origin: Of the child's frame in the parent's, axes parallel at angle zero [m].
        axis: Unit axis of positive rotation; zeros for a fixed joint.
        lower, upper: Range [rad].
        velocity: Greatest speed [rad/s].
        effort: Greatest torque [N m].
    """

    name: str
    parent: str
    child: str
    origin: Vector
    axis: Vector = (0.0, 0.0, 0.0)
    lower: float = 0.0
    upper: float = 0.0
    velocity: float = 0.0
    effort: float = 0.0

    @property
    def fixed(self) -> bool:
        """Whether it does not move."""
        return not any(self.axis)


@dataclass(frozen=True)
class Mount:
    """A frame fixed to a link, with axes parallel to the link's.

    Attributes:
        link: Name of the link.
        origin: In the link's frame [m].
    """

    link: str
    origin: Vector


@dataclass(frozen=True)
class Foot:
    """The sole of one foot: a rectangle in its sole frame, with four force cells.

    Attributes:
        x: Heel edge and toe edge [m].
        y: Right edge and left edge [m].
        cells: (4, 2) positions of heel inner, heel outer, toe inner, toe outer [m].
    """

    x: tuple[float, float]
    y: tuple[float, float]
    cells: tuple[tuple[float, float], ...]

    @property
    def width(self) -> float:
        """From the right edge to the left one [m]."""
        return self.y[1] - self.y[0]

    @property
    def corners(self) -> Array:
        """(4, 3) corners in the sole frame [m]."""
        return np.array([(x, y, 0.0) for x in self.x for y in self.y])


@dataclass(frozen=True)
class Robot:
    """The whole robot. Hashable, so that models made from it can be cached.

    Attributes:
        variant: "playing" (23 kg, upper body and head) or "table" (the team's tables exactly).
        links: All links; the first is base_link.
        joints: All joints, parents before children; the moving ones in the order of JOINTS.
        soles: Mounts of l_sole and r_sole.
        feet: Left and right sole rectangles.
        imu, camera: Mounts of imu_link and camera_link (x along the optical axis; None without a head).
    """

    variant: Variant
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    soles: tuple[Mount, Mount]
    feet: tuple[Foot, Foot]
    imu: Mount
    camera: Mount | None

    @cached_property
    def mass(self) -> float:
        """Total mass [kg]."""
        return sum(link.mass for link in self.links)

    @cached_property
    def moving(self) -> tuple[Joint, ...]:
        """The joints that move, in the order of JOINTS."""
        return tuple(joint for joint in self.joints if not joint.fixed)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the moving joints: JOINTS, or LEG_JOINTS for the `table` variant."""
        return tuple(joint.name for joint in self.moving)

    @property
    def position_limits(self) -> Array:
        """(2, n) lower and upper joint limits [rad]."""
        return np.array([[joint.lower for joint in self.moving], [joint.upper for joint in self.moving]])

    @property
    def velocity_limits(self) -> Array:
        """(n,) greatest joint speeds [rad/s]."""
        return np.array([joint.velocity for joint in self.moving])

    @property
    def effort_limits(self) -> Array:
        """(n,) greatest joint torques [N m]."""
        return np.array([joint.effort for joint in self.moving])

    def link(self, name: str) -> Link:
        """Return a link by name.

        Raises:
            ValueError: if there is none of that name.
        """
        return _find(self.links, name, "link")

    def joint(self, name: str) -> Joint:
        """Return a joint by name.

        Raises:
            ValueError: if there is none of that name.
        """
        return _find(self.joints, name, "joint")


_Named = TypeVar("_Named", Link, Joint)


def _find(items: tuple[_Named, ...], name: str, kind: str) -> _Named:
    for item in items:
        if item.name == name:
            return item
    raise ValueError(f"no {kind} is named {name!r}; expected one of {', '.join(item.name for item in items)}")


def load_robot(variant: str = "playing", path: Path | None = None, body: Path | None = None) -> Robot:
    """Read the robot from its parameter file.

    Args:
        variant: "playing": 23 kg and 1.25 m, inertias projected onto realizable ones (`realizable_inertia`).
            "table": the team's chain and numbers exactly, 16.74 kg, without upper body and head; some of its
            inertias belong to no possible body.
        path: Another parameter file than the robot.yaml beside this module.
        body: Body file of an identification, whose masses, CoMs and inertias take the place of the parameter file's.

    Raises:
        ValueError: if the variant is unknown, or a file cannot be read or is not as expected.
    """
    robot = _read_robot(variant, path)
    if body is None:
        return robot
    from tulip_description.body_file import read_body  # which needs the classes above

    return read_body(body).on(robot)


@cache
def _read_robot(variant: str, path: Path | None) -> Robot:
    from tulip_description.robot_file import read_robot  # which needs the classes above

    return read_robot(variant, path if path is not None else Path(__file__).with_name("robot.yaml"))


def realizable_inertia(moments: Vector, slack: float = 0.005) -> Vector:
    """Return the nearest principal moments of inertia that a body can have.

    A body's moments satisfy the triangle inequality Ia <= Ib + Ic, because each of the second moments of mass
    (Ib + Ic - Ia) / 2 is an integral of squares. Several of the team's inertias break it. This returns the nearest
    moments, in the Euclidean sense, that satisfy Ia <= Ib + Ic - slack (Ia + Ib + Ic); the slack keeps them off the
    boundary, on which a body would be infinitely thin and rounding could still make it invalid.

    Args:
        moments: Principal moments [kg m^2], positive.
        slack: Share of the trace by which the inequality is met. The team's trunk, which is valid, meets it by 0.006
            and stays as it is.
    """
    moment = np.asarray(moments, dtype=float)
    for a in range(3):  # moments that are positive break at most one of the three inequalities
        normal = np.full(3, slack - 1.0)  # gradient of Ia - Ib - Ic + slack (Ia + Ib + Ic)
        normal[a] = 1.0 + slack
        violation = float(normal @ moment)
        if violation > 0.0:
            moment = moment - normal * violation / float(normal @ normal)
    return float(moment[0]), float(moment[1]), float(moment[2])
