"""A walk over the field with what odometry and vision would say: for tests of the world model.

Knows the camera's height, its field of view and a sweeping head; adds drift to odometry, and noise, misses, false
crossings and a swaying camera to the features. The truth stays with the test.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import CrossingKind, Field, load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.interface import Odometry
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_worldmodel.camera_error import CameraErrorParameters
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.world_model import WorldModelParameters

Array = NDArray[np.float64]
CAMERA = np.array([0.05, 0.0, 1.15])
TICK = 20_000_000  # [ns] odometry at 50 Hz
PICTURE_EVERY = 4  # ticks: 12.5 Hz
DELAY_TICKS = 4  # features come 80 ms late
HALF_WIDTH, HALF_HEIGHT = math.radians(30.0), math.radians(23.0)
CLASS_OF = {
    CrossingKind.L: FeatureClass.CROSSING_L,
    CrossingKind.T: FeatureClass.CROSSING_T,
    CrossingKind.X: FeatureClass.CROSSING_X,
}


@dataclass(frozen=True)
class Errors:
    """How wrong odometry and vision are."""

    odometry_scale: float = 1.05
    heading_drift: float = 0.02  # [rad/s]
    angle_spread: float = math.radians(0.4)
    tilt_spread: float = math.radians(0.5)
    tilt_time: float = 0.3  # [s]
    azimuth_bias: float = math.radians(0.3)  # lasts as long as a tilt
    landmark_spread: float = 0.02  # [m] of the painted field, the same during a walk
    miss: float = 0.15
    false_crossing: float = 1.0 / 7.0  # share of all crossings reported
    vision: bool = True
    claimed: float = 1.0  # share of a feature's true spread that vision claims; less than one for a conceited one


ROUGH = LocalizationParameters(
    position_noise_per_metre=0.10,
    position_noise_per_radian=0.05,
    position_noise_per_second=0.01,
    heading_noise_per_metre=math.radians(1.0),
    heading_noise_per_radian=math.radians(2.0),
    heading_noise_per_second=math.radians(0.3),
    drift_spread=0.02,
    landmark_spread=Errors.landmark_spread,
)
"""What fits the errors of this walk: feet that slip, an IMU that drifts, play in the neck, lines painted by hand."""
ROUGH_CAMERA = CameraErrorParameters(
    pose_azimuth_spread=Errors.azimuth_bias,
    pose_elevation_spread=Errors.tilt_spread,
    pose_error_time=Errors.tilt_time,
)
ROUGH_WORLD = WorldModelParameters(camera=ROUGH_CAMERA, localization=ROUGH)


@dataclass(frozen=True)
class Moment:
    """What the world model gets at one tick, with the truth beside it."""

    stamp: int
    pose: Pose2D
    odometry: Odometry
    features: Features | None
    ball: Array | None
    ball_velocity: Array | None


WAYPOINTS = ((1.5, 1.0), (3.2, -0.8), (0.5, -2.0), (-2.0, -1.0), (-1.0, 1.8), (2.5, 0.5), (-3.0, 1.5))


def tour(time: float, pose: Pose2D) -> tuple[float, float, float]:
    """Return the velocity of a walk that visits one waypoint every 9 s as far as it gets, and stands in between."""
    if time % 9.0 > 8.0:
        return 0.0, 0.0, 0.0
    x, y = WAYPOINTS[int(time / 9.0) % len(WAYPOINTS)]
    bearing = wrap_angle(math.atan2(y - pose.y, x - pose.x) - pose.yaw)
    forward = 0.35 * max(0.0, math.cos(bearing)) if math.hypot(x - pose.x, y - pose.y) > 0.1 else 0.0
    return forward, 0.05 * math.sin(time), max(-0.6, min(0.6, 1.5 * bearing))


def stand(time: float, pose: Pose2D) -> tuple[float, float, float]:
    """Return no velocity."""
    return 0.0, 0.0, 0.0


@dataclass
class Simulation:
    """Yields moments; motion and ball are functions of time."""

    velocity: Callable[[float, Pose2D], tuple[float, float, float]]
    duration: float
    start: Pose2D
    rng: np.random.Generator
    errors: Errors = field(default_factory=Errors)
    ball: Callable[[float], tuple[Array, Array]] | None = None
    opponent: Callable[[float], Array | None] | None = None
    head_pan: Callable[[float], float] = lambda time: math.radians(70.0) * math.sin(time * 2.0 * math.pi / 4.0)
    head_tilt: Callable[[float], float] = lambda time: math.radians(22.0)
    arena: Field = field(default_factory=load_field)

    def run(self) -> Iterator[Moment]:
        """Yield one moment a tick."""
        dt = TICK * 1e-9
        pose, drifted, distance = self.start, Pose2D(0.3, -0.2, 0.4), 0.0
        tilt = np.zeros(2)
        self.azimuth_error = 0.0
        self.displaced = self.displace()
        waiting: list[tuple[int, Features]] = []
        for tick in range(round(self.duration / dt)):
            time = tick * dt
            stamp = 1_000_000_000 + tick * TICK
            vx, vy, turn = self.velocity(time, pose)
            if tick:
                scale = self.errors.odometry_scale
                pose = pose @ Pose2D(vx * dt, vy * dt, turn * dt)
                drifted = drifted @ Pose2D(vx * dt * scale, vy * dt * scale, turn * dt + self.errors.heading_drift * dt)
                distance += math.hypot(vx, vy) * dt
            fade = math.exp(-dt / self.errors.tilt_time)
            tilt = fade * tilt + self.rng.normal(size=2) * self.errors.tilt_spread * math.sqrt(1.0 - fade**2)
            self.azimuth_error = fade * self.azimuth_error + self.rng.normal() * self.errors.azimuth_bias * math.sqrt(
                1.0 - fade**2
            )
            ball, ball_velocity = (None, None) if self.ball is None else self.ball(time)
            if self.errors.vision and tick % PICTURE_EVERY == 0:
                waiting.append((tick + DELAY_TICKS, self.picture(stamp, time, pose, tilt, ball)))
            features = None
            if waiting and waiting[0][0] <= tick:
                features = waiting.pop(0)[1]
            odometry = Odometry(
                stamp,
                np.array([drifted.x, drifted.y, 0.9]),
                np.array([0.0, 0.0, math.sin(drifted.yaw / 2.0), math.cos(drifted.yaw / 2.0)]),
                np.array([vx, vy, 0.0]),
                np.array([0.0, 0.0, turn]),
                distance,
            )
            yield Moment(stamp, pose, odometry, features, ball, ball_velocity)

    def picture(self, stamp: int, time: float, pose: Pose2D, tilt: Array, ball: Array | None) -> Features:
        """Return what vision finds at a moment."""
        view = np.array(
            [
                self.head_pan(time) + HALF_WIDTH,
                self.head_pan(time) - HALF_WIDTH,
                -self.head_tilt(time) - HALF_HEIGHT,
                -self.head_tilt(time) + HALF_HEIGHT,
            ]
        )
        found: list[Feature] = []
        for kind, place, reach in self.displaced:
            found += self.see(kind, place, 0.0, reach, pose, tilt, view)
        crossings = sum(feature.kind.name.startswith("CROSSING") for feature in found)
        share = self.errors.false_crossing
        for _ in range(self.rng.binomial(crossings + 1, share / (1.0 - share)) if share else 0):
            kinds = list(CLASS_OF.values())
            azimuth = self.rng.uniform(view[1], view[0])
            elevation = self.rng.uniform(view[2], min(view[3], math.radians(-12.0)))
            found.append(self.feature(kinds[self.rng.integers(3)], azimuth, elevation))
        found += self.lines(pose, tilt, view)
        if ball is not None:
            radius = self.arena.ball_radius
            for feature in self.see(FeatureClass.BALL, ball, radius, 7.0, pose, tilt, view):
                offset = math.dist((*pose.transform(CAMERA[:2]), CAMERA[2]), (*ball, radius))
                size = math.asin(radius / offset) + self.rng.normal() * 0.0008
                found.append(replace(feature, angular_radius=size))
        opponent = None if self.opponent is None else self.opponent(time)
        if opponent is not None:
            found += self.see(FeatureClass.OPPONENT, opponent, 0.0, 6.0, pose, tilt, view)
        return Features(stamp, CAMERA, view, tuple(found))

    def displace(self) -> list[tuple[FeatureClass, Array, float]]:
        """Return the landmarks where they really are: a little beside where the field says."""
        spread = self.errors.landmark_spread
        return [(kind, place + self.rng.normal(size=2) * spread, reach) for kind, place, reach in self.places()]

    def places(self) -> Iterator[tuple[FeatureClass, Array, float]]:
        """Yield class, place and the range to which it is seen of every landmark."""
        for post in self.arena.goal_posts:
            yield FeatureClass.GOAL_POST, np.array([post.x, post.y]), 8.0
        for pole in self.arena.poles:
            kind = (
                FeatureClass.POLE_YELLOW_BLUE_YELLOW
                if pole.colours[0] == "yellow"
                else FeatureClass.POLE_BLUE_YELLOW_BLUE
            )
            yield kind, np.array([pole.x, pole.y]), 7.0
        for crossing in self.arena.crossings:
            yield CLASS_OF[crossing.kind], np.array([crossing.x, crossing.y]), 5.0
        for mark in self.arena.penalty_marks:
            yield FeatureClass.PENALTY_MARK, np.array(mark), 3.5

    def see(
        self, kind: FeatureClass, place: Array, height: float, reach: float, pose: Pose2D, tilt: Array, view: Array
    ) -> list[Feature]:
        """Return the feature of a place if it is in the picture and found."""
        relative = np.array(pose.inverse().transform(place))
        offset = np.array([*(relative - CAMERA[:2]), height - CAMERA[2]])
        if np.hypot(*offset[:2]) > reach or self.rng.random() < self.errors.miss:
            return []
        azimuth, elevation = self.angles(offset, tilt)
        inside = view[1] < azimuth < view[0] and view[2] < elevation < view[3]
        if not inside:
            if kind is FeatureClass.GOAL_POST and view[1] < azimuth < view[0] and elevation < view[2]:
                return [self.feature(kind, azimuth, math.nan)]
            return []
        return [self.feature(kind, azimuth, elevation)]

    def angles(self, offset: Array, tilt: Array) -> tuple[float, float]:
        """Return azimuth and elevation of an offset as a tilted camera sees it."""
        seen = offset + np.cross([tilt[0], tilt[1], 0.0], offset)
        return math.atan2(seen[1], seen[0]) + self.azimuth_error, math.atan2(seen[2], math.hypot(seen[0], seen[1]))

    def feature(self, kind: FeatureClass, azimuth: float, elevation: float) -> Feature:
        """Return a feature with noise."""
        noise = self.rng.normal(size=2) * self.errors.angle_spread
        spreads = self.claimed_spreads(elevation)
        return Feature(kind, wrap_angle(azimuth + noise[0]), elevation + noise[1], *spreads, 0.9)

    def claimed_spreads(self, elevation: float) -> tuple[float, float]:
        """Return the spreads of azimuth and elevation [rad]: a feature's own error and that of the camera's pose."""
        errors = self.errors
        sideways = 0.0 if math.isnan(elevation) else errors.tilt_spread * math.tan(elevation)
        azimuth = math.hypot(errors.angle_spread, errors.azimuth_bias, sideways)
        return errors.claimed * azimuth, errors.claimed * math.hypot(errors.angle_spread, errors.tilt_spread)

    def lines(self, pose: Pose2D, tilt: Array, view: Array) -> list[Feature]:
        """Return the parts of lines inside the picture, cut to 6 m range."""
        found = []
        for line in self.arena.line_segments:
            along = np.linspace(0.0, 1.0, max(int(line.length / 0.1), 2))[:, None]
            points = np.array(line.start) + along * (np.array(line.end) - np.array(line.start))
            relative = np.array([pose.inverse().transform(point) for point in points])
            azimuth = np.arctan2(relative[:, 1] - CAMERA[1], relative[:, 0] - CAMERA[0])
            ground = np.hypot(*(relative - CAMERA[:2]).T)
            elevation = -np.arctan2(CAMERA[2], ground)
            inside = (azimuth < view[0]) & (azimuth > view[1]) & (elevation > view[2]) & (elevation < view[3])
            visible = np.flatnonzero(inside & (ground < 6.0))
            if len(visible) < 6 or self.rng.random() < self.errors.miss:
                continue
            ends = [
                self.feature(FeatureClass.LINE, *self.angles(np.array([*(relative[i] - CAMERA[:2]), -CAMERA[2]]), tilt))
                for i in (visible[0], visible[-1])
            ]
            found.append(replace(ends[0], end_azimuth=ends[1].azimuth, end_elevation=ends[1].elevation))
        return found
