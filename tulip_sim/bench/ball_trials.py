"""Trials of the ball's estimate: a ball that rests, one that rolls, one that is hidden by an opponent for a while."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from tulip_description.field import load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_sim.bench.ball_walk import BallWalk, Comparison, before_robot
from tulip_sim.bench.localization import MOUNT_ANGLE, MOUNT_HEIGHT
from tulip_sim.bench.runner import Row
from tulip_sim.camera import CameraParameters
from tulip_sim.keeper import Keeper
from tulip_sim.lockstep import Settings
from tulip_sim.perception import PerceptionParameters
from tulip_sim.scenario import Scenario
from tulip_worldmodel.rolling import DECELERATION, rest
from tulip_worldmodel.world_state import ObjectEstimate

Array = NDArray[np.float64]

LOOK = 0.1  # [s] between two looks at the estimate
KNOWN = 3.0  # [s] after the start, when a ball before the robot is known for long
WATCHED = 8.0  # [s] that a resting ball is judged
SEEN = 0.5  # [s] that a rolling ball has been seen when it is judged
FARTHEST = 6.5  # [m] to which a rolling ball is followed
LONGEST = 4.0  # [s] that it is followed
BOUNCE = 0.15  # [m/s] that a ball's velocity changes between two looks when it meets something
SLOW = 0.1  # [m/s] a ball slower than this has rolled
RESEEN = 0.5  # [s] after a hidden ball is in view again, until it is judged
LOST = 0.5  # [m] an estimate of a hidden ball that errs by more has lost it
BOUND = float(chi2.ppf(0.95, df=2))  # of the NEES of two values


def settings_of(perception: str, seed: int) -> Settings:
    """Return the parameters of all cores: "degraded" features from the truth, or "vision" with rendered pictures.

    The camera sits as calibration leaves it, by the seed.

    Raises:
        ValueError: for another word.
    """
    known = {"degraded": PerceptionParameters(), "vision": None}
    if perception not in known:
        raise ValueError(f"perception is {perception!r}; expected one of {', '.join(known)}")
    camera = CameraParameters(mount_angle=MOUNT_ANGLE, mount_height=MOUNT_HEIGHT, mount_seed=seed)
    return Settings(camera=camera, perception=known[perception])


def standing(distance: float, walks: bool, seed: int, perception: str = "degraded") -> Row:
    """Watch a resting ball at a distance [m]."""
    rng = np.random.default_rng([seed, 21])
    robot, ball = _places(rng, distance)
    trial = BallWalk(Scenario(robot, ball), seed, settings_of(perception, seed), walks)
    looks = []
    try:
        trial.go(KNOWN)
        while trial.stamp < (KNOWN + WATCHED) * 1e9:
            trial.go(trial.stamp * 1e-9 + LOOK)
            looks.append(trial.compare())
    finally:
        trial.close()
    known = [(each, each.believed) for each in looks if each.believed is not None]
    errors = np.array([np.linalg.norm(ball.position - each.position) / each.distance for each, ball in known])
    return {
        "what": "standing",
        "seed": seed,
        "perception": perception,
        "walks": walks,
        "distance [m]": distance,
        "known [%]": round(100.0 * len(known) / len(looks), 1),
        "range [m]": [round(each.distance, 2) for each, _ in known],
        "error [%]": [round(100.0 * float(error), 2) for error in errors],
        "position NEES": [round(_nees(ball, each, slice(0, 2)), 2) for each, ball in known],
        "speed [m/s]": [round(float(np.hypot(*ball.velocity)), 3) for _, ball in known],
    }


def rolling(speed: float, walks: bool, seed: int, perception: str = "degraded") -> Row:
    """Watch a ball that is kicked from rest, or comes into view rolling, with a speed [m/s]."""
    rng = np.random.default_rng([seed, 22])
    comes = seed % 2 == 1
    robot, first, heading = _rolling_course(rng, speed)
    far_away = (robot.x - 12.0 * math.cos(robot.yaw), robot.y - 12.0 * math.sin(robot.yaw))
    trial = BallWalk(Scenario(robot, far_away if comes else first), seed, settings_of(perception, seed), walks)
    looks: list[tuple[float, Comparison]] = []
    try:
        trial.go(KNOWN)
        if comes:
            while not _in_picture(trial, first):  # the head sweeps
                trial.step()
        trial.world.place_ball(*first, speed * math.cos(heading), speed * math.sin(heading))
        begin, seen = trial.stamp * 1e-9, 0.0
        before = speed * np.array([math.cos(heading), math.sin(heading)])
        while trial.stamp * 1e-9 - begin < LONGEST:
            trial.go(trial.stamp * 1e-9 + LOOK)
            look = trial.compare()
            seen += LOOK * trial.ball_visible
            way = trial.world.truth().ball_linear_velocity[:2]
            met = np.linalg.norm(way - before) > BOUNCE  # a post, a pole or the robot
            if look.distance > FARTHEST or float(np.hypot(*look.velocity)) < SLOW or met:
                break
            before = way
            looks.append((seen, look))
    finally:
        trial.close()
    judged = [(each, each.believed) for seen, each in looks if seen > SEEN and each.visible and each.believed]
    # As sharp a question: where the ball will stop, asked half a second after it was kicked.
    stops = [
        math.dist(
            rest(ball.position, ball.velocity, DECELERATION)[0],
            rest(each.position, each.velocity, trial.world.parameters.ball_rolling_deceleration)[0],
        )
        for each, ball in judged[:1]
    ]
    return {
        "what": "rolling",
        "seed": seed,
        "perception": perception,
        "walks": walks,
        "comes": comes,
        "speed [m/s]": speed,
        "time [s]": [round(each.time - begin, 2) for _, each in looks],
        "seen [s]": [round(seen, 2) for seen, _ in looks],
        "true speed [m/s]": [round(float(np.hypot(*each.velocity)), 3) for _, each in looks],
        "believed speed [m/s]": [
            None if each.believed is None else round(float(np.hypot(*each.believed.velocity)), 3) for _, each in looks
        ],
        "velocity error [m/s]": [
            round(float(np.linalg.norm(ball.velocity - each.velocity)), 3) for each, ball in judged
        ],
        "position error [m]": [round(float(np.linalg.norm(ball.position - each.position)), 3) for each, ball in judged],
        "position NEES": [round(_nees(ball, each, slice(0, 2)), 2) for each, ball in judged],
        "velocity NEES": [round(_nees(ball, each, slice(2, 4)), 2) for each, ball in judged],
        "stop error [m]": None if not stops else round(stops[0], 2),
    }


def hidden(rolls: bool, walks: bool, seed: int, perception: str = "degraded") -> Row:
    """Hide a ball behind an opponent for about a second: one walks past a resting ball, or the ball rolls behind it."""
    rng = np.random.default_rng([seed, 23])
    side = float(rng.choice((-1.0, 1.0)))
    robot = Pose2D(-2.0, float(rng.uniform(-0.5, 0.5)), float(rng.uniform(-0.2, 0.2)))
    near, far = float(rng.uniform(1.15, 1.25)), float(rng.uniform(2.7, 2.9))  # the trunk is in the way
    course, speed = robot.yaw - side * math.pi / 2.0, float(rng.uniform(1.7, 1.9))
    if rolls:
        begin = before_robot(robot, math.hypot(far, 1.3), side * math.atan2(1.3, far))
        keeper = Keeper(robot @ Pose2D(near, 0.0, math.pi))
    else:
        begin = before_robot(robot, far, 0.0)
        start, end = (robot.transform((near, way)) for way in (2.2 * side, -2.2 * side))
        keeper = Keeper(Pose2D(*start, wrap_angle(robot.yaw + math.pi)), (end,), speed=0.6)
    trial = BallWalk(Scenario(robot, begin, keeper), seed, settings_of(perception, seed), walks, glances=rolls)
    looks: list[Comparison] = []
    try:
        trial.go(KNOWN - 1.0)
        if rolls:
            trial.world.place_ball(*begin, speed * math.cos(course), speed * math.sin(course))
        while trial.stamp < (KNOWN + 5.0) * 1e9:
            trial.go(trial.stamp * 1e-9 + LOOK)
            looks.append(trial.compare())
    finally:
        trial.close()
    first, last = _longest_gap([each.visible for each in looks])
    during = looks[first : min(last + 1 + round(RESEEN / LOOK), len(looks))]
    errors = [
        math.inf if each.believed is None else float(np.linalg.norm(each.believed.position - each.position))
        for each in during
    ]
    nees = [_nees(each.believed, each, slice(0, 2)) for each in looks[first : last + 1] if each.believed is not None]
    kept = bool(during) and max(errors) < LOST
    return {
        "what": "hidden",
        "seed": seed,
        "perception": perception,
        "walks": walks,
        "rolls": rolls,
        "hidden [s]": round(LOOK * (last + 1 - first), 2),
        "seen again": last + 1 < len(looks),
        "kept": kept,
        "greatest error [m]": None if not errors or math.isinf(max(errors)) else round(max(errors), 3),
        "position NEES": [round(value, 2) for value in nees],
    }


def _nees(ball: ObjectEstimate, look: Comparison, part: slice) -> float:
    """Return the normalized error squared of position (0:2) or velocity (2:4)."""
    error = np.concatenate((ball.position - look.position, ball.velocity - look.velocity))[part]
    return float(error @ np.linalg.solve(ball.covariance[part, part], error))


def _places(rng: np.random.Generator, distance: float) -> tuple[Pose2D, tuple[float, float]]:
    """Return a robot and a ball on the field, at a distance [m], the ball about before the robot."""
    field = load_field()
    reach = np.array([field.length / 2.0 - 0.3, field.width / 2.0 - 0.3])
    while True:
        x, y = rng.uniform(-reach, reach)
        robot = Pose2D(float(x), float(y), float(rng.uniform(-math.pi, math.pi)))
        ball = before_robot(robot, distance, float(rng.uniform(-0.5, 0.5)))
        if (np.abs(ball) < reach).all():
            return robot, ball


def _rolling_course(rng: np.random.Generator, speed: float) -> tuple[Pose2D, tuple[float, float], float]:
    """Return robot, the ball's place and the direction of its roll [rad in map], such that it stays in sight a while.

    It never comes nearer than 0.6 m, and for its first 1.2 s it is on the field, at most 5 m away and within 60 deg.
    """
    while True:
        robot, ball = _places(rng, float(rng.uniform(1.0, 3.5)))
        heading = float(rng.uniform(-math.pi, math.pi))
        for place in _course(ball, heading, speed):
            x, y = robot.inverse().transform(place)
            if math.hypot(x, y) < 0.6:
                break
            on_field = abs(place[0]) < 4.3 and abs(place[1]) < 3.2
            if not (on_field and math.hypot(x, y) < 5.0 and abs(math.atan2(y, x)) < math.radians(60.0)):
                break
        else:
            return robot, ball, heading


def _course(ball: tuple[float, float], heading: float, speed: float) -> Iterator[tuple[float, float]]:
    for time in np.arange(0.0, 1.25, 0.1):
        way = float(speed * time)
        yield ball[0] + way * math.cos(heading), ball[1] + way * math.sin(heading)


def _in_picture(trial: BallWalk, place: tuple[float, float]) -> bool:
    """Tell whether the head looks about towards a place (x, y) in map."""
    truth = trial.world.truth()
    x, y = truth.footprint.inverse().transform(place)
    pan, tilt = truth.joint_positions[-2:].tolist()
    return abs(wrap_angle(pan - math.atan2(y, x))) < 0.2 and tilt < 0.6  # the row that sees from 1 m on


def _longest_gap(visible: list[bool]) -> tuple[int, int]:
    """Return first and last index of the longest run without the ball; (0, -1) if there is none."""
    best, start = (0, -1), 0
    for index, each in enumerate(visible):
        if each:
            start = index + 1
        elif index - start > best[1] - best[0]:
            best = start, index
    return best
