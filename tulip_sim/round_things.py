"""The ball and soft shadows, drawn pixel by pixel from the rays of a small part of the picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_sim.solids import AMBIENT, LIGHT, Colour, View

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]

Window = tuple[slice, slice]


def window(view: View, points_in_camera: Array) -> Window | None:
    """Return the part of the picture that holds points given in camera_optical_frame; None if it is empty."""
    clipped = points_in_camera[view.inside(points_in_camera).min(axis=1) > 0.0]
    if not len(clipped):
        return None
    if len(clipped) < len(points_in_camera):  # partly outside: the rest may be anywhere up to the picture's edge
        outside = points_in_camera[view.inside(points_in_camera).min(axis=1) <= 0.0]
        clipped = np.concatenate([clipped, _pulled_in(view, outside)])
    pixels = view.lens.project(clipped)
    u0, v0 = np.floor(np.nanmin(pixels, axis=0)).astype(int) - 2
    u1, v1 = np.ceil(np.nanmax(pixels, axis=0)).astype(int) + 3
    columns = slice(max(int(u0), 0), min(int(u1), view.lens.width))
    rows = slice(max(int(v0), 0), min(int(v1), view.lens.height))
    return (rows, columns) if rows.start < rows.stop and columns.start < columns.stop else None


def _pulled_in(view: View, points: Array) -> Array:
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
    rays = view.lens.ray_table()[part].astype(np.float64)
    towards = middle / distance
    sine = np.linalg.norm(np.cross(rays, towards), axis=2)
    # Angle to the rim over the angle of a pixel, both by their sines, which are small: coverage of the pixel.
    pixel = 1.0 / view.focal
    coverage = np.clip((radius / distance - sine) / pixel + 0.5, 0.0, 1.0)
    coverage[rays @ towards < 0.0] = 0.0
    nearest = rays @ middle
    depth = nearest - np.sqrt(np.maximum(radius**2 - (distance * sine) ** 2, 0.0))
    normals = (rays * depth[..., None] - middle) / radius
    brightness = (normals @ (LIGHT @ rotation))[..., None]
    # A floor that reflects light keeps the lower half from black; the lamp's reflex is small and soft.
    shade = AMBIENT + (1.0 - AMBIENT) * (0.15 + brightness) / 1.15
    shade = np.maximum(shade, 0.42)
    reflex = 70.0 * np.maximum(brightness, 0.0) ** 24
    ball = np.array(colour) * shade + reflex
    below = picture[part]
    picture[part] = np.clip(below + (ball - below) * coverage[..., None], 0.0, 255.0).astype(np.uint8)


def draw_shadow(
    picture: Bytes, view: View, camera_in_map: Array, spot: tuple[float, float, float], strength: float
) -> None:
    """Darken the ground softly below a thing.

    Args:
        picture: (H, W, 3), drawn into.
        view: Of the lens.
        camera_in_map: (4, 4).
        spot: x, y of its middle and its radius [m].
        strength: Share of the light that is missing in its middle.
    """
    rotation, eye = camera_in_map[:3, :3], camera_in_map[:3, 3]
    x, y, radius = spot
    if eye[2] < 0.1:
        return
    reach = 2.2 * radius  # where the shadow has faded to a hundredth
    angles = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ring = np.stack([x + reach * np.cos(angles), y + reach * np.sin(angles), np.zeros(12)], axis=1)
    middle = np.array([[x, y, 0.0]])
    part = window(view, (np.concatenate([ring, middle]) - eye) @ rotation)
    if part is None:
        return
    rays = view.lens.ray_table()[part] @ rotation.T.astype(np.float32)
    down = -rays[..., 2]
    reach_to_ground = np.float32(eye[2]) / np.maximum(down, np.float32(1e-3))
    dx = rays[..., 0] * reach_to_ground + np.float32(eye[0] - x)
    dy = rays[..., 1] * reach_to_ground + np.float32(eye[1] - y)
    dark = np.float32(strength) * np.exp((dx * dx + dy * dy) * np.float32(-1.0 / radius**2))
    picture[part] = (picture[part] * (1.0 - dark[..., None])).astype(np.uint8)
