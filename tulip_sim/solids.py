"""Boxes and cylinders as flat faces, clipped to the camera's view and projected with the lens' distortion.

Faces of many solids lie in flat arrays (all corners of all faces, one after the other), so that a whole
scene is projected by one call. Edges are subdivided, because the lens bends straight ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_vision.lens import Lens

Array = NDArray[np.float64]
Colour = tuple[float, float, float]

NEAR = 0.03  # [m] nothing nearer than this to the optical centre is drawn
EDGE_STEP = 0.06  # [rad] longest piece of a subdivided edge: bent by 0.2 px at most by the head camera's lens
OUTLINE = 0.65  # [px] by which OpenCV's anti-aliased filling is too large on each side; measured
SHIFT = 4  # fractional bits of OpenCV's drawing coordinates
LIGHT = np.array([0.25, 0.15, 0.956])  # towards the lamps, in map
AMBIENT = 0.62  # share of the light that comes from everywhere

TOUCH = 1e-6  # [m] boxes that overlap by less than this count as side by side

CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64) - 0.5
BOX_FACES = np.array([[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])
BOX_NORMALS = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], dtype=np.float64)
# The face on the other side of each edge (corner j to j + 1) of each face: the other one that has both corners.
BOX_NEIGHBOURS = np.array(
    [
        [next(g for g in range(6) if g != f and {face[j], face[(j + 1) % 4]} <= set(BOX_FACES[g])) for j in range(4)]
        for f, face in enumerate(BOX_FACES)
    ]
)


@dataclass(frozen=True)
class Faces:
    """Flat faces that look towards the camera.

    Attributes:
        points: (N, 3) corners of all faces, one face after the other [m].
        outline: (N,) whether the edge from a corner to the next one of its face is part of the solid's outline.
        counts: (F,) corners of each face.
        colours: (F, 3) BGR, shaded.
        distances: (F,) from the camera to the nearest point of the face's solid [m].
    """

    points: Array
    outline: NDArray[np.bool_]
    counts: NDArray[np.int64]
    colours: Array
    distances: Array


@dataclass(frozen=True)
class Polygon:
    """A face in the picture.

    Attributes:
        points: (n, 2) int32, pixels with SHIFT fractional bits.
        colour: BGR.
        distance: Of the solid [m].
    """

    points: NDArray[np.int32]
    colour: Colour
    distance: float


def join(parts: Sequence[Faces]) -> Faces:
    """Return all faces of several groups as one."""
    return Faces(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.outline for part in parts]),
        np.concatenate([part.counts for part in parts]),
        np.concatenate([part.colours for part in parts]),
        np.concatenate([part.distances for part in parts]),
    )


def light(normals: Array) -> Array:
    """Return (n,) brightness of surfaces with unit normals (n, 3) in map."""
    brightness: Array = AMBIENT + (1.0 - AMBIENT) * np.maximum(normals @ LIGHT, 0.0)
    return brightness


def box_faces(transforms: Array, sizes: Array, colours: Array, eye: Array) -> Faces:
    """Return the faces of boxes that look towards the eye.

    Args:
        transforms: (B, 4, 4) of each box's own frame, in its middle, in map.
        sizes: (B, 3) full edges [m].
        colours: (B, 3) BGR.
        eye: (3,) the camera's optical centre in map [m].
    """
    rotations, centres = transforms[:, :3, :3], transforms[:, :3, 3]
    eye_in_box = np.einsum("bji,bj->bi", rotations, eye - centres)
    half = sizes / 2.0
    visible = eye_in_box @ BOX_NORMALS.T > np.repeat(half, 2, axis=1)  # (B, 6)
    corners = centres[:, None] + (CORNERS * sizes[:, None]) @ rotations.transpose(0, 2, 1)
    nearest = np.linalg.norm(np.maximum(np.abs(eye_in_box) - half, 0.0), axis=1)
    distances = _depth_keys(transforms, half, corners, eye_in_box, nearest)
    outline = ~visible[:, BOX_NEIGHBOURS]  # (B, 6, 4)
    normals = np.einsum("bij,fj->bfi", rotations, BOX_NORMALS)
    shaded = colours[:, None] * light(normals)[..., None]
    box, face = np.nonzero(visible)
    return Faces(
        corners[box[:, None], BOX_FACES[face]].reshape(-1, 3),
        outline[box, face].reshape(-1),
        np.full(len(box), 4),
        shaded[box, face],
        distances[box],
    )


def _depth_keys(transforms: Array, half: Array, corners: Array, eye_in_box: Array, nearest: Array) -> Array:
    """Return (B,) distances that give the order of drawing: the nearest ones, corrected where one box hides another.

    A box cannot hide another one that lies, with the eye, on the outer side of the plane of one of its faces; nor one
    that such a plane separates from box and eye together. That puts boxes which do not overlap in order; a cycle is
    cut at its farthest box.
    """
    count = len(half)
    # Of box b: corners of each other box in b's frame, and the eye.
    offset = corners.reshape(1, -1, 3) - transforms[:, None, :3, 3]
    relative = (offset @ transforms[:, :3, :3]).reshape(count, count, len(CORNERS), 3)
    eye_in_box, half = eye_in_box[:, None], half[:, None]
    above, below = relative.min(axis=2) >= half - TOUCH, relative.max(axis=2) <= TOUCH - half  # (B, B, 3)
    behind = (above & (eye_in_box > half)) | (below & (eye_in_box < -half))
    cannot_hide = behind.any(axis=2)  # [b, a]: b cannot hide a
    eye_this_side = (above & (eye_in_box <= half)) | (below & (eye_in_box >= -half))
    cannot_hide |= eye_this_side.any(axis=2).T
    waits_for = cannot_hide.T & ~cannot_hide  # [a, b]: a is drawn after b
    np.fill_diagonal(waits_for, False)
    # Few boxes: plain numbers are faster than arrays here.
    range_of: list[float] = nearest.tolist()
    pending: list[int] = waits_for.sum(axis=1).tolist()
    followers = [[box for box, waits in enumerate(column) if waits] for column in waits_for.T.tolist()]
    keys = np.empty(count)
    left = list(range(count))
    key = math.inf
    while left:
        chosen = max([box for box in left if pending[box] == 0] or left, key=range_of.__getitem__)
        key = min(key, range_of[chosen])
        keys[chosen] = key
        left.remove(chosen)
        for box in followers[chosen]:
            pending[box] -= 1
    return keys


def cylinder_faces(
    start: Array, end: Array, radius: float, colours: Sequence[Colour], eye: Array, focal: float
) -> Faces:
    """Return a cylinder's side towards the eye as narrow strips, and its end that looks towards the eye.

    Args:
        start: (3,) middle of one end in map [m].
        end: (3,) middle of the other end [m].
        radius: [m].
        colours: BGR of sections of equal length, from start to end.
        eye: (3,) the camera's optical centre in map [m].
        focal: Focal length [px], for the number of strips.
    """
    axis = end - start
    length = float(np.linalg.norm(axis))
    axis = axis / length
    along = float((eye - start) @ axis)
    across = eye - start - along * axis
    gap = float(np.linalg.norm(across))
    distance = math.hypot(max(-along, along - length, 0.0), max(gap - radius, 0.0))
    if gap <= radius * 1.001:
        return Faces(np.empty((0, 3)), np.empty(0, bool), np.empty(0, int), np.empty((0, 3)), np.empty(0))
    towards = across / gap
    (ax, ay, az), (tx, ty, tz) = axis.tolist(), towards.tolist()
    sideways = np.array([ay * tz - az * ty, az * tx - ax * tz, ax * ty - ay * tx])  # np.cross is slow for one pair
    strips = int(min(max(2.0 * radius * focal / max(distance, 0.05) / 3.0, 1.0), 8.0))
    widest = math.sqrt(1.0 - (radius / gap) ** 2)  # sine of the angle at which the line of sight is a tangent
    sines = np.linspace(-widest, widest, strips + 1)
    edge = radius * (np.sqrt(1.0 - sines**2)[:, None] * towards + sines[:, None] * sideways)
    middle = (sines[1:] + sines[:-1]) / 2.0
    brightness = light(np.sqrt(1.0 - middle**2)[:, None] * towards + middle[:, None] * sideways)
    sections = len(colours)
    at = start + axis * (length * np.arange(sections + 1) / sections)[:, None]
    rims = at[:, None] + edge  # (sections + 1, strips + 1, 3)
    corners = np.stack([rims[:-1, :-1], rims[:-1, 1:], rims[1:, 1:], rims[1:, :-1]], axis=2)
    top_seen, bottom_seen = along > length, along < 0.0
    outline = np.zeros((sections, strips, 4), dtype=np.bool_)
    outline[0, :, 0], outline[:, -1, 1], outline[-1, :, 2], outline[:, 0, 3] = not bottom_seen, True, not top_seen, True
    shaded = np.array(colours)[:, None] * brightness[:, None]
    counts = np.full(sections * strips, 4)
    sides = Faces(
        corners.reshape(-1, 3), outline.reshape(-1), counts, shaded.reshape(-1, 3), np.full(len(counts), distance)
    )
    if not (top_seen or bottom_seen):
        return sides
    angles = np.linspace(0.0, 2.0 * math.pi, 17)[:-1] + math.pi / 16.0
    rim = radius * (np.cos(angles)[:, None] * towards + np.sin(angles)[:, None] * sideways)
    far = np.cos(angles + math.pi / 16.0) < 0.0  # the far half of the rim
    colour = np.array(colours[-1 if top_seen else 0]) * light(axis[None] if top_seen else -axis[None])
    cap = Faces((at[-1] if top_seen else at[0]) + rim, far, np.array([16]), colour[None], np.array([distance]))
    return join([sides, cap])


class View:
    """The pyramid that a lens sees, a little wider than the picture, for clipping."""

    def __init__(self, lens: Lens) -> None:
        """Measure the lens' field of view."""
        rays = lens.ray_table()
        rim = np.concatenate([rays[0], rays[-1], rays[:, 0], rays[:, -1]]).astype(np.float64)
        tangents = np.abs(rim[:, :2] / rim[:, 2:]).max(axis=0) * 1.08
        self.lens = lens
        self.focal = float(lens.camera_matrix[0, 0])
        self.normals = np.array(
            [
                [-1.0, 0.0, tangents[0]],
                [1.0, 0.0, tangents[0]],
                [0.0, -1.0, tangents[1]],
                [0.0, 1.0, tangents[1]],
                [0.0, 0.0, 1.0],
            ]
        )
        self.steepest = float(np.linalg.norm(self.normals, axis=1).max())
        self.offsets = np.array([0.0, 0.0, 0.0, 0.0, NEAR])

    def inside(self, points: Array) -> Array:
        """Return (n, 5) by how far points (n, 3) in camera_optical_frame are inside each bounding plane."""
        depths: Array = points @ self.normals.T - self.offsets
        return depths

    def project(self, faces: Faces, camera_in_map: Array) -> list[Polygon]:
        """Return what the picture shows of faces given in map, farthest solid first."""
        if not len(faces.counts):
            return []
        points = (faces.points - camera_in_map[:3, 3]) @ camera_in_map[:3, :3]
        depths = self.inside(points)
        starts = np.concatenate([[0], np.cumsum(faces.counts)[:-1]])
        hidden = np.maximum.reduceat(depths, starts, axis=0).min(axis=1) <= 0.0
        whole = np.minimum.reduceat(depths, starts, axis=0).min(axis=1) >= 0.0
        order = np.argsort(-faces.distances, kind="stable")
        order = order[~hidden[order]]
        loops, flags, kept = [], [], []
        for face in order:
            part = slice(starts[face], starts[face] + faces.counts[face])
            loop, flag = points[part], faces.outline[part]
            if not whole[face]:
                loop, flag = self._clip(loop, flag)
            if len(loop) >= 3:
                loops.append(loop)
                flags.append(flag)
                kept.append(face)
        if not kept:
            return []
        pixels, counts = self._pixels(np.concatenate(loops), np.concatenate(flags), np.array([len(x) for x in loops]))
        pieces = np.split(np.round(pixels * (1 << SHIFT)).astype(np.int32), np.cumsum(counts)[:-1])
        colours = faces.colours[kept].tolist()
        return [
            Polygon(piece, (colour[0], colour[1], colour[2]), float(faces.distances[face]))
            for piece, colour, face in zip(pieces, colours, kept, strict=True)
        ]

    def _clip(self, loop: Array, outline: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
        """Cut a face at the planes of the view, one after the other (Sutherland and Hodgman, 1974)."""
        # What lies inside a plane as a whole stays inside, whatever the other planes cut off.
        for plane in np.flatnonzero(self.inside(loop).min(axis=0) < 0.0).tolist():
            depth = (loop @ self.normals[plane] - self.offsets[plane]).tolist()
            points, flags = [], []
            for i in range(len(loop)):
                j = (i + 1) % len(loop)
                if depth[i] >= 0.0:
                    points.append(loop[i])
                    flags.append(outline[i])
                if (depth[i] >= 0.0) != (depth[j] >= 0.0):
                    points.append(loop[i] + (loop[j] - loop[i]) * (depth[i] / (depth[i] - depth[j])))
                    flags.append(bool(outline[i]) if depth[j] >= 0.0 else False)  # along the plane: no outline
            loop, outline = np.array(points).reshape(-1, 3), np.array(flags, dtype=bool)
            if not len(loop):
                break
        return loop, outline

    def _pixels(
        self, points: Array, outline: NDArray[np.bool_], counts: NDArray[np.int64]
    ) -> tuple[Array, NDArray[np.int64]]:
        """Subdivide the edges of faces in camera_optical_frame, project and shrink them."""
        following = _following(counts)
        unit = points / np.linalg.norm(points, axis=1, keepdims=True)
        angles = 2.0 * np.arcsin(np.minimum(np.linalg.norm(unit[following] - unit, axis=1) / 2.0, 1.0))
        pieces = np.maximum(np.ceil(angles / EDGE_STEP), 1.0).astype(np.int64)
        first = np.concatenate([[0], np.cumsum(pieces)[:-1]])
        edge = np.repeat(np.arange(len(points)), pieces)
        number = np.arange(len(edge)) - first[edge]
        # Equal steps of the angle would need care; equal steps of 1 / distance are equal steps in a flat picture.
        z0, z1 = points[edge, 2], points[following[edge], 2]
        share = number / pieces[edge]
        share = share * z0 / (share * z0 + (1.0 - share) * z1)
        fine = points[edge] + (points[following[edge]] - points[edge]) * share[:, None]
        fine_counts = np.add.reduceat(pieces, np.concatenate([[0], np.cumsum(counts)[:-1]]))
        return shrink(self.lens.project(fine), outline[edge], fine_counts), fine_counts


def shrink(pixels: Array, outline: NDArray[np.bool_], counts: NDArray[np.int64]) -> Array:
    """Return polygons whose outline edges have moved inwards by OUTLINE.

    Args:
        pixels: (N, 2) corners of all polygons, one after the other.
        outline: (N,) whether the edge from a corner to the next one moves.
        counts: (F,) corners of each polygon.
    """
    following = _following(counts)
    previous = np.empty_like(following)
    previous[following] = np.arange(len(following))
    edges = pixels[following] - pixels
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    areas = np.add.reduceat(pixels[:, 0] * pixels[following, 1] - pixels[following, 0] * pixels[:, 1], starts)
    sense = np.repeat(np.where(areas >= 0.0, 1.0, -1.0), counts)
    lengths = np.maximum(np.hypot(edges[:, 0], edges[:, 1]), 1e-9)
    normal = np.stack([-edges[:, 1], edges[:, 0]], axis=1) * (sense / lengths)[:, None]
    move = OUTLINE * outline
    before, moved_before = normal[previous], move[previous]
    cross = before[:, 0] * normal[:, 1] - before[:, 1] * normal[:, 0]
    corner = np.abs(cross) > 0.15
    safe = np.where(corner, cross, 1.0)
    met = (
        np.stack(
            [moved_before * normal[:, 1] - move * before[:, 1], before[:, 0] * move - normal[:, 0] * moved_before],
            axis=1,
        )
        / safe[:, None]
    )
    straight = (before * moved_before[:, None] + normal * move[:, None]) / 2.0
    shift = np.where(corner[:, None], met, straight)
    size = np.maximum(np.hypot(shift[:, 0], shift[:, 1]), 1e-9)
    shrunk: Array = pixels + shift * np.minimum(1.0, 2.0 * OUTLINE / size)[:, None]
    return shrunk


def _following(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for each corner the index of the next corner of the same face."""
    ends = np.cumsum(counts)
    following = np.arange(1, int(ends[-1]) + 1)
    following[ends - 1] = ends - counts
    return following
