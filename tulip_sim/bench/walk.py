"""Walking: does the robot stay upright, how fast is it really, how straight does it go."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Velocity
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row

Array = NDArray[np.float64]

START = Pose2D(-30.0, 10.0, 0.0)  # far from goals and ball
SETTLING = 5.0  # [s] until the commanded speed is reached; speeds are measured after that
LINE = 20.0  # [m] of straight walk whose sideways error is measured
TRACK_PERIOD = 0.1  # [s] between the points of the way

# name, velocity or kind of walk, duration [s], seeds
WALKS: dict[str, tuple[Velocity | None, float, int]] = {
    "forward 0.6 m/s": ((0.61, 0.0, 0.0), 60.0, 20),
    "forward 0.7 m/s": ((0.7, 0.0, 0.0), 60.0, 10),
    "forward 0.8 m/s": ((0.8, 0.0, 0.0), 60.0, 10),
    "sideways 0.25 m/s": ((0.0, 0.26, 0.0), 30.0, 10),
    "back 0.3 m/s": ((-0.31, 0.0, 0.0), 30.0, 10),
    "turn 1.2 rad/s": ((0.0, 0.0, 1.25), 30.0, 10),
    "slalom": (None, 30.0, 10),
    "start and stop": (None, 30.0, 10),
    "random commands": (None, 30.0, 10),
}
FASTER = MotionParameters(max_speed_forward=0.9, reach_share=0.95)  # for speeds beyond the limits of motion control


def legs(walk: str, seed: int) -> Iterator[tuple[float, Velocity | None]]:
    """Yield durations [s] with the velocity to command in each; None is to stand."""
    velocity, duration, _ = WALKS[walk]
    rng = np.random.default_rng([seed, list(WALKS).index(walk)])
    if velocity is not None:
        side = 1.0 if seed % 2 else -1.0
        yield duration, (velocity[0], side * velocity[1], side * velocity[2])
    elif walk == "slalom":
        for i in range(round(duration / 3.0)):
            yield 3.0, (0.35, 0.0, 0.5 if i % 2 else -0.5)
    elif walk == "start and stop":
        for i in range(round(duration / 3.0)):
            yield 3.0, None if i % 2 else (0.4, 0.0, 0.0)
    else:
        for _ in range(round(duration / 1.5)):
            # Beyond the limits at times, so that clipping is walked as well.
            velocity = tuple(rng.uniform((-0.4, -0.3, -1.3), (0.7, 0.3, 1.3)))
            yield 1.5, None if rng.random() < 0.15 else velocity


def measure(walk: str, seed: int) -> Row:
    """Walk once."""
    fast = walk in ("forward 0.7 m/s", "forward 0.8 m/s")
    body = Body(seed, START, parameters=FASTER if fast else None)
    body.go(0.3)
    way = [_pose(body)]
    for duration, velocity in legs(walk, seed):
        for _ in range(round(duration / TRACK_PERIOD)):
            body.go(TRACK_PERIOD, velocity)
            if not body.fallen:
                way.append(_pose(body))
    if WALKS[walk][0] is None:
        body.go(3.0)
    track = np.array(way)
    limits = body.world.robot.effort_limits
    row: Row = {
        "walk": walk,
        "seed": seed,
        "friction": round(body.world.friction, 3),
        "upright": not body.fallen,
        "time [s]": round((len(way) - 1) * TRACK_PERIOD, 1),
        "greatest tilt [rad]": round(body.greatest_tilt, 3),
        "greatest torque by limit": round(float((body.greatest_efforts / limits).max()), 2),
        "greatest joint speed [rad/s]": round(float(body.greatest_speeds.max()), 1),
    }
    if WALKS[walk][0] is not None:
        row["speed [m/s, rad/s]"] = round(_speed(track, walk), 3)
    if walk.startswith("forward"):
        row["off the line after 20 m [m]"] = _off_the_line(track)
        row["way [m]"] = [[round(float(x), 2), round(float(y), 3)] for x, y in track[::10, :2] - track[0, :2]]
    return row


def _pose(body: Body) -> tuple[float, float, float]:
    pose = body.world.truth().footprint
    return pose.x, pose.y, pose.yaw


def _speed(track: Array, walk: str) -> float:
    """Return the speed [m/s], or [rad/s] for turning, once it is reached, to the end or to a second before a fall."""
    first, last = round(SETTLING / TRACK_PERIOD), len(track) - 1 - round(1.0 / TRACK_PERIOD)
    if last <= first:
        return 0.0
    time = (last - first) * TRACK_PERIOD
    if walk.startswith("turn"):
        return abs(float(np.sum([wrap_angle(step) for step in np.diff(track[first : last + 1, 2])]))) / time
    return float(np.hypot(*(track[last, :2] - track[first, :2]))) / time


def _off_the_line(track: Array) -> float | None:
    """Return how far beside the line of its start heading the robot is after 20 m [m]; None if it fell before."""
    heading = np.array([math.cos(START.yaw), math.sin(START.yaw)])
    way = track[:, :2] - track[0, :2]
    beyond = np.nonzero(way @ heading >= LINE)[0]
    if not len(beyond):
        return None
    x, y = way[beyond[0]]
    return round(abs(float(heading[0] * y - heading[1] * x)), 3)


def summarize(rows: list[Row]) -> list[str]:
    """Return a table, one line a walk."""
    lines = [
        "Motion control alone, without camera. Friction 0.6-1.0, link masses +-5 %, joint friction, sensor noise and"
        " delay are random; torques act one tick after their sensors; torque and speed limits of the robot file hold."
        " Speeds are measured from outside after the first 5 s. 0.7 and 0.8 m/s are beyond the limits that motion"
        " control keeps to by itself; the bench lifts them.",
        "",
        "| walk | upright | speed: least, median | off the line after 20 m, most | tilt, most"
        " | torque by its limit: median, most | joint speed, most |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for walk, (velocity, duration, _) in WALKS.items():
        own = [row for row in rows if row["walk"] == walk]
        if not own:
            continue
        speeds = [row["speed [m/s, rad/s]"] for row in own if "speed [m/s, rad/s]" in row]
        unit = "rad/s" if walk.startswith("turn") else "m/s"
        speed = f"{min(speeds):.2f}, {np.median(speeds):.2f} {unit}" if velocity is not None else ""
        offs = [off for row in own if (off := row.get("off the line after 20 m [m]")) is not None]
        torque = [row["greatest torque by limit"] for row in own]
        lines.append(
            f"| {walk}, {duration:.0f} s | {sum(row['upright'] for row in own)} of {len(own)} | {speed}"
            f" | {f'{max(offs):.2f} m' if offs else ''}"
            f" | {max(row['greatest tilt [rad]'] for row in own):.2f} rad"
            f" | {np.median(torque):.2f}, {max(torque):.2f}"
            f" | {max(row['greatest joint speed [rad/s]'] for row in own):.1f} rad/s |"
        )
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the ways of the straight walks from above, 20 times as wide as long."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    axes = figure.add_subplot()
    colours = {"forward 0.6 m/s": "tab:blue", "forward 0.7 m/s": "tab:orange", "forward 0.8 m/s": "tab:red"}
    seen = set()
    for row in rows:
        if row["walk"] in colours:
            way = np.array(row["way [m]"])
            label = None if row["walk"] in seen else row["walk"]
            seen.add(row["walk"])
            axes.plot(way[:, 0], way[:, 1], color=colours[row["walk"]], linewidth=0.8, label=label)
            if not row["upright"]:
                axes.plot(*way[-1], "x", color=colours[row["walk"]])
    for side in (-0.3, 0.3):
        axes.plot([0.0, LINE], [side, side], color="grey", linestyle=":")
    axes.set(xlabel="ahead [m]", ylabel="to the left [m]", title="Straight walks of 60 s; x: fell; dotted: 0.3 m")
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=110)


BENCH = Bench(
    "walk",
    "Walking",
    [(walk, seed) for walk, (_, _, seeds) in WALKS.items() for seed in range(seeds)],
    measure,
    summarize,
    draw,
)
