"""Compare what vision finds in rendered scenes with what is there.

A helper of the tests, also for measuring by hand: `evaluate(random_scenes(...), render, vision)`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import Field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot
from tulip_sim.bench.vision_truth import GROUPS, Thing, things
from tulip_sim.scene import Body
from tulip_sim.truth import Truth
from tulip_vision.features import Feature, Features
from tulip_vision.pipeline import Vision
from tulip_vision.view import View

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """One still scene.

    Attributes:
        footprint: The robot in map.
        height: Of base_link [m].
        orientation: (4,) quaternion x, y, z, w of base_link in map.
        joints: (14,) [rad].
        ball: (3,) centre in map [m].
        keeper: In map.
    """

    footprint: Pose2D
    height: float
    orientation: Array
    joints: Array
    ball: Array
    keeper: Pose2D


@dataclass
class Tally:
    """Counts and errors of one class."""

    there: int = 0
    found: int = 0
    false: int = 0
    azimuth_errors: list[float] = field(default_factory=list)
    elevation_errors: list[float] = field(default_factory=list)
    normalised: list[float] = field(default_factory=list)

    @property
    def recall(self) -> float:
        """Share of what was there that was found; NaN if nothing was there."""
        return self.found / self.there if self.there else math.nan

    def __str__(self) -> str:
        azimuth, elevation = (
            math.degrees(float(np.median(each))) if each else math.nan
            for each in (self.azimuth_errors, self.elevation_errors)
        )
        worst = math.degrees(float(np.percentile(self.azimuth_errors, 95))) if self.azimuth_errors else math.nan
        return (
            f"{self.found:4d} of {self.there:4d} ({self.recall:5.3f}), {self.false:3d} false,"
            f" azimuth {azimuth:5.2f} deg median {worst:5.2f} deg 95%, elevation {elevation:5.2f} deg median"
        )


RANGES = {"ball": 6.0, "post": 9.0, "pole": 7.0, "opponent": 8.0, "crossing": 5.0, "mark": 3.0, "circle": 4.0}
"""[m] up to here a thing must be found."""
MATCH = math.radians(2.0)
"""A feature further than this from everything of its class is false."""
BODY_MATCH = 0.2
"""[m] the same for opponents close by, whose middle is a matter of definition."""


def random_scenes(count: int, field: Field, robot: Robot, rng: np.random.Generator) -> Iterator[Scene]:
    """Return scenes with a standing robot anywhere on the field, looking where there is something to see."""
    posture = standing_posture(robot)
    names = list(robot.joint_names)
    pan_index, tilt_index = names.index("head_pan"), names.index("head_tilt")
    for _ in range(count):
        x = rng.uniform(-field.length / 2 - 0.2, field.length / 2 - 0.6)
        y = rng.uniform(-field.width / 2, field.width / 2)
        yaw = rng.uniform(-math.pi, math.pi)
        joints = posture.joint_positions.copy()
        pan, tilt = rng.uniform(-0.9, 0.9), rng.choice([rng.uniform(0.05, 0.45), rng.uniform(0.3, 0.9)])
        joints[pan_index], joints[tilt_index] = pan, tilt
        roll, pitch = rng.normal(0.0, 0.03, 2)
        ball = _place_ahead(x, y, yaw + pan, 0.7, 6.0, field, rng)
        keeper = (
            Pose2D(field.length / 2 - 0.3, rng.uniform(-1.0, 1.0), math.pi)
            if rng.uniform() < 0.4
            else Pose2D(*_place_ahead(x, y, yaw + pan, 1.0, 7.0, field, rng), rng.uniform(-math.pi, math.pi))
        )
        if math.hypot(keeper.x - x, keeper.y - y) < 0.8 or math.hypot(keeper.x - ball[0], keeper.y - ball[1]) < 0.4:
            keeper = Pose2D(-x, -y - 0.5, 0.0)
        yield Scene(
            Pose2D(x, y, yaw),
            posture.base_height + rng.normal(0.0, 0.01),
            _quaternion(yaw, pitch, roll),
            joints,
            np.array([*ball, field.ball_radius]),
            keeper,
        )


def truth_of(scene: Scene) -> Truth:
    """Return a scene as the renderer takes it: at rest, with poles."""
    still = np.zeros(3)
    return Truth(
        stamp=0,
        base_position=np.array([scene.footprint.x, scene.footprint.y, scene.height]),
        base_orientation=scene.orientation,
        base_linear_velocity=still,
        base_angular_velocity=still,
        joint_positions=scene.joints,
        joint_velocities=np.zeros(len(scene.joints)),
        ball_position=scene.ball,
        ball_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        ball_linear_velocity=still,
        ball_angular_velocity=still,
        keeper=scene.keeper,
        keeper_path=(),
        foot_touches=(0, 0),
        body_touches=0,
        keeper_touches=0,
        poles=True,
    )


def camera_pose(scene: Scene, robot: Robot) -> Array:
    """Return the (4, 4) transform of camera_optical_frame in base_footprint."""
    names = list(robot.joint_names)
    pan, tilt = scene.joints[names.index("head_pan")], scene.joints[names.index("head_tilt")]
    return camera_in_footprint(robot, scene.height, scene.orientation, float(pan), float(tilt))


def evaluate(
    scenes: Iterable[Scene],
    render: Callable[[Scene], NDArray[np.uint8]],
    vision: Vision,
    field: Field,
    robot: Robot,
    inspect: Callable[[int, NDArray[np.uint8], Features, list[str]], None] | None = None,
) -> dict[str, Tally]:
    """Process the picture of each scene and count what is found, missed and false.

    Args:
        scenes: What to look at.
        render: Makes the picture, (height, width, 3) BGR.
        vision: The pipeline to judge.
        field: The field of the scenes.
        robot: The robot of the scenes.
        inspect: Called with each picture's number, the picture, the features and what was wrong.
    """
    tallies = {name: Tally() for name in GROUPS}
    body = Body(robot, "cyan")
    for number, scene in enumerate(scenes):
        picture = render(scene)
        features = vision.process(picture, number, camera_pose(scene, robot))
        assert vision.last is not None
        view = vision.last.view
        problems: list[str] = []
        for name, present in things(truth_of(scene), body, field, view).items():
            found = [each for each in features.features if each.kind in GROUPS[name]]
            _compare(name, present, found, view, tallies[name], problems)
        if inspect is not None:
            inspect(number, picture, features, problems)
    return tallies


def _compare(
    name: str, present: list[Thing], found: list[Feature], view: View, tally: Tally, problems: list[str]
) -> None:
    left = list(found)
    for thing in sorted(present, key=lambda each: not each.whole):
        required = thing.whole and thing.distance <= RANGES[name]
        ray = thing.point - view.position
        azimuth = math.atan2(ray[1], ray[0])
        elevation = math.atan2(ray[2], math.hypot(ray[0], ray[1]))

        def off(each: Feature, azimuth: float = azimuth, elevation: float = elevation) -> float:
            vertical = 0.0 if math.isnan(each.elevation) else each.elevation - elevation
            return math.hypot(wrap_angle(each.azimuth - azimuth) * math.cos(elevation), vertical)

        match = max(MATCH, BODY_MATCH / thing.distance) if name == "opponent" else MATCH
        fitting = [each for each in left if each.kind in thing.kinds and off(each) < match]
        tally.there += required
        if not fitting:
            if required:
                problems.append(f"missed {name} {thing.kinds[0].name} at {thing.distance:.1f} m")
            continue
        best = min(fitting, key=off)
        left.remove(best)
        if required:
            tally.found += 1
            error = abs(wrap_angle(best.azimuth - azimuth))
            tally.azimuth_errors.append(error)
            tally.normalised.append(error / best.azimuth_spread)
            if not math.isnan(best.elevation):
                tally.elevation_errors.append(abs(best.elevation - elevation))
    # What shows only partly may well be reported, even twice (a post above and below a keeper).
    for extra in left:
        tally.false += 1
        problems.append(
            f"false {extra.kind.name} at {math.degrees(extra.azimuth):.1f}, {math.degrees(extra.elevation):.1f} deg"
        )


def _place_ahead(
    x: float, y: float, heading: float, nearest: float, farthest: float, field: Field, rng: np.random.Generator
) -> tuple[float, float]:
    for _ in range(50):
        distance, turn = rng.uniform(nearest, farthest), heading + rng.uniform(-0.5, 0.5)
        place = x + distance * math.cos(turn), y + distance * math.sin(turn)
        if abs(place[0]) < field.length / 2 and abs(place[1]) < field.width / 2:
            return place
    return -0.5 * x, -0.5 * y


def _quaternion(yaw: float, pitch: float, roll: float) -> Array:
    cy, sy, cp, sp, cr, sr = (f(0.5 * a) for a in (yaw, pitch, roll) for f in (math.cos, math.sin))
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )
