"""What stands on the field at one instant, as the camera's renderer wants it: boxes, cylinders, nets, a ball."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_mount import MountOffsets
from tulip_description.field import Field, Goal
from tulip_description.keeper import keeper_parts
from tulip_description.planar import Pose2D
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Box, Robot
from tulip_sim.solids import Colour, View
from tulip_sim.truth import Truth

Array = NDArray[np.float64]

COLOURS: dict[str, Colour] = {
    "yellow": (38.0, 200.0, 232.0),
    "blue": (186.0, 92.0, 36.0),
    "orange": (28.0, 112.0, 246.0),
    "cyan": (214.0, 196.0, 44.0),
    "magenta": (150.0, 52.0, 214.0),
    "black": (42.0, 40.0, 40.0),
    "grey": (142.0, 138.0, 136.0),
}
"""BGR of things in full light."""

KEEPER_SHADOW = 0.26  # [m]
FOOT_SHADOW = 0.14  # [m]
THREAD_GAP = 0.15  # [m] between two threads of a net
UNSEEN = ("neck", "head")  # links that carry the camera; it does not see them
MATCH_MARKERS = (
    ("electronics", Box((0.006, 0.20, 0.16), (0.054, 0.0, 0.0), "marker", False)),
    ("left_arm", Box((0.07, 0.006, 0.18), (0.0, 0.039, 0.08), "marker", False)),
    ("right_arm", Box((0.07, 0.006, 0.18), (0.0, -0.039, 0.08), "marker", False)),
)
"""Link and box of the markers that a robot wears in a match on chest and arms, so that all sides show its team; the one
on the back is its own (robot.yaml)."""
HIDDEN = ("neck",)  # stands inside the head, where drawing from far to near knows no order


@dataclass(frozen=True)
class Boxes:
    """Boxes in map.

    Attributes:
        transforms: (B, 4, 4) of each box's middle in map.
        sizes: (B, 3) full edges [m].
        colours: (B, 3) BGR.
    """

    transforms: Array
    sizes: Array
    colours: Array

    def __add__(self, other: Boxes) -> Boxes:
        """Return the boxes of both."""
        return Boxes(
            np.concatenate([self.transforms, other.transforms]),
            np.concatenate([self.sizes, other.sizes]),
            np.concatenate([self.colours, other.colours]),
        )

    def after(self, count: int) -> Boxes:
        """Return all but the first ones."""
        return Boxes(self.transforms[count:], self.sizes[count:], self.colours[count:])

    def inside(self, view: View, camera_in_map: Array) -> Boxes:
        """Return those that a camera may see, by their bounding spheres."""
        middles = (self.transforms[:, :3, 3] - camera_in_map[:3, 3]) @ camera_in_map[:3, :3]
        reach = np.linalg.norm(self.sizes, axis=1) / 2.0
        seen = (view.inside(middles) > -reach[:, None] * view.steepest).all(axis=1)
        return Boxes(self.transforms[seen], self.sizes[seen], self.colours[seen])


NO_BOXES = Boxes(np.empty((0, 4, 4)), np.empty((0, 3)), np.empty((0, 3)))


@dataclass(frozen=True)
class Cylinder:
    """A cylinder in map: from start to end [m], with sections of equal length in the given colours (BGR)."""

    start: Array
    end: Array
    radius: float
    colours: tuple[Colour, ...]


@dataclass(frozen=True)
class Scene:
    """What moves or may be missing; lines and goals are always there.

    Attributes:
        ball: (3,) centre of the ball in map [m], or None.
        boxes: Figures on the field, and the robot's own body.
        poles: Whether the landmark poles stand.
        shadows: (n, 3) x, y, radius [m] of dark spots on the ground below things.
    """

    ball: Array | None
    boxes: Boxes = NO_BOXES
    poles: bool = True
    shadows: tuple[tuple[float, float, float], ...] = ()


def keeper_boxes(pose: Pose2D, team_colour: str) -> Boxes:
    """Return the boxes of a keeper figure that stands at a pose in map."""
    centres, sizes, colours = _keeper_parts(team_colour)
    figure = np.eye(4)
    figure[:2, :2] = pose.rotation()
    figure[:2, 3] = pose.x, pose.y
    transforms = np.tile(figure, (len(sizes), 1, 1))
    transforms[:, :3, 3] += centres @ figure[:3, :3].T
    return Boxes(transforms, sizes, colours)


@cache
def _keeper_parts(team_colour: str) -> tuple[Array, Array, Array]:
    """Return centres, sizes [m] and colours (BGR), each (n, 3), of the parts of a keeper figure."""
    parts = keeper_parts(team_colour)
    found = (
        np.array([part.centre for part in parts]),
        np.array([part.size for part in parts]),
        np.array([COLOURS[part.colour] for part in parts]),
    )
    for each in found:
        each.setflags(write=False)
    return found


def goal_cylinders(goal: Goal) -> tuple[Cylinder, ...]:
    """Return both posts and the crossbar of a goal."""
    left, right = goal.posts
    colour = (COLOURS[left.colour],)
    # The bar ends on the posts' axes; its own axis lies a radius above its lower side.
    bar = goal.height + left.radius
    upright = [
        Cylinder(np.array([post.x, post.y, 0.0]), np.array([post.x, post.y, post.height]), post.radius, colour)
        for post in (left, right)
    ]
    across = Cylinder(np.array([left.x, left.y, bar]), np.array([right.x, right.y, bar]), left.radius, colour)
    return (*upright, across)


def pole_cylinders(field: Field) -> tuple[Cylinder, ...]:
    """Return the landmark poles."""
    return tuple(
        Cylinder(
            np.array([pole.x, pole.y, 0.0]),
            np.array([pole.x, pole.y, pole.height]),
            pole.radius,
            tuple(COLOURS[colour] for colour in pole.colours),
        )
        for pole in field.poles
    )


def net_threads(goal: Goal) -> Array:
    """Return the threads of a goal's net (back, roof and both sides) as (n, 2, 3) straight lines in map [m]."""
    x0, x1 = goal.x, goal.back
    y0, y1 = goal.posts[1].y, goal.posts[0].y
    top = goal.posts[0].height
    xs, ys, zs = (_steps(low, high) for low, high in ((x0, x1), (y0, y1), (0.0, top)))
    threads: list[tuple[tuple[float, float, float], tuple[float, float, float]]] = []
    threads += [((x1, y, 0.0), (x1, y, top)) for y in ys] + [((x1, y0, z), (x1, y1, z)) for z in zs]
    threads += [((x, y0, top), (x, y1, top)) for x in xs[1:-1]] + [((x0, y, top), (x1, y, top)) for y in ys[1:-1]]
    for y in (y0, y1):
        threads += [((x, y, 0.0), (x, y, top)) for x in xs[1:-1]] + [((x0, y, z), (x1, y, z)) for z in zs[:-1]]
    return np.array(threads)


