"""What stands in the way between the camera and a point: boxes, upright cylinders and the ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_sim.scene import Boxes

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SKIN = 0.03  # [m] a point this close to a thing belongs to it and is not hidden by it
FLAT = 1e-9  # [m] instead of zero where a line of sight runs along a box's side


@dataclass(frozen=True)
class Solids:
    """Things that hide others, in map.

    Attributes:
        boxes: Robots, the own body included.
        cylinders: (n, 4) x, y, radius and height [m] of upright cylinders on the ground: posts and poles.
        balls: (m, 4) centre x, y, z and radius [m].
    """

    boxes: Boxes
    cylinders: Array
    balls: Array

    def hide(self, eye: Array, points: Array) -> Mask:
        """Return which points cannot be seen from the eye.

        Args:
            eye: (3,) the camera's optical centre in map [m].
            points: (n, 3) in map [m].

        Returns:
            (n,) True where something is in between. A point on a thing's surface, or within `SKIN` of it, is not hidden
            by that thing.
        """
        if not len(points):
            return np.zeros(0, dtype=np.bool_)
        hidden = _hidden_by_boxes(eye, points, self.boxes)
        hidden |= _hidden_by_cylinders(eye, points, self.cylinders)
        return np.asarray(hidden | _hidden_by_balls(eye, points, self.balls))


def _hidden_by_boxes(eye: Array, points: Array, boxes: Boxes) -> Mask:
    """Meet lines of sight with boxes by the slab method (Kay and Kajiya, 1986).

    Along eye + t (point - eye), the line is between two opposite sides for t from t_in to t_out; it meets the box if
    the largest t_in of the three pairs of sides is less than the least t_out.
    """
    if not len(boxes.sizes):
        return np.zeros(len(points), dtype=np.bool_)
    rotations, middles = boxes.transforms[:, :3, :3], boxes.transforms[:, :3, 3]
    start = np.einsum("bji,bj->bi", rotations, eye - middles)  # (b, 3) the eye in each box
    way = np.einsum("bji,nj->nbi", rotations, points - eye)  # (n, b, 3)
    way = np.where(np.abs(way) < FLAT, FLAT, way)
    half = boxes.sizes / 2.0
    first, second = (-half - start) / way, (half - start) / way
    enters = np.minimum(first, second).max(axis=2)
    leaves = np.maximum(first, second).min(axis=2)
    length = np.linalg.norm(points - eye, axis=1)[:, None]
    between = (enters < leaves) & (leaves > 0.0) & (np.maximum(enters, 0.0) * length < length - SKIN)
    # A point inside or on the box is part of it.
    outside = (np.abs(start + way) > half + SKIN).any(axis=2)
    return np.asarray((between & outside).any(axis=1))


def _hidden_by_cylinders(eye: Array, points: Array, cylinders: Array) -> Mask:
    """Meet lines of sight, seen from above, with circles, and compare heights where they enter."""
    way = points[:, None, :2] - eye[:2]  # (n, 1, 2)
    to_axis = cylinders[None, :, :2] - eye[:2]  # (1, c, 2)
    square = np.maximum((way**2).sum(axis=2), FLAT)
    nearest = np.clip((way * to_axis).sum(axis=2) / square, 0.0, 1.0)  # share of the way that is closest to the axis
    aside = np.linalg.norm(nearest[..., None] * way - to_axis, axis=2)
    height = eye[2] + nearest * (points[:, 2] - eye[2])[:, None]
    own = np.linalg.norm(points[:, None, :2] - cylinders[None, :, :2], axis=2) < cylinders[:, 2] + SKIN
    return np.asarray(((aside < cylinders[:, 2]) & (height < cylinders[:, 3]) & ~own).any(axis=1))


def _hidden_by_balls(eye: Array, points: Array, balls: Array) -> Mask:
    way = points[:, None] - eye
    to_middle = balls[None, :, :3] - eye
    nearest = np.clip((way * to_middle).sum(axis=2) / np.maximum((way**2).sum(axis=2), FLAT), 0.0, 1.0)
    aside = np.linalg.norm(nearest[..., None] * way - to_middle, axis=2)
    own = np.linalg.norm(points[:, None] - balls[None, :, :3], axis=2) < balls[:, 3] + SKIN
    return np.asarray(((aside < balls[:, 3]) & ~own).any(axis=1))
