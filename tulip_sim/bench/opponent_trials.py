"""Trials of the opponents' estimates: number unknown, standing or walking, and one that is taken off the field."""

from __future__ import annotations

import math

import numpy as np

from tulip_description.planar import Pose2D
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_sim.bench.head_play import HeadPlay, Velocity
from tulip_sim.bench.runner import Row
from tulip_worldmodel.world_state import ObjectEstimate

DURATION, GONE = 16.0, 10.0  # [s] of a trial; when the first opponent is taken off the field
LOOK = 0.1  # [s] between two looks at the estimates
MATCH = 0.7  # [m] an estimate farther from every opponent is of none
FRESH = 0.3  # [s] since it was seen, of an estimate that is judged
SWEEP, SWEEP_TIME = math.radians(40.0), 4.0  # [rad], [s] of the head's look from side to side
WALK = 0.25  # [m/s]


def opponents(count: int, walk: bool, own_walk: bool, seed: int) -> Row:
    """Watch some opponents, two metres and more away.

    Args:
        count: How many.
        walk: Whether they walk to and fro, else they stand.
        own_walk: Whether the robot itself walks.
        seed: Of all that is random.
    """
    rng = np.random.default_rng([seed, 31])
    start = Pose2D(-2.5, 0.0, float(rng.uniform(-0.2, 0.2)))
    places = _apart(rng, count, start)
    ways = rng.uniform(-math.pi, math.pi, count)
    phases = rng.uniform(0.0, 2.0, count)
    play = HeadPlay(seed, start, (-4.0, -2.6))
    errors, speeds, nees = [], [], []
    seen_first: list[float | None] = [None] * count
    confirmed: list[float | None] = [None] * count
    false_time, looks, gone = 0.0, 0, None

    def stand_at(time: float) -> list[tuple[Pose2D, np.ndarray]]:
        """Return each opponent's pose, and its velocity in map."""
        result = []
        for (x, y), way, phase in zip(places, ways, phases, strict=True):
            along = (time / 4.0 + phase) % 2.0  # to and fro in 8 s
            swing, direction = (along, 1.0) if along < 1.0 else (2.0 - along, -1.0)
            moved = 4.0 * WALK * swing if walk else 0.0
            velocity = WALK * direction * np.array([math.cos(way), math.sin(way)]) if walk else np.zeros(2)
            result.append((Pose2D(x + moved * math.cos(way), y + moved * math.sin(way), math.pi), velocity))
        return result

    def decide(now: HeadPlay) -> tuple[HeadCommand, Velocity]:
        time = now.stamp * 1e-9
        pan = SWEEP * math.sin(2.0 * math.pi * time / SWEEP_TIME)
        forward = 0.0 if not own_walk else 0.15 if time % 6.0 < 3.0 else -0.15
        target = (3.0 * math.cos(pan), 3.0 * math.sin(pan), 0.0)
        return HeadCommand(now.stamp, HeadMode.LOOK_AT, target), (forward, 0.0, 0.0)

    while play.stamp < DURATION * 1e9:
        time = play.stamp * 1e-9
        standing = stand_at(time)
        present = standing[1:] if time >= GONE and count else standing
        play.opponents = [pose for pose, _ in present]
        play.go(LOOK, decide)
        now = play.stamp * 1e-9
        assert play.state is not None
        if time < GONE:
            for index, visible in enumerate(play.opponents_in_picture):
                if visible and seen_first[index] is None:
                    seen_first[index] = now
        looks += 1
        moved = stand_at(now)
        found = play.state.opponents
        left = moved if time < GONE else moved[1:]
        false_time += LOOK * sum(_nearest(each, left, play.pose)[0] > MATCH for each in found if _is_new(each))
        for index, (pose, velocity) in enumerate(moved):
            near = [each for each in found if _off(each, pose, play.pose) < MATCH]
            if near and confirmed[index] is None:
                confirmed[index] = now
            if time >= GONE and index == 0:
                gone = now - GONE if not near and gone is None else gone
                continue
            for each in near[:1]:
                if each.age < FRESH:
                    error = np.concatenate(
                        (
                            each.position - np.array(play.pose.inverse().transform((pose.x, pose.y))),
                            each.velocity - play.pose.rotation().T @ velocity,
                        )
                    )
                    errors.append(float(np.hypot(*error[:2])))
                    speeds.append(float(np.hypot(*error[2:])))
                    nees.append(float(error @ np.linalg.solve(each.covariance, error)))
    known = [b - a for a, b in zip(seen_first, confirmed, strict=True) if a is not None and b is not None]
    return {
        "what": "opponents",
        "seed": seed,
        "count": count,
        "walk": walk,
        "own walk": own_walk,
        "in view": sum(each is not None for each in seen_first),
        "confirmed": len(known),
        "confirmed after [s]": [round(each, 2) for each in known],
        "position error [m]": [round(each, 3) for each in errors],
        "velocity error [m/s]": [round(each, 3) for each in speeds],
        "NEES": [round(each, 2) for each in nees],
        "false track [s]": round(false_time, 1),
        "duration [s]": DURATION,
        "gone after [s]": None if gone is None else round(gone, 1),
    }


def _is_new(estimate: ObjectEstimate) -> bool:
    """Tell whether an estimate was seen not long ago, so that it is none of one that has gone."""
    return estimate.age < FRESH


def _off(estimate: ObjectEstimate, pose: Pose2D, robot: Pose2D) -> float:
    return math.dist(estimate.position, robot.inverse().transform((pose.x, pose.y)))


def _nearest(
    estimate: ObjectEstimate, opponents_there: list[tuple[Pose2D, np.ndarray]], robot: Pose2D
) -> tuple[float, int]:
    """Return distance [m] and index of the opponent nearest to an estimate; infinite without any."""
    distances = [(_off(estimate, pose, robot), index) for index, (pose, _) in enumerate(opponents_there)]
    return min(distances, default=(math.inf, -1))


def _apart(rng: np.random.Generator, count: int, robot: Pose2D) -> list[tuple[float, float]]:
    """Return places 2 to 5 m before a robot, at least 1.5 m and 15 degrees apart."""
    while True:
        ranges, bearings = rng.uniform(2.0, 5.0, count), np.sort(rng.uniform(-0.9, 0.9, count))
        places = [
            robot.transform((float(r * math.cos(b)), float(r * math.sin(b))))
            for r, b in zip(ranges, bearings, strict=True)
        ]
        pairs = [(a, b) for index, a in enumerate(places) for b in places[:index]]
        if all(math.dist(a, b) > 1.5 for a, b in pairs) and (count < 2 or np.diff(bearings).min() > math.radians(15.0)):
            return places
