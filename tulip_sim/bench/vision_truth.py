"""What a picture shows: ball, posts, poles, opponents, crossings and marks, and how much of each is to be seen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_sim.scene import Body, Boxes, scene_of
from tulip_sim.truth import Truth
from tulip_vision.features import FeatureClass
from tulip_vision.view import View

Array = NDArray[np.float64]

GROUPS: dict[str, tuple[FeatureClass, ...]] = {
    "ball": (FeatureClass.BALL,),
    "post": (FeatureClass.GOAL_POST,),
    "pole": (FeatureClass.POLE_YELLOW_BLUE_YELLOW, FeatureClass.POLE_BLUE_YELLOW_BLUE),
    "opponent": (FeatureClass.OPPONENT,),
    "crossing": (FeatureClass.CROSSING_L, FeatureClass.CROSSING_T, FeatureClass.CROSSING_X),
    "mark": (FeatureClass.PENALTY_MARK,),
    "circle": (FeatureClass.CENTRE_CIRCLE,),
}
"""Classes of features, by the names that are used for things here."""

KINDS = {"L": FeatureClass.CROSSING_L, "T": FeatureClass.CROSSING_T, "X": FeatureClass.CROSSING_X}
AROUND = np.array([[math.cos(turn), math.sin(turn), 0.0] for turn in np.linspace(0.0, 2.0 * math.pi, 13)[:-1]])
DISK = np.array([[share * math.cos(turn), share * math.sin(turn)] for share in (0.35, 0.7, 0.95) for turn in range(7)])
"""Points of a ball's disk in radii, at which its visible share is taken."""
BOX_MARGIN = 0.01  # [m] a picture blurs the edges of bodies
OPPONENT_REACH = 0.25  # [m] from its middle to its feet and arms
WHOLE, PARTLY = 0.9, 0.4
"""Visible share of a ball from which it counts as whole, and as partly hidden."""


@dataclass(frozen=True)
class Thing:
    """Something that a picture may show.

    Attributes:
        kinds: Classes that it may be reported as.
        point: (3,) in base_footprint [m].
        distance: Along the ground from the camera [m].
        whole: True where all of it that matters is in the picture and nothing hides it.
        partly: True where a part of it is hidden, but enough is seen to find it.
    """

    kinds: tuple[FeatureClass, ...]
    point: Array
    distance: float
    whole: bool
    partly: bool = False


class Hiding:
    """What hides things from the camera: boxes of robot and keeper, and upright cylinders, all in map."""

    def __init__(self, eye: Array) -> None:
        """Begin with nothing.

        Args:
            eye: (3,) the camera [m].
        """
        self._eye = eye
        self._boxes: list[tuple[str, Boxes]] = []
        self._cylinders: list[tuple[str, Array, float, float]] = []

    def add_boxes(self, owner: str, boxes: Boxes) -> None:
        """Add the parts of a body."""
        self._boxes.append((owner, boxes))

    def add_cylinder(self, owner: str, foot: Array, radius: float, height: float) -> None:
        """Add an upright cylinder on the ground, foot (2,), or what is as good as one."""
        self._cylinders.append((owner, foot, radius, height))

    def hides(self, points: Array, owner: str) -> NDArray[np.bool_]:
        """Return (n,) whether something of another owner lies between the eye and points (n, 3)."""
        hidden = np.zeros(len(points), dtype=np.bool_)
        for name, boxes in self._boxes:
            if name != owner and len(boxes.sizes):
                hidden |= self._by_boxes(points, boxes)
        for name, foot, radius, height in self._cylinders:
            if name != owner:
                hidden |= self._by_cylinder(points, foot, radius, height)
        return hidden

    def _by_boxes(self, points: Array, boxes: Boxes) -> NDArray[np.bool_]:
        """Cut lines of sight with slabs: in each box's own axes."""
        turns, middles = boxes.transforms[:, :3, :3], boxes.transforms[:, :3, 3]
        start = np.einsum("bji,bj->bi", turns, self._eye - middles)  # (boxes, 3)
        along = np.einsum("bji,nj->nbi", turns, points - self._eye)
        along = np.where(np.abs(along) < 1e-9, 1e-9, along)
        half = boxes.sizes / 2.0 + BOX_MARGIN
        one, other = (-half - start) / along, (half - start) / along
        enter, leave = np.minimum(one, other).max(axis=2), np.maximum(one, other).min(axis=2)
        cut: NDArray[np.bool_] = ((enter < leave) & (leave > 0.0) & (enter < 0.98)).any(axis=1)
        return cut

    def _by_cylinder(self, points: Array, foot: Array, radius: float, height: float) -> NDArray[np.bool_]:
        along = np.linspace(0.02, 0.98, 60)[:, None, None]
        sight = self._eye + along * (points - self._eye)  # (60, n, 3)
        near = np.hypot(sight[..., 0] - foot[0], sight[..., 1] - foot[1]) < radius
        cut: NDArray[np.bool_] = (near & (sight[..., 2] < height)).any(axis=0)
        return cut