def _steps(low: float, high: float) -> Sequence[float]:
    return [float(value) for value in np.linspace(low, high, max(round(abs(high - low) / THREAD_GAP), 1) + 1)]


class Body:
    """The robot's own body: where its links and its camera are for given joint angles."""

    def __init__(
        self,
        robot: Robot,
        team_colour: str,
        unseen: Collection[str] = UNSEEN,
        mount: MountOffsets | None = None,
        worn: Sequence[tuple[str, Box]] = (),
    ) -> None:
        """Collect the boxes.

        Args:
            robot: A robot with a camera.
            team_colour: Of its marker.
            unseen: Links whose boxes are left out.
            mount: How the camera really sits on the head; none: as drawn.
            worn: What it wears besides, with the link that each thing is fixed to.

        Raises:
            ValueError: if the robot has no camera.
        """
        if robot.camera is None:
            raise ValueError(f"variant {robot.variant!r} has no camera; expected the playing variant")
        self._robot = robot
        self._figures: dict[str, Body] = {}
        self._camera = robot.camera
        self._mount = mount or MountOffsets()
        self._soles = robot.soles
        columns = {joint.name: column for column, joint in enumerate(robot.moving)}
        self._columns = [columns.get(joint.name) for joint in robot.joints]
        self._steps = np.tile(np.eye(4), (len(robot.joints), 1, 1))
        self._steps[:, :3, 3] = [joint.origin for joint in robot.joints]
        self._crosses = np.array([_cross_matrix(joint.axis) for joint in robot.moving])
        seen = [(link.name, box) for link in robot.links for box in link.boxes if link.name not in unseen]
        seen += list(worn)
        self._links = [name for name, _ in seen]
        self._centres = np.array([box.centre for _, box in seen])
        self._sizes = np.array([box.size for _, box in seen])
        self._colours = np.array([COLOURS[team_colour if box.colour == "marker" else box.colour] for _, box in seen])

    def links_in_map(self, base_in_map: Array, joint_positions: Array) -> dict[str, Array]:
        """Return the (4, 4) transform of each link in map.

        Args:
            base_in_map: (4, 4) transform of base_link in map.
            joint_positions: (n,) [rad], order of JOINTS.
        """
        # Turns about all axes at once (Rodrigues).
        sines, cosines = np.sin(joint_positions)[:, None, None], np.cos(joint_positions)[:, None, None]
        turns = np.eye(3) + sines * self._crosses + (1.0 - cosines) * (self._crosses @ self._crosses)
        found = {self._robot.links[0].name: base_in_map}
        for joint, still, column in zip(self._robot.joints, self._steps, self._columns, strict=True):
            step = still
            if column is not None:
                step = still.copy()
                step[:3, :3] = turns[column]
            found[joint.child] = found[joint.parent] @ step
        return found

    def camera_in_map(self, links: dict[str, Array]) -> Array:
        """Return the (4, 4) transform of camera_optical_frame in map, from the links' transforms."""
        optical = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
        optical[:3, :3] = self._mount.rotation @ optical[:3, :3]
        optical[:3, 3] = np.array(self._camera.origin) + np.array((0.0, 0.0, self._mount.height))
        camera: Array = links[self._camera.link] @ optical
        return camera

    def boxes(self, links: dict[str, Array]) -> Boxes:
        """Return the boxes of all links but the unseen ones."""
        transforms = np.stack([links[name] for name in self._links])
        transforms[:, :3, 3] += np.einsum("bij,bj->bi", transforms[:, :3, :3], self._centres)
        return Boxes(transforms, self._sizes, self._colours)

    def as_others_see_it(self, team_colour: str) -> Body:
        """Return the body of such a robot in a team's colour with its head and `MATCH_MARKERS`, as in a match."""
        if team_colour not in self._figures:
            self._figures[team_colour] = Body(self._robot, team_colour, HIDDEN, worn=MATCH_MARKERS)
        return self._figures[team_colour]

    def feet(self, links: dict[str, Array]) -> list[tuple[float, float]]:
        """Return x, y of both soles in map [m]."""
        places = [links[sole.link][:3, 3] + links[sole.link][:3, :3] @ np.array(sole.origin) for sole in self._soles]
        return [(float(place[0]), float(place[1])) for place in places]


