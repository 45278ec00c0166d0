"""What vision would find, from the truth: directions through the real lens, with noise, misses and delay; no pictures.

For benches of the head and of the world model that need many minutes of play. The camera's attitude errs as that of a
walking robot does: slowly, and the same for all features of a picture. Lines are left out, so localization lives on
posts, poles, crossings and marks alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import CrossingKind, Field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_vision.lens import Lens

Array = NDArray[np.float64]
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
CROSSINGS = {
    CrossingKind.L: FeatureClass.CROSSING_L,
    CrossingKind.T: FeatureClass.CROSSING_T,
    CrossingKind.X: FeatureClass.CROSSING_X,
}


@dataclass(frozen=True)
class SeenParameters:
    """How vision errs."""

    spread: float = math.radians(0.3)  # [rad] of each angle of each feature
    tilt_spread: float = math.radians(0.4)  # [rad] of roll and pitch of the camera, while walking
    azimuth_spread: float = math.radians(0.3)  # [rad] of all azimuths of a picture
    memory: float = 0.4  # [s] how long the last two last: a step
    found: float = 0.9  # of what is in the picture
    sharp_speed: float = 1.5  # [rad/s] of the head, up to which pictures are sharp
    blurred_speed: float = 4.0  # [rad/s] at which nothing is found any more
    edge: float = 6.0  # [px] from the picture's edge where nothing is found
    least_ball: float = 4.0  # [px] diameter of the smallest ball found: vision's least area of 12 px^2
    post_reach: float = 8.0  # [m]
    pole_reach: float = 7.0  # [m]
    crossing_reach: float = 5.0  # [m]
    mark_reach: float = 3.5  # [m]


class Seen:
    """Makes the features of pictures."""

    def __init__(
        self, parameters: SeenParameters, field: Field, robot: Robot, lens: Lens, rng: np.random.Generator
    ) -> None:
        """Prepare for a field and a camera; all that is random comes from `rng`."""
        self._p, self._robot, self._lens, self._rng = parameters, robot, lens, rng
        self._height = standing_posture(robot).base_height
        self._radius = field.ball_radius
        p = parameters
        yellow = FeatureClass.POLE_YELLOW_BLUE_YELLOW
        self._landmarks: list[tuple[FeatureClass, tuple[float, float], float]] = [
            *((FeatureClass.GOAL_POST, (post.x, post.y), p.post_reach) for post in field.goal_posts),
            *(
                (yellow if pole.colours[0] == "yellow" else FeatureClass.POLE_BLUE_YELLOW_BLUE,
                 (pole.x, pole.y), p.pole_reach)
                for pole in field.poles
            ),
            *((CROSSINGS[each.kind], (each.x, each.y), p.crossing_reach) for each in field.crossings),
            *((FeatureClass.PENALTY_MARK, mark, p.mark_reach) for mark in field.penalty_marks),
        ]  # fmt: skip
        self._errors = np.zeros(3)  # roll, pitch, azimuth

    def camera(self, head: Array) -> Array:
        """Return the (4, 4) camera_optical_frame in base_footprint of an upright robot, given pan and tilt [rad]."""
        return camera_in_footprint(self._robot, self._height, UPRIGHT, float(head[0]), float(head[1]))

    def in_picture(self, points: Array, head: Array) -> NDArray[np.bool_]:
        """Tell which points (n, 3) of base_footprint [m] are in the picture, away from its edge."""
        camera = self.camera(head)
        pixels = self._lens.project((points - camera[:3, 3]) @ camera[:3, :3])
        edge = self._p.edge
        with np.errstate(invalid="ignore"):
            inside = (pixels >= edge) & (pixels <= (self._lens.width - 1 - edge, self._lens.height - 1 - edge))
        return np.asarray(inside.all(axis=1))

    def ball_diameter(self, ball: Array, head: Array) -> float:
        """Return how large a ball (3,) of base_footprint [m] is in the picture [px]."""
        offset = ball - self.camera(head)[:3, 3]
        distance = float(np.linalg.norm(offset))
        cosine = float(offset @ self.camera(head)[:3, 2]) / distance
        return 2.0 * math.asin(self._radius / distance) / self._lens.angle_per_pixel(cosine)

    def picture(
        self, stamp: int, elapsed: float, pose: Pose2D, head: Array, head_speed: float, ball: Array | None
    ) -> Features:
        """Return the features of a picture.

        Args:
            stamp: Of the picture [ns].
            elapsed: Since the last one [s].
            pose: base_footprint in map, truly.
            head: (2,) pan and tilt [rad].
            head_speed: Of the faster of the two joints [rad/s].
            ball: (2,) in map [m], truly, or None.
        """
        p, rng = self._p, self._rng
        keep = math.exp(-elapsed / p.memory)
        spreads = np.array([p.tilt_spread, p.tilt_spread, p.azimuth_spread])
        self._errors = keep * self._errors + math.sqrt(1.0 - keep**2) * spreads * rng.normal(size=3)
        blurred = (head_speed - p.sharp_speed) / (p.blurred_speed - p.sharp_speed)
        found = p.found * min(1.0, max(0.0, 1.0 - blurred))
        camera = self.camera(head)
        to_robot = pose.inverse()
        places = [(*to_robot.transform(place), 0.0) for _, place, _ in self._landmarks]
        inside = self.in_picture(np.array(places), head)
        features = [
            self._feature(kind, np.array(place), camera)
            for (kind, _, reach), place, visible in zip(self._landmarks, places, inside, strict=True)
            if visible and math.hypot(place[0], place[1]) < reach and rng.random() < found
        ]
        if ball is not None:
            here = np.array([*to_robot.transform((float(ball[0]), float(ball[1]))), self._radius])
            if self.sees_ball(here, head) and rng.random() < found:
                distance = float(np.linalg.norm(here - camera[:3, 3]))
                size = math.asin(self._radius / distance) + 0.0008 * float(rng.normal())
                features.append(self._feature(FeatureClass.BALL, here, camera, size))
        width, height = self._lens.field_of_view
        pan, tilt = float(head[0]), float(head[1])
        view = np.array([pan + width / 2.0, pan - width / 2.0, -tilt - height / 2.0, -tilt + height / 2.0])
        return Features(stamp, camera[:3, 3], view, tuple(features))

    def sees_ball(self, ball: Array, head: Array) -> bool:
        """Tell whether a ball (3,) of base_footprint [m] is in the picture and big enough."""
        return bool(self.in_picture(ball[None], head)[0]) and self.ball_diameter(ball, head) >= self._p.least_ball

    def _feature(self, kind: FeatureClass, point: Array, camera: Array, size: float = math.nan) -> Feature:
        offset = point - camera[:3, 3]
        roll, pitch, turn = self._errors.tolist()
        x, y, z = (offset + np.cross([roll, pitch, 0.0], offset)).tolist()
        noise = self._p.spread * self._rng.normal(size=2)
        azimuth = wrap_angle(math.atan2(y, x) + turn + float(noise[0]))
        elevation = math.atan2(z, math.hypot(x, y)) + float(noise[1])
        return Feature(kind, azimuth, elevation, self._p.spread, self._p.spread, 0.9, angular_radius=size)