def things(truth: Truth, body: Body, field: Field, view: View) -> dict[str, list[Thing]]:
    """Return what a picture shows, by the names of `GROUPS`.

    Args:
        truth: The world.
        body: The robot's own.
        field: Goals, poles and lines.
        view: The picture's true geometry.
    """
    footprint, ball = truth.footprint, truth.ball_position
    eye = np.array([*footprint.transform(view.position[:2]), view.position[2]])
    hiding = Hiding(eye)
    alone, _ = scene_of(replace(truth, keeper=None, others=()), body, "cyan")
    together, _ = scene_of(truth, body, "cyan")
    hiding.add_boxes("self", alone.boxes)
    hiding.add_boxes("opponent", together.boxes.after(len(alone.boxes.sizes)))
    hiding.add_cylinder("ball", ball[:2], field.ball_radius, 2.0 * field.ball_radius)
    for index, post in enumerate(field.goal_posts):
        hiding.add_cylinder(f"post{index}", np.array([post.x, post.y]), post.radius + 0.01, post.height)
    for index, pole in enumerate(field.poles):
        hiding.add_cylinder(f"pole{index}", np.array([pole.x, pole.y]), pole.radius + 0.01, pole.height)

    def seen(points: Array, owner: str, margin: float) -> NDArray[np.bool_]:
        """Return (n,) whether points (n, 3) in map are in the picture and nothing hides them."""
        local = (points - [footprint.x, footprint.y, 0.0]) @ _upright(footprint)
        return view.inside(view.pixels(local), margin) & ~hiding.hides(points, owner)

    found: dict[str, list[Thing]] = {name: [] for name in GROUPS}

    def add(name: str, these: tuple[FeatureClass, ...], point: Array, whole: bool, partly: bool = False) -> None:
        local = np.array([*footprint.inverse().transform(point[:2]), point[2]])
        distance = math.hypot(*(local[:2] - view.position[:2]))
        found[name].append(Thing(these, local, distance, whole, partly))

    share = float(seen(_disk(ball, field.ball_radius, eye), "ball", 1.0).mean())
    add("ball", GROUPS["ball"], ball, share >= WHOLE, PARTLY <= share < WHOLE)
    for index, post in enumerate(field.goal_posts):
        foot = np.array([post.x, post.y, 0.0])
        axis = foot + np.outer([0.0, 0.15, 0.4, 0.8], [0.0, 0.0, 1.0])
        add("post", GROUPS["post"], foot, bool(seen(axis, f"post{index}", 8.0).all()))
    for index, pole in enumerate(field.poles):
        foot = np.array([pole.x, pole.y, 0.0])
        kind = GROUPS["pole"][0 if pole.colours[0] == "yellow" else 1]
        near = pole.radius * (eye - foot) / np.linalg.norm(eye[:2] - foot[:2]) * [1, 1, 0]
        axis = foot + near + np.outer([0.0, 0.3, 0.55], [0.0, 0.0, 1.0])
        add("pole", (kind,), foot, bool(seen(axis, f"pole{index}", 15.0).all()))
    for opponent in (*truth.figures, *(other.footprint for other in truth.others)):
        here = np.array([opponent.x, opponent.y, 0.0])
        outline = np.concatenate([here + OPPONENT_REACH * AROUND, here + np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.95]])])
        add("opponent", GROUPS["opponent"], here, bool(seen(outline, "opponent", 0.0).all()))
    for crossing in field.crossings:
        point = np.array([crossing.x, crossing.y, 0.0])
        ring = np.concatenate([point[None], point + 0.18 * AROUND, point + 0.36 * AROUND])
        add("crossing", (KINDS[crossing.kind.value],), point, bool(seen(ring, "", 4.0).all()))
    for mark in field.penalty_marks:
        point = np.array([*mark, 0.0])
        ring = np.concatenate([point[None], point + 0.2 * AROUND])
        add("mark", GROUPS["mark"], point, bool(seen(ring, "", 2.0).all()))
    circle = field.centre_circle
    middle = np.array([circle.x, circle.y, 0.0])
    add("circle", GROUPS["circle"], middle, float(seen(middle + circle.radius * AROUND, "", 4.0).mean()) >= WHOLE)
    return found


def border_distances(points: Array, field: Field) -> Array:
    """Return how far points on the ground, (n, 2) in map [m], are from the carpet's edge, (n,) [m]."""
    half = np.array([field.carpet_length, field.carpet_width]) / 2.0
    beyond = np.abs(points) - half  # negative inside
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    edges: Array = np.where((beyond < 0.0).all(axis=1), -beyond.max(axis=1), outside)
    return edges


def line_distances(points: Array, field: Field) -> Array:
    """Return how far points on the ground, (n, 2) in map [m], are from the middle of the nearest line, (n,) [m]."""
    circle = field.centre_circle
    least = np.abs(np.hypot(points[:, 0] - circle.x, points[:, 1] - circle.y) - circle.radius)
    for line in field.line_segments:
        start, along = np.array(line.start), np.subtract(line.end, line.start) / line.length
        place = np.clip((points - start) @ along, 0.0, line.length)
        least = np.minimum(least, np.linalg.norm(points - start - place[:, None] * along, axis=1))
    return np.asarray(least, dtype=np.float64)


def _upright(footprint: Pose2D) -> Array:
    """Return the (3, 3) rotation of base_footprint in map."""
    turn = np.eye(3)
    turn[:2, :2] = footprint.rotation()
    return turn


def _disk(centre: Array, radius: float, eye: Array) -> Array:
    """Return (n, 3) points of the ball's disk as the camera sees it [m]."""
    ray = (centre - eye) / np.linalg.norm(centre - eye)
    right = np.cross(ray, [0.0, 0.0, 1.0])
    right /= max(float(np.linalg.norm(right)), 1e-9)
    places: Array = centre + radius * DISK @ np.stack([right, np.cross(right, ray)])
    return places