def _transform(position: Array, orientation: Array) -> Array:
    """Return the (4, 4) transform of a place (3,) [m] and a quaternion (4,) x, y, z, w."""
    transform = np.eye(4)
    transform[:3, :3] = quaternion_matrix((orientation / np.linalg.norm(orientation)).tolist())
    transform[:3, 3] = position
    return transform


def _cross_matrix(axis: Sequence[float]) -> Array:
    """Return the (3, 3) matrix that takes a vector to the cross product of an axis with it."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def scene_of(truth: Truth, body: Body, keeper_colour: str) -> tuple[Scene, dict[str, Array]]:
    """Return what stands on the field at one instant, and the (4, 4) pose of each of the robot's links in map.

    Args:
        truth: The world.
        body: The robot's shape, with the parts that are to be seen.
        keeper_colour: Of the markers of the keeper and of the other robots: opponents all.
    """
    links = body.links_in_map(_transform(truth.base_position, truth.base_orientation), truth.joint_positions)
    boxes = body.boxes(links)
    shadows = [(x, y, FOOT_SHADOW) for x, y in body.feet(links)]
    figure = body.as_others_see_it(keeper_colour) if truth.others else body
    for other in truth.others:
        other_links = figure.links_in_map(
            _transform(other.base_position, other.base_orientation), other.joint_positions
        )
        boxes = boxes + figure.boxes(other_links)
        shadows += [(x, y, FOOT_SHADOW) for x, y in figure.feet(other_links)]
    for place in truth.figures:
        boxes = boxes + keeper_boxes(place, keeper_colour)
        shadows.append((place.x, place.y, KEEPER_SHADOW))
    return Scene(truth.ball_position, boxes, truth.poles, tuple(shadows)), links
