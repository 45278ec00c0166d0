"""The head camera's renderer: numpy and OpenCV only, with the lens' distortion, shading, blur and noise.

Backdrop (ground and wall) by rays, solids by anti-aliased polygons from far to near, ball and shadows by rays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_mount import MountOffsets
from tulip_description.field import Field
from tulip_description.keeper import TEAM_COLOURS
from tulip_description.robot import Robot
from tulip_sim.backdrop import Backdrop
from tulip_sim.field_texture import ground_palette, paint_ground, paint_wall
from tulip_sim.round_things import draw_ball, draw_shadows
from tulip_sim.scene import (
    COLOURS,
    Body,
    Cylinder,
    Scene,
    goal_cylinders,
    net_threads,
    pole_cylinders,
    scene_of,
)
from tulip_sim.solids import SHIFT, View, box_faces, cylinder_faces, join
from tulip_sim.truth import Truth
from tulip_vision.lens import Lens

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]
Float = NDArray[np.float32]

FLOOR_COLOUR = (112, 118, 122)  # BGR of the hall's floor
CARPET_COLOUR = (62, 126, 52)
LINE_COLOUR = (216, 222, 220)
WALL_RADIUS = 8.5  # [m] of the round hall; the carpet's corner is at 6.4
WALL_HEIGHT = 6.0  # [m] enough for a camera that looks up by 30 deg
WALL_PIXEL = 0.02  # [m] what a pixel sees at 9 m
POLE_SHADOW = 0.22  # [m]
THREAD_PIECES = 6  # straight pieces of a thread of the net under distortion
NOISE_MARGIN = 64  # [px] by which the noise tile is larger than the picture: 4096 places to cut from


@dataclass(frozen=True)
class CameraParameters:
    """How the camera sees.

    Attributes:
        brightness: Gain of all channels.
        blue_gain, green_gain, red_gain: White balance.
        flicker: Standard deviation of each picture's gain: lamps and automatic exposure.
        vignetting: Share of the light that is missing in the picture's corners.
        blur: Standard deviation of the lens' blur [px]; 0 for none.
        noise: Standard deviation of each pixel's noise [grey levels]; 0 for none.
        shadow: Share of the light that is missing below a thing.
        mottling: Strength of the carpet's blotches, 0 to 1.
        net_thread: Diameter of the net's threads [m].
        team_colour: Of the robot's own marker.
        keeper_colour: Of the keeper's markers.
        hall_seed: Seeds the clutter on the walls and the blotches of carpet and floor.
        mount_angle: Roll, pitch and yaw of the camera on the head err by up to this [rad].
        mount_height: Its height on the head errs by up to this [m].
        mount_seed: Seeds these errors.
    """

    brightness: float = 1.0
    blue_gain: float = 1.0
    green_gain: float = 1.0
    red_gain: float = 1.0
    flicker: float = 0.02  # 2 %: mains flicker that the exposure time does not average out
    vignetting: float = 0.22  # cheap wide-angle lenses lose 15 to 40 %
    blur: float = 0.6  # a lens in focus spreads a point over about one pixel
    noise: float = 4.0  # a webcam indoors
    shadow: float = 0.5
    mottling: float = 0.6
    net_thread: float = 0.004
    team_colour: str = "cyan"
    keeper_colour: str = "magenta"
    hall_seed: int = 2013
    mount_angle: float = 0.0  # a camera screwed on by hand is off by 1 or 2 deg
    mount_height: float = 0.0
    mount_seed: int = 2013

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of its range.
        """
        for name in ("brightness", "blue_gain", "green_gain", "red_gain"):
            value = getattr(self, name)
            if not 0.1 <= value <= 3.0:
                raise ValueError(f"{name} is {value}; expected 0.1 to 3")
        for name in ("vignetting", "shadow", "mottling", "flicker"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0:
                raise ValueError(f"{name} is {value}; expected 0 to less than 1")
        for name, unit, most in (("blur", "px", 10.0), ("noise", "grey levels", 60.0), ("net_thread", "m", 0.05)):
            value = getattr(self, name)
            if not 0.0 <= value <= most:
                raise ValueError(f"{name} is {value} {unit}; expected 0 to {most:g} {unit}")
        if not (0.0 <= self.mount_angle <= 0.3 and 0.0 <= self.mount_height <= 0.1):
            raise ValueError(
                f"mount_angle is {self.mount_angle} rad, mount_height {self.mount_height} m;"
                " expected 0 to 0.3 rad and 0 to 0.1 m"
            )
        for name in ("team_colour", "keeper_colour"):
            value = getattr(self, name)
            if value not in TEAM_COLOURS:
                raise ValueError(f"{name} is {value!r}; expected {' or '.join(TEAM_COLOURS)}")


def draw_mount(parameters: CameraParameters) -> MountOffsets:
    """Return how the camera really sits on the head, drawn once by its seed."""
    roll, pitch, yaw, height = np.random.default_rng(parameters.mount_seed).uniform(-1.0, 1.0, 4).tolist()
    angle = parameters.mount_angle
    return MountOffsets(roll * angle, pitch * angle, yaw * angle, height * parameters.mount_height)


class CameraRenderer:
    """Renders what the head camera sees."""

    def __init__(self, parameters: CameraParameters, field: Field, robot: Robot, lens: Lens) -> None:
        """Paint ground and wall once; takes about a second.

        Args:
            parameters: How the camera sees.
            field: Lines, goals, poles and ball.
            robot: The camera's mount and the robot's own body.
            lens: The camera's lens.
        """
        rng = np.random.default_rng(parameters.hall_seed)
        self._parameters = parameters
        self._field = field
        self._body = Body(robot, parameters.team_colour, mount=draw_mount(parameters))
        self._view = View(lens)
        self._backdrop = Backdrop(
            lens,
            paint_ground(field, parameters.mottling, rng),
            ground_palette(FLOOR_COLOUR, CARPET_COLOUR, LINE_COLOUR),
            paint_wall(2.0 * math.pi * WALL_RADIUS, WALL_HEIGHT, WALL_PIXEL, rng),
            WALL_RADIUS,
            WALL_PIXEL,
        )
        goals = (field.own_goal, field.opponent_goal)
        self._goal_cylinders = tuple(cylinder for goal in goals for cylinder in goal_cylinders(goal))
        self._pole_cylinders = pole_cylinders(field)
        threads = np.concatenate([net_threads(goal) for goal in goals])
        share = np.linspace(0.0, 1.0, THREAD_PIECES + 1)[None, :, None]
        self._threads = threads[:, :1] + (threads[:, 1:] - threads[:, :1]) * share  # (n, THREAD_PIECES + 1, 3)
        self._gain = _sensor_gain(lens, parameters)
        noise = _noise_tile(lens, parameters.noise, rng)
        self._brighter, self._darker = np.maximum(noise, 128) - 128, 128 - np.minimum(noise, 128)

    def render(self, truth: Truth, rng: np.random.Generator) -> Bytes:
        """Return the (H, W, 3) BGR picture that the head camera takes of the world.

        Args:
            truth: The world.
            rng: Where flicker and noise come from.
        """
        return self.render_over((truth,), rng)

    def render_over(self, truths: Sequence[Truth], rng: np.random.Generator) -> Bytes:
        """Return the (H, W, 3) BGR picture of a world that moves while light falls in: the mean of its states.

        Args:
            truths: The world at equal steps of the exposure, at least one.
            rng: Where flicker and noise come from.
        """
        light: Float | None = None
        for truth in truths:
            scene, links = scene_of(truth, self._body, self._parameters.keeper_colour)
            clean = self.render_scene(self._body.camera_in_map(links), scene)
            if len(truths) == 1:
                return self.expose(clean, rng)
            light = clean.astype(np.float32) if light is None else cv2.accumulate(clean, light)
        if light is None:
            raise ValueError("no state of the world; expected at least one")
        return self.expose(cv2.convertScaleAbs(light, alpha=1.0 / len(truths)).astype(np.uint8), rng)

    def render_scene(self, camera_in_map: Array, scene: Scene) -> Bytes:
        """Return the (H, W, 3) BGR picture without the camera's own faults: no blur, noise or vignetting.

        Args:
            camera_in_map: (4, 4) transform of camera_optical_frame in map.
            scene: What stands on the field.
        """
        picture = self._backdrop.draw(camera_in_map)
        eye = camera_in_map[:3, 3]
        ball_radius = self._field.ball_radius
        strength = self._parameters.shadow
        poles = self._pole_cylinders if scene.poles else ()
        shadows = [(*spot, strength) for spot in scene.shadows]
        shadows += [(float(pole.start[0]), float(pole.start[1]), POLE_SHADOW, strength) for pole in poles]
        if scene.ball is not None:
            # The shadow fades and widens as the ball leaves the ground.
            lift = max(float(scene.ball[2]) - ball_radius, 0.0) / ball_radius
            size, faded = ball_radius * (0.85 + 0.3 * lift), strength * 1.2 / (1.2 + lift)
            shadows.append((float(scene.ball[0]), float(scene.ball[1]), size, faded))
        draw_shadows(picture, self._view, camera_in_map, shadows)
        self._draw_nets(picture, camera_in_map)
        boxes = scene.boxes.inside(self._view, camera_in_map)
        faces = [box_faces(boxes.transforms, boxes.sizes, boxes.colours, eye)]
        for cylinder in self._seen((*self._goal_cylinders, *poles), camera_in_map):
            faces.append(
                cylinder_faces(cylinder.start, cylinder.end, cylinder.radius, cylinder.colours, eye, self._view.focal)
            )
        ball_distance = -1.0 if scene.ball is None else float(np.linalg.norm(scene.ball - eye)) - ball_radius
        ball_drawn = scene.ball is None
        for polygon in [*self._view.project(join(faces), camera_in_map), None]:
            if scene.ball is not None and not ball_drawn and (polygon is None or polygon.distance < ball_distance):
                colour = COLOURS[self._field.ball_colour]
                draw_ball(picture, self._view, camera_in_map, scene.ball, ball_radius, colour)
                ball_drawn = True
            if polygon is not None:
                cv2.fillPoly(picture, [polygon.points], polygon.colour, cv2.LINE_AA, SHIFT)
        return picture

    def expose(self, picture: Bytes, rng: np.random.Generator) -> Bytes:
        """Return a clean picture (H, W, 3) with blur, vignetting, gain, flicker and noise.

        Args:
            picture: From `render_scene`.
            rng: Where flicker and noise come from.
        """
        parameters = self._parameters
        if parameters.blur > 0.0:
            size = 2 * math.ceil(1.6 * parameters.blur) + 1  # further out is less than one grey level
            picture = np.asarray(cv2.GaussianBlur(picture, (size, size), parameters.blur), np.uint8)
        flicker = max(1.0 + parameters.flicker * float(rng.standard_normal()), 0.1)
        picture = np.asarray(cv2.multiply(picture, self._gain, scale=flicker * self._gain_scale / 255.0), np.uint8)
        row, column = (int(offset) for offset in rng.integers(0, NOISE_MARGIN, 2))
        if parameters.noise > 0.0:
            height, width = picture.shape[:2]
            part = slice(row, row + height), slice(column, column + width)
            cv2.add(picture, self._brighter[part], dst=picture)
            cv2.subtract(picture, self._darker[part], dst=picture)
        return picture

    @property
    def _gain_scale(self) -> float:
        p = self._parameters
        return p.brightness * max(p.blue_gain, p.green_gain, p.red_gain)

    def _seen(self, cylinders: Sequence[Cylinder], camera_in_map: Array) -> list[Cylinder]:
        """Return those that a camera may see."""
        ends = np.array([(each.start, each.end) for each in cylinders]) - camera_in_map[:3, 3]
        depths = self._view.inside(ends @ camera_in_map[:3, :3]).max(axis=1)  # of the better end: (n, 5)
        reach = np.array([each.radius for each in cylinders]) * self._view.steepest
        seen = (depths > -reach[:, None]).all(axis=1)
        return [each for each, may_be in zip(cylinders, seen.tolist(), strict=True) if may_be]

    def _draw_nets(self, picture: Bytes, camera_in_map: Array) -> None:
        points = (self._threads - camera_in_map[:3, 3]) @ camera_in_map[:3, :3]
        flat = points.reshape(-1, 3)
        inside = (self._view.inside(flat).min(axis=1) > 0.0).reshape(points.shape[:2])
        seen = inside[:, :-1] & inside[:, 1:]
        if not seen.any():
            return
        pixels = self._view.lens.project(np.where(inside.reshape(-1, 1), flat, np.array([0.0, 0.0, 1.0])))
        fixed = np.round(pixels.reshape(*points.shape[:2], 2) * (1 << SHIFT)).astype(np.int32)
        whole = seen.all(axis=1)
        parts = seen & ~whole[:, None]
        lines = [*fixed[whole], *np.stack([fixed[:, :-1][parts], fixed[:, 1:][parts]], axis=1)]
        distance = float(np.median(points[..., 2][inside]))
        # Thinner than a pixel, a thread covers only a part of it. Light threads before a dark hall add light.
        coverage = min(self._parameters.net_thread * self._view.focal / distance, 1.0)
        mask = np.zeros(picture.shape[:2], np.uint8)
        cv2.polylines(mask, lines, False, round(130.0 * coverage), 1, cv2.LINE_AA, SHIFT)
        left, top, width, height = cv2.boundingRect(mask)
        if width == 0:
            return
        part = slice(top, top + height), slice(left, left + width)
        picture[part] = cv2.add(picture[part], cv2.merge([mask[part]] * 3))


def _sensor_gain(lens: Lens, parameters: CameraParameters) -> Bytes:
    """Return (H, W, 3): vignetting and white balance, 255 for the brightest channel in the middle."""
    cosine = lens.ray_table()[..., 2].astype(np.float64)
    # Grows with the square of the angle's sine, so that the corners lose the stated share.
    loss = parameters.vignetting * (1.0 - cosine**2) / float(np.nanmax(1.0 - cosine**2))
    loss[np.isnan(loss)] = 1.0  # no light falls into the corners round a fisheye's picture
    balance = np.array([parameters.blue_gain, parameters.green_gain, parameters.red_gain])
    gain = (1.0 - loss)[..., None] * (balance / balance.max())
    return np.asarray((255.0 * gain).round(), np.uint8)


def _noise_tile(lens: Lens, deviation: float, rng: np.random.Generator) -> Bytes:
    """Return a tile of noise round 128, larger than the picture, a little smoothed as by a colour sensor's mosaic."""
    shape = (lens.height + NOISE_MARGIN, lens.width + NOISE_MARGIN, 3)
    noise = rng.standard_normal(shape).astype(np.float32)
    noise = np.asarray(cv2.GaussianBlur(noise, (3, 3), 0.55), np.float32)
    noise *= np.float32(deviation / float(noise.std()))
    tile: Bytes = np.clip(noise + 128.0, 0.0, 255.0).round().astype(np.uint8)
    return tile
