"""Perception without pictures: the features that a camera could give, from the simulator's truth.

For fast tests of behaviour: no picture is rendered and no vision runs, so what is tested is what comes after them. It
is no measure of vision, and a figure made with it says so. What the camera cannot see is not told: field of view,
range, and what robots, posts, poles and ball hide count. Directions are those in which the real camera sees things,
turned into base_footprint by the camera pose that the robot believes in, as vision does it: a swaying trunk misjudged
by the IMU spoils these features, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from math import nan

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import CrossingKind, Field, Goal
from tulip_description.robot import LEG_JOINTS, Robot
from tulip_sim.camera import CameraParameters, draw_mount
from tulip_sim.occlusion import Solids
from tulip_sim.scene import Body, scene_of
from tulip_sim.truth import Truth
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_vision.goal_frames import BESIDE, LEAST_SEEN, LEFT, RIGHT
from tulip_vision.lens import Lens
from tulip_vision.view import SpreadParameters, View
from tulip_worldmodel.landmarks import has_side

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CROSSINGS = {
    CrossingKind.L: FeatureClass.CROSSING_L,
    CrossingKind.T: FeatureClass.CROSSING_T,
    CrossingKind.X: FeatureClass.CROSSING_X,
}
FALSE_KINDS = (FeatureClass.CROSSING_L, FeatureClass.CROSSING_T, FeatureClass.CROSSING_X, FeatureClass.PENALTY_MARK)
"""What vision takes other marks on the ground for."""
LINE_STEP = 0.1  # [m] between two places of a line that are looked at
SHORTEST_LINE = 0.4  # [m]
BRIDGED = 3  # places of a line that may be hidden without cutting it in two
UPRIGHT_STEPS = 10  # places of a post or pole that are looked at, from the foot up
ARM = 0.25  # [m] of the lines around a crossing that must be seen, too
CHEST = 0.95  # [m] height of an opponent's marker
CONFIDENCE = 0.9
EDGE = 4.0  # [px] from the picture's edge within which nothing small is found


@dataclass(frozen=True)
class PerceptionParameters:
    """How good the made-up vision is. The defaults are about as good as the real one was measured to be."""

    azimuth_noise: float = math.radians(0.1)  # [rad] standard deviation, across the ray
    elevation_noise: float = math.radians(0.1)  # [rad]
    size_noise: float = 0.02  # standard deviation of the ball's angular radius, share of it
    miss: float = 0.05  # probability that a thing in view is not found
    blank: float = 0.0  # probability that a picture gives nothing at all
    sharp_speed: float = 1.5  # [rad/s] of the head, up to which pictures are sharp
    blurred_speed: float = 4.0  # [rad/s] at which nothing is found any more
    false_landmarks: float = 0.1  # crossings and marks a picture that are none, on average
    false_balls: float = 0.001  # balls a picture that are none, on average
    false_opponents: float = 0.002  # opponents a picture that are none, on average
    latency: float = 0.048  # [s] from the shutter to the features; never sooner than the camera pose, about 25 ms
    ball_range: float = 9.0  # [m] along the ground, as the others
    upright_range: float = 9.0  # [m] of posts and poles
    opponent_range: float = 8.0  # [m]
    crossing_range: float = 6.5  # [m]
    mark_range: float = 4.0  # [m]
    line_range: float = 6.0  # [m]

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{entry.name} is {value}; expected a finite number >= 0")
        for name in ("miss", "blank"):
            if getattr(self, name) > 1.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected a probability")
        if self.blurred_speed <= self.sharp_speed:
            raise ValueError(f"blurred_speed is {self.blurred_speed} rad/s; expected more than sharp_speed")
        if self.latency > 2.0:
            raise ValueError(f"latency is {self.latency} s; expected 0 to 2 s")

    @classmethod
    def ideal(cls) -> PerceptionParameters:
        """Return a perception without noise, misses and false findings; field of view, range and latency stay."""
        return cls(
            azimuth_noise=0.0,
            elevation_noise=0.0,
            size_noise=0.0,
            miss=0.0,
            sharp_speed=1e3,
            blurred_speed=1e4,
            false_landmarks=0.0,
            false_balls=0.0,
            false_opponents=0.0,
        )


EYES: dict[str, PerceptionParameters | None] = {
    "camera": None,
    "degraded": PerceptionParameters(),
    "ideal": PerceptionParameters.ideal(),
}
"""How a robot can see in lockstep, by the names that users choose from: with pictures, or as good as told."""


@dataclass(frozen=True)
class Glimpse:
    """What the camera saw of one thing, in camera_optical_frame.

    Attributes:
        kind: What it is.
        rays: (1, 3) unit direction, or (2, 3) of both ends of a line.
        footed: Whether the foot, and with it the elevation, is seen.
        angular_radius: Of a ball [rad], else NaN.
        side: Of a goal post, see `Feature`.
    """

    kind: FeatureClass
    rays: Array
    footed: bool = True
    angular_radius: float = nan
    side: int = 0


@dataclass(frozen=True)
class _Scene:
    """One instant: the true camera, what hides things, and what may be seen."""

    camera: Array  # (4, 4) camera_optical_frame in map
    solids: Solids
    truth: Truth

    @property
    def eye(self) -> Array:
        return np.asarray(self.camera[:3, 3])


class Perception:
    """Gives features without pictures."""

    def __init__(
        self,
        parameters: PerceptionParameters,
        field: Field,
        robot: Robot,
        lens: Lens,
        camera: CameraParameters | None = None,
        spread: SpreadParameters | None = None,
    ) -> None:
        """Prepare for a field and a robot.

        Args:
            parameters: How good it is.
            field: Lines, goals, poles and ball.
            robot: The camera's place and the robot's own body, which hides things.
            lens: The camera's lens.
            camera: Of which the errors of the mount count.
            spread: Of which the errors of the camera's pose count; they go into the features' spreads.
        """
        camera, spread = camera or CameraParameters(), spread or SpreadParameters()
        self._parameters = parameters
        self._field = field
        self._lens = lens
        self._keeper_colour = camera.keeper_colour
        self._body = Body(robot, camera.team_colour, mount=draw_mount(camera))
        self._spread = SpreadParameters(0.0, spread.pose_azimuth, spread.pose_elevation)
        self._lines = []  # (n, 3) places of each line
        for segment in field.line_segments:
            places = np.zeros((max(math.ceil(segment.length / LINE_STEP), 2) + 1, 3))
            places[:, :2] = np.linspace(segment.start, segment.end, len(places))
            self._lines.append(places)
        self._posts = [(post.x, post.y, post.radius, post.height) for post in field.goal_posts]
        self._poles = [(pole.x, pole.y, pole.radius, pole.height) for pole in field.poles]

    def expose(self, truth: Truth, rng: np.random.Generator) -> tuple[Glimpse, ...]:
        """Return what the camera sees at one instant and vision would find.

        Args:
            truth: The world.
            rng: Where misses come from.
        """
        return self.noticed(self.in_view(truth), truth, rng)

    def noticed(self, glimpses: tuple[Glimpse, ...], truth: Truth, rng: np.random.Generator) -> tuple[Glimpse, ...]:
        """Return what vision would find of what is in view: all but misses, of which a fast head makes more."""
        p = self._parameters
        if rng.random() < p.blank:
            return ()
        speed = float(np.abs(truth.joint_velocities[len(LEG_JOINTS) :]).max())
        blurred = (speed - p.sharp_speed) / (p.blurred_speed - p.sharp_speed)
        found = (1.0 - p.miss) * min(1.0, max(0.0, 1.0 - blurred))
        return tuple(each for each in glimpses if rng.random() < found)

    def in_view(self, truth: Truth) -> tuple[Glimpse, ...]:
        """Return all that the camera sees at one instant."""
        return tuple(self._things(self._scene(truth)))

    def ball_in_view(self, truth: Truth) -> bool:
        """Return whether the camera sees the ball."""
        return any(True for _ in self._ball(self._scene(truth)))

    def features(
        self, glimpses: tuple[Glimpse, ...], stamp: int, camera_in_footprint: Array, rng: np.random.Generator
    ) -> Features:
        """Return the features of what was seen, by the camera pose that the robot believes in.

        Args:
            glimpses: From `expose`.
            stamp: Of the exposure [ns].
            camera_in_footprint: (4, 4) camera_optical_frame in base_footprint, as the robot measured it.
            rng: Where noise and false features come from.
        """
        p = self._parameters
        view = View(self._lens, camera_in_footprint, self._spread)
        found = [self._feature(glimpse, view, rng) for glimpse in glimpses]
        for kinds, rate in (
            (FALSE_KINDS, p.false_landmarks),
            ((FeatureClass.BALL,), p.false_balls),
            ((FeatureClass.OPPONENT,), p.false_opponents),
        ):
            for _ in range(int(rng.poisson(rate))):
                found += self._false(kinds, view, rng)
        return Features(stamp, view.position, view.coverage(), tuple(found))

    def _scene(self, truth: Truth) -> _Scene:
        stand, links = scene_of(truth, self._body, self._keeper_colour)
        uprights = self._posts + (self._poles if stand.poles else [])
        balls = np.array([[*truth.ball_position, self._field.ball_radius]])
        solids = Solids(stand.boxes, np.array(uprights).reshape(-1, 4), balls)
        return _Scene(self._body.camera_in_map(links), solids, truth)

    def _things(self, scene: _Scene) -> Iterator[Glimpse]:
        p, truth = self._parameters, scene.truth
        yield from self._ball(scene)
        for goal in (self._field.own_goal, self._field.opponent_goal):
            yield from self._goal(scene, goal)
        if truth.poles:
            for pole in self._field.poles:
                yellow = pole.colours[0] == "yellow"
                kind = FeatureClass.POLE_YELLOW_BLUE_YELLOW if yellow else FeatureClass.POLE_BLUE_YELLOW_BLUE
                yield from self._upright(scene, kind, (pole.x, pole.y), pole.height)
        yield from self._opponents(scene)
        for crossing in self._field.crossings:
            yield from self._spot(scene, CROSSINGS[crossing.kind], (crossing.x, crossing.y), p.crossing_range, ARM)
        for mark in self._field.penalty_marks:
            size = self._field.penalty_mark_size
            yield from self._spot(scene, FeatureClass.PENALTY_MARK, mark, p.mark_range, size)
        for places in self._lines:
            yield from self._line(scene, places)

    def _visible(self, scene: _Scene, points: Array, reach: float) -> tuple[Array, Mask]:
        """Return (n, 3) unit rays in camera_optical_frame of (n, 3) points in map, and (n,) which of them are seen."""
        offsets = points - scene.eye
        rays = offsets @ scene.camera[:3, :3]
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        pixels = self._lens.project(rays)
        with np.errstate(invalid="ignore"):
            last = (self._lens.width - 1 - EDGE, self._lens.height - 1 - EDGE)
            seen = ((pixels >= EDGE) & (pixels <= last)).all(axis=1)
        seen &= np.hypot(offsets[:, 0], offsets[:, 1]) <= reach
        seen[seen] = ~scene.solids.hide(scene.eye, points[seen])
        return rays, seen

    def _ball(self, scene: _Scene) -> Iterator[Glimpse]:
        centre, radius = scene.truth.ball_position, self._field.ball_radius
        offset = centre - scene.eye
        distance = float(np.linalg.norm(offset))
        if distance <= radius:
            return
        across, up = scene.camera[:3, 0], scene.camera[:3, 1]
        around = [
            centre + 0.8 * radius * (math.cos(turn) * across + math.sin(turn) * up)
            for turn in np.arange(8) * math.pi / 4.0
        ]
        rays, seen = self._visible(scene, np.array([centre, *around]), self._parameters.ball_range)
        if seen[0] and seen.mean() > 0.6:
            yield Glimpse(FeatureClass.BALL, rays[:1], angular_radius=math.asin(radius / distance))

    def _upright(
        self, scene: _Scene, kind: FeatureClass, foot: tuple[float, float], height: float
    ) -> Iterator[Glimpse]:
        """Yield a post or pole: by its foot if that is seen, by its azimuth alone if enough of the rest is."""
        points = np.zeros((UPRIGHT_STEPS, 3))
        points[:, :2] = foot
        points[:, 2] = np.linspace(0.0, height, UPRIGHT_STEPS)
        rays, seen = self._visible(scene, points, self._parameters.upright_range)
        if seen[:3].all():
            yield Glimpse(kind, rays[:1])
        elif kind is FeatureClass.GOAL_POST and seen.sum() >= 4:
            yield Glimpse(kind, rays[np.flatnonzero(seen)[:1]], footed=False)

    def _goal(self, scene: _Scene, goal: Goal) -> Iterator[Glimpse]:
        """Yield the posts, each with its side where enough of the crossbar is seen, and the goal if both feet are."""
        posts = []
        for post, mate in zip(goal.posts, goal.posts[::-1], strict=True):
            place, other = np.array([post.x, post.y]), np.array([mate.x, mate.y])
            bar = np.full((len(BESIDE), 3), post.height - post.radius)
            bar[:, :2] = place + BESIDE[:, None] * (other - place)
            _, seen = self._visible(scene, bar, self._parameters.upright_range)
            left = bool(has_side(scene.eye[:2], place[None], other[None], LEFT)[0])
            side = 0 if seen.sum() < LEAST_SEEN else LEFT if left else RIGHT
            for glimpse in self._upright(scene, FeatureClass.GOAL_POST, (post.x, post.y), post.height):
                posts.append((left, replace(glimpse, side=side)))
        if len(posts) == 2:  # then there is no doubt
            posts = [(left, replace(glimpse, side=LEFT if left else RIGHT)) for left, glimpse in posts]
        yield from (glimpse for _, glimpse in posts)
        if len(posts) == 2 and all(glimpse.footed for _, glimpse in posts):
            feet = [glimpse.rays for left, glimpse in sorted(posts, key=lambda each: not each[0])]
            yield Glimpse(FeatureClass.GOAL, np.concatenate(feet))

    def _opponents(self, scene: _Scene) -> Iterator[Glimpse]:
        for place in (*scene.truth.figures, *(other.footprint for other in scene.truth.others)):
            facing = scene.eye[:2] - (place.x, place.y)
            front = np.array([place.x, place.y]) + 0.12 * facing / max(float(np.linalg.norm(facing)), 1e-6)
            points = np.array([[*front, 0.0], [*front, CHEST]])
            rays, seen = self._visible(scene, points, self._parameters.opponent_range)
            if seen[1]:
                below = np.array([[place.x, place.y, 0.0]]) - scene.eye
                foot = below @ scene.camera[:3, :3] / np.linalg.norm(below)
                yield Glimpse(FeatureClass.OPPONENT, foot if seen[0] else rays[1:], footed=bool(seen[0]))

    def _spot(
        self, scene: _Scene, kind: FeatureClass, place: tuple[float, float], reach: float, size: float
    ) -> Iterator[Glimpse]:
        """Yield a mark on the ground if it and what is around it are seen."""
        points = np.zeros((5, 3))
        points[:, :2] = place
        points[1:, :2] += size * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
        rays, seen = self._visible(scene, points, reach)
        if seen.all():
            yield Glimpse(kind, rays[:1])

    def _line(self, scene: _Scene, places: Array) -> Iterator[Glimpse]:
        """Yield the pieces of a line that are seen."""
        rays, seen = self._visible(scene, places, self._parameters.line_range)
        indices = np.flatnonzero(seen)
        if not len(indices):
            return
        for piece in np.split(indices, np.flatnonzero(np.diff(indices) > BRIDGED + 1) + 1):
            first, last = int(piece[0]), int(piece[-1])
            if float(np.linalg.norm(places[last] - places[first])) >= SHORTEST_LINE:
                yield Glimpse(FeatureClass.LINE, rays[[first, last]])

    def _feature(self, glimpse: Glimpse, view: View, rng: np.random.Generator) -> Feature:
        p = self._parameters
        angles = []
        spread = (nan, nan)
        for ray in glimpse.rays @ view.rotation.T:
            level = max(math.hypot(float(ray[0]), float(ray[1])), 0.05)
            across, up = rng.standard_normal(2).tolist()
            azimuth = math.atan2(float(ray[1]), float(ray[0])) + p.azimuth_noise * across / level
            elevation = math.asin(max(-1.0, min(1.0, float(ray[2])))) + p.elevation_noise * up
            angles.append((math.remainder(azimuth, 2.0 * math.pi), elevation))
            pose_azimuth, pose_elevation = view.spreads(ray)
            spread = math.hypot(pose_azimuth, p.azimuth_noise / level), math.hypot(pose_elevation, p.elevation_noise)
        (azimuth, elevation), (end_azimuth, end_elevation) = angles[0], angles[1] if len(angles) > 1 else (nan, nan)
        radius = glimpse.angular_radius
        if not math.isnan(radius):
            radius *= max(1.0 + p.size_noise * float(rng.standard_normal()), 0.1)
        return Feature(
            glimpse.kind,
            azimuth,
            elevation if glimpse.footed else nan,
            spread[0],
            spread[1] if glimpse.footed else nan,
            CONFIDENCE,
            end_azimuth,
            end_elevation,
            radius,
            glimpse.side,
        )

    def _false(self, kinds: tuple[FeatureClass, ...], view: View, rng: np.random.Generator) -> list[Feature]:
        """Return a feature of something that is none, at a random place of the picture below the horizon."""
        size = np.array([self._lens.width - 1.0, self._lens.height - 1.0])
        ray = self._lens.rays(rng.uniform((0.0, 0.0), size)[None])
        kind = kinds[int(rng.integers(len(kinds)))]
        down = float((ray @ view.rotation.T)[0, 2])
        reach = self._parameters.ball_range if kind is FeatureClass.BALL else self._parameters.crossing_range
        if not down < -view.height / math.hypot(view.height, reach):  # not on the ground in range, or no ray at all
            return []
        # A false ball has the size that a ball would have there, or vision would have refused it.
        radius = self._field.ball_radius * -down / view.height if kind is FeatureClass.BALL else nan
        return [self._feature(Glimpse(kind, ray, angular_radius=radius), view, rng)]
