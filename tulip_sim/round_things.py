"""The ball and soft shadows, drawn pixel by pixel from the rays of a small part of the picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_sim.solids import AMBIENT, LIGHT, Colour, View

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]

Window = tuple[slice, slice]

FADED = 2.2  # radii from the middle of a shadow to where it has faded to a hundredth
RING = np.array([[np.cos(turn), np.sin(turn), 0.0] for turn in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)])


def window(view: View, points_in_camera: Array) -> Window | None:
    """Return the part of the picture that holds points given in camera_optical_frame; None if it is empty."""
    inside = view.inside(points_in_camera).min(axis=1) > 0.0
    if not inside.any():
        return None
    clipped = points_in_camera[inside]
    if not inside.all():  # partly outside: the rest may be anywhere up to the picture's edge
        clipped = np.concatenate([clipped, _pulled_in(view, points_in_camera[~inside])])
    pixels = view.lens.project(clipped)
    u0, v0 = np.fmin.reduce(pixels, axis=0).tolist()  # fmin: of those that are not NaN
    u1, v1 = np.fmax.reduce(pixels, axis=0).tolist()
    columns = slice(max(math.floor(u0) - 2, 0), min(math.ceil(u1) + 3, view.lens.width))
    rows = slice(max(math.floor(v0) - 2, 0), min(math.ceil(v1) + 3, view.lens.height))
    return (rows, columns) if rows.start < rows.stop and columns.start < columns.stop else None


def _pulled_in(view: View, points: Array) -> Array:
    """Return points (n, 3) in the camera frame on the plane of depth 1, no farther out than the picture's edges."""
    limits = np.array([view.normals[0, 2], view.normals[2, 2]])
    depth = np.maximum(points[:, 2:], 1e-3)
    return np.concatenate([np.clip(points[:, :2] / depth, -limits, limits), np.ones((len(points), 1))], axis=1)


def draw_ball(picture: Bytes, view: View, camera_in_map: Array, centre: Array, radius: float, colour: Colour) -> None:
    """Draw a shaded sphere, anti-aliased, exact under the lens' distortion.

    Args:
        picture: (H, W, 3), drawn into.
        view: Of the lens.
        camera_in_map: (4, 4).
        centre: (3,) in map [m].
        radius: [m].
        colour: BGR in full light.
    """
    rotation = camera_in_map[:3, :3]
    middle = (centre - camera_in_map[:3, 3]) @ rotation
    distance = float(np.linalg.norm(middle))
    if distance <= radius * 1.05:
        return
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * radius
    part = window(view, np.concatenate([middle + corners, middle[None]]))
    if part is None:
        return
    rays = view.lens.ray_table()[part]
    lamp = LIGHT @ rotation
    along, lit = cv2.split(cv2.transform(rays, np.stack([middle / distance, lamp]).astype(np.float32)))
    squared = np.maximum(1.0 - along * along, 0.0)  # sine of the angle to the ball's middle
    # Angle to the rim over the angle of a pixel, both by their sines, which are small: coverage of the pixel.
    coverage = np.clip((radius / distance - np.sqrt(squared)) * view.focal + 0.5, 0.0, 1.0)
    coverage[along < 0.0] = 0.0
    depth = distance * along - np.sqrt(np.maximum(radius**2 - distance**2 * squared, 0.0))
    brightness = (lit * depth - float(middle @ lamp)) / radius
    # A floor that reflects light keeps the lower half from black; the lamp's reflex is small and soft.
    shade = np.maximum(AMBIENT + (1.0 - AMBIENT) * (0.15 + brightness) / 1.15, 0.42)
    reflex = np.maximum(brightness, 0.0) ** 8
    reflex = 70.0 * reflex * reflex * reflex
    below = picture[part]
    for channel, full in enumerate(colour):
        seen = below[..., channel]
        below[..., channel] = np.clip(seen + (full * shade + reflex - seen) * coverage, 0.0, 255.0)


def draw_shadows(
    picture: Bytes, view: View, camera_in_map: Array, spots: Sequence[tuple[float, float, float, float]]
) -> None:
    """Darken the ground softly below things.

    Args:
        picture: (H, W, 3), drawn into.
        view: Of the lens.
        camera_in_map: (4, 4).
        spots: For each thing x, y of its middle and its radius [m], and the share of the light missing in its middle.
    """
    eye = camera_in_map[:3, 3]
    if eye[2] < 0.1 or not len(spots):
        return
    places = np.array(spots)
    middles = np.column_stack([places[:, :2], np.zeros(len(places))])
    reach = FADED * places[:, 2:3]
    near = view.inside((middles - eye) @ camera_in_map[:3, :3]) > -reach * view.steepest
    for middle, (_, _, radius, strength) in zip(middles[near.all(axis=1)], places[near.all(axis=1)], strict=True):
        _draw_shadow(picture, view, camera_in_map, middle, float(radius), float(strength))


def _draw_shadow(
    picture: Bytes, view: View, camera_in_map: Array, middle: Array, radius: float, strength: float
) -> None:
    rotation, eye = camera_in_map[:3, :3], camera_in_map[:3, 3]
    ring = middle + FADED * radius * RING
    part = window(view, (np.concatenate([ring, middle[None]]) - eye) @ rotation)
    if part is None:
        return
    # On the ground, from the spot's middle and in radii.
    x, y, up = cv2.split(cv2.transform(view.lens.ray_table()[part], rotation.astype(np.float32)))
    reach = np.float32(eye[2] / radius) / np.maximum(-up, np.float32(1e-3))
    x = x * reach + np.float32((eye[0] - middle[0]) / radius)
    y = y * reach + np.float32((eye[1] - middle[1]) / radius)
    light = 255.0 - np.float32(255.0 * strength) * np.exp(-(x * x + y * y))
    lights = cv2.merge([light.round().astype(np.uint8)] * 3)
    picture[part] = cv2.multiply(picture[part], lights, scale=1.0 / 255.0)
