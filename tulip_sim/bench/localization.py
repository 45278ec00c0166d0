"""Localization against the truth: walks with a wrong start, and kidnapped robots. Rendered camera and real vision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import NDArray
from scipy.stats import chi2

from tulip_description.field import Field, load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_sim.bench.guided import GuidedWalk
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.camera import CameraParameters
from tulip_sim.keeper import Keeper
from tulip_sim.lockstep import Settings
from tulip_sim.perception import PerceptionParameters
from tulip_sim.scenario import Scenario
from tulip_sim.timing import SLOW_TICKS

Array = NDArray[np.float64]

WALKS, KIDNAPPINGS = 20, 100
DURATION = 120.0  # [s] of a walk
PLACES = 24  # that a walk goes to, one after the other
START_ERROR = (0.5, math.radians(15.0))  # [m], [rad] by which the robot is told a wrong start: up to this
ABSORBED = (0.15, math.radians(5.0))  # [m], [rad] the start error is absorbed when it stays below this
SETTLED = 10.0  # [s] after the start, from which errors and consistency count
LOOK = 1.0  # [s] between two looks at a walk
QUIET = 3.0  # [s] that a robot knows its place before it is kidnapped
SEARCH = 10.0  # [s] that it has to find itself again
STAYS = 1.0  # [s] that it must have known its place by then
FOUND = (0.3, math.radians(10.0))  # [m], [rad] it is found when it errs by less, and does not call itself lost
MIRRORED = math.radians(150.0)  # [rad] a heading that errs by more, with a place turned about the centre, is mirrored
CLEAR = 0.7  # [m] from the ball, of ways to walk: nobody kicks it
MOUNT_ANGLE, MOUNT_HEIGHT = math.radians(0.15), 0.005  # [rad], [m] what calibrate.py mount leaves (docs/vision.md)
MARGIN = 0.8  # [m] from the outer lines, of places to walk to and to be put at
ENLARGED = 20.0  # ellipses in the picture: in their own size they are points
BOUND = float(chi2.ppf(0.95, df=3))  # of the NEES of (x, y, yaw): 95 of 100 lie below if the covariance is right


def settings_of(perception: str, seed: int) -> Settings:
    """Return the parameters of all cores, with a camera that sits as calibration leaves it.

    Args:
        seed: Of how the camera sits.
        perception: "vision" for rendered pictures and real vision, which alone counts; "quick" for features from the
            truth with errors, "ideal" for those without.

    Raises:
        ValueError: for another word.
    """
    known = {"vision": None, "quick": PerceptionParameters(), "ideal": PerceptionParameters.ideal()}
    if perception not in known:
        raise ValueError(f"perception is {perception!r}; expected one of {', '.join(known)}")
    camera = CameraParameters(mount_angle=MOUNT_ANGLE, mount_height=MOUNT_HEIGHT, mount_seed=seed)
    return Settings(camera=camera, perception=known[perception])


def walk(seed: int, perception: str = "vision") -> Row:
    """Walk once, from a start that the robot is told wrong."""
    field, rng = load_field(), np.random.default_rng([seed, 11])
    start = _place(rng, field)
    off, turn = float(rng.uniform(0.0, START_ERROR[0])), float(rng.uniform(-math.pi, math.pi))
    twist = float(rng.uniform(-START_ERROR[1], START_ERROR[1]))
    belief = Pose2D(start.x + off * math.cos(turn), start.y + off * math.sin(turn), start.yaw + twist)
    scenario = _scenario(start, seed, rng, field)
    places = _way_round(start, scenario.ball, rng, field)
    robot = GuidedWalk(scenario, seed, places, settings_of(perception, seed), belief)
    looks, distance = [], 0.0
    try:
        last = robot.world.truth().footprint
        for second in range(1, round(DURATION / LOOK) + 1):
            while robot.stamp < second * LOOK * 1e9 and not robot.fallen:
                robot.step()
            if robot.fallen:
                break
            truth, believed, covariance = robot.compare()
            distance += math.hypot(truth.x - last.x, truth.y - last.y)
            last = truth
            looks.append((truth, believed, covariance))
    finally:
        robot.close()
    errors = np.array([_error(truth, believed) for truth, believed, _ in looks])
    nees = [float(error @ np.linalg.solve(look[2], error)) for error, look in zip(errors, looks, strict=True)]
    wrong = (np.hypot(errors[:, 0], errors[:, 1]) > ABSORBED[0]) | (np.abs(errors[:, 2]) > ABSORBED[1])
    absorbed = LOOK * (int(np.flatnonzero(wrong)[-1]) + 1) if wrong.any() else 0.0
    counted = errors[round(SETTLED / LOOK) :]
    return {
        "kind": "walk",
        "seed": seed,
        "perception": perception,
        "poles": seed % 2 == 0,
        "upright": not robot.fallen,
        "distance [m]": round(distance, 2),
        "start error [m]": round(off, 3),
        "start error [deg]": round(math.degrees(twist), 2),
        "absorbed after [s]": absorbed,
        "RMSE [m]": _rms(np.hypot(counted[:, 0], counted[:, 1])),
        "RMSE [deg]": _rms(np.degrees(counted[:, 2])),
        "NEES": [round(value, 3) for value in nees],
        "true x, y [m], yaw [rad]": [_rounded(truth.as_array()) for truth, _, _ in looks],
        "believed x, y [m], yaw [rad]": [_rounded(believed.as_array()) for _, believed, _ in looks],
        "covariance xx, xy, yy [m^2]": [
            [float(f"{value:.4g}") for value in (each[0, 0], each[0, 1], each[1, 1])] for _, _, each in looks
        ],
    }


def kidnap(seed: int, perception: str = "vision") -> Row:
    """Put a standing robot somewhere else, and see whether and when it finds itself again."""
    field, rng = load_field(), np.random.default_rng([seed, 12])
    start, target = _place(rng, field), _place(rng, field)
    robot = GuidedWalk(_scenario(start, seed, rng, field), seed, (), settings_of(perception, seed))
    noticed: float | None = None
    found: float | None = None
    known_before = False
    error = np.zeros(3)
    try:
        while robot.stamp < QUIET * 1e9:
            robot.step()
        known_before = not robot.world_model.localization.lost
        robot.carry(target)
        begin = robot.stamp
        while robot.stamp - begin < (SEARCH + STAYS) * 1e9:
            for _ in range(SLOW_TICKS):
                robot.step()
            time = (robot.stamp - begin) * 1e-9
            truth, believed, _ = robot.compare()
            error, lost = _error(truth, believed), robot.world_model.localization.lost
            if lost and noticed is None:
                noticed = time
            right = math.hypot(error[0], error[1]) < FOUND[0] and abs(error[2]) < FOUND[1]
            found = (time if found is None else found) if right and not lost else None
    finally:
        robot.close()
    mirrored = abs(error[2]) > MIRRORED and math.hypot(believed.x + truth.x, believed.y + truth.y) < 1.0
    return {
        "kind": "kidnapping",
        "seed": seed,
        "perception": perception,
        "poles": seed % 2 == 0,
        "upright": not robot.fallen,
        "knew its place before": known_before,
        "carried [m]": round(math.hypot(target.x - start.x, target.y - start.y), 2),
        "turned [deg]": round(math.degrees(wrap_angle(target.yaw - start.yaw)), 1),
        "noticed after [s]": None if noticed is None else round(noticed, 2),
        "found after [s]": None if found is None or found > SEARCH else round(found, 2),
        "error at the end [m]": round(math.hypot(error[0], error[1]), 4),
        "error at the end [deg]": round(math.degrees(error[2]), 2),
        "mirrored": bool(mirrored),
    }


def measure(kind: str, seed: int, perception: str = "vision") -> Row:
    """Run one trial, "walk" or "kidnap"."""
    return walk(seed, perception) if kind == "walk" else kidnap(seed, perception)


def bounds(runs: int) -> tuple[float, float]:
    """Return between which values the mean NEES of so many runs lies with 95 % if the covariance is right."""
    return float(chi2.ppf(0.025, df=3 * runs)) / runs, float(chi2.ppf(0.975, df=3 * runs)) / runs


def summarize(rows: list[Row]) -> list[str]:
    """Return accuracy, consistency and what became of the kidnapped."""
    walks = [row for row in rows if row["kind"] == "walk"]
    carried = [row for row in rows if row["kind"] == "kidnapping"]
    quick = sorted({row["perception"] for row in rows} - {"vision"})
    lines = [
        f"{len(walks)} walks of {DURATION:.0f} s between random places, steered by the robot's own estimate, the head"
        f" following a ball and glancing where the gaze planner wants to; the start told wrong by up to"
        f" {START_ERROR[0]} m and {math.degrees(START_ERROR[1]):.0f} deg."
        f" {len(carried)} standing robots carried to random places, legs limp,"
        " nobody telling them. Half of all without landmark poles: the two halves of the field look alike then, and"
        " only the heading since the start tells them apart. " + _source(quick),
        "",
    ]
    if walks:
        lines += _about_walks(walks)
    if carried:
        lines += _about_kidnappings(carried)
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the first walk with its error ellipses, all NEES over time, and when the kidnapped were found."""
    walks = [row for row in rows if row["kind"] == "walk"]
    carried = [row for row in rows if row["kind"] == "kidnapping"]
    figure = Figure(figsize=(10, 8.5), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(3, 2))
    if walks:
        axis = figure.add_subplot(grid[0, :])
        _draw_field(axis)
        _draw_way(axis, walks[0])
        axis = figure.add_subplot(grid[1, 0])
        length = max(len(row["NEES"]) for row in walks)
        for row in walks:
            axis.plot(LOOK * np.arange(1, len(row["NEES"]) + 1), row["NEES"], color="tab:blue", lw=0.4, alpha=0.5)
        whole = [row["NEES"] for row in walks if len(row["NEES"]) == length]
        axis.plot(LOOK * np.arange(1, length + 1), np.mean(whole, axis=0), color="black", lw=1.2, label="mean")
        axis.axhspan(*bounds(len(whole)), color="tab:green", alpha=0.25, label="95 % bounds of the mean")
        axis.axhline(BOUND, color="tab:red", lw=0.8, label="95 % bound of one")
        axis.set(title="NEES of (x, y, yaw)", xlabel="time [s]", ylim=(0.0, 20.0))
        axis.legend(fontsize="small")
    if carried:
        axis = figure.add_subplot(grid[1, 1])
        for poles, name in ((True, "with poles"), (False, "without poles")):
            group = [row for row in carried if row["poles"] == poles]
            times = sorted(row["found after [s]"] for row in group if row["found after [s]"] is not None)
            if group:
                shares = [100.0 * (index + 1) / len(group) for index in range(len(times))]
                axis.step(
                    [0.0, *times, SEARCH], [0.0, *shares, shares[-1] if shares else 0.0], where="post", label=name
                )
        axis.set(title="kidnapped robots that found themselves", xlabel="time [s]", ylabel="[%]", ylim=(0.0, 103.0))
        axis.legend(fontsize="small")
    figure.savefig(path, dpi=110)


def _place(rng: np.random.Generator, field: Field) -> Pose2D:
    """Return a random pose inside the lines."""
    x = float(rng.uniform(-1.0, 1.0)) * (field.length / 2.0 - MARGIN)
    y = float(rng.uniform(-1.0, 1.0)) * (field.width / 2.0 - MARGIN)
    return Pose2D(x, y, float(rng.uniform(-math.pi, math.pi)))


def _scenario(start: Pose2D, seed: int, rng: np.random.Generator, field: Field) -> Scenario:
    """Return a field with a ball anywhere but at the robot's feet, and a keeper, whom walks do not meet."""
    keeper = Keeper(Pose2D(field.opponent_goal.x - 0.3, float(rng.uniform(-0.7, 0.7)), -math.pi))
    ball = _place(rng, field)
    while math.hypot(ball.x - start.x, ball.y - start.y) < CLEAR:
        ball = _place(rng, field)
    return Scenario(start, (ball.x, ball.y), keeper, poles=seed % 2 == 0)


def _way_round(
    start: Pose2D, ball: tuple[float, float], rng: np.random.Generator, field: Field
) -> list[tuple[float, float]]:
    """Return random places such that the straight ways between them keep clear of the ball."""
    here, places = np.array([start.x, start.y]), list[tuple[float, float]]()
    while len(places) < PLACES:
        place = _place(rng, field)
        way = np.array([place.x, place.y]) - here
        along = float(np.clip((np.array(ball) - here) @ way / max(float(way @ way), 1e-9), 0.0, 1.0))
        if np.linalg.norm(here + along * way - ball) > CLEAR:
            places.append((place.x, place.y))
            here = here + way
    return places


def _error(truth: Pose2D, believed: Pose2D) -> Array:
    return np.array([believed.x - truth.x, believed.y - truth.y, wrap_angle(believed.yaw - truth.yaw)])


def _rms(values: Array) -> float | None:
    return round(float(np.sqrt((values**2).mean())), 4) if len(values) else None


def _rounded(values: Array) -> list[float]:
    return [round(float(value), 4) for value in values]


def _source(quick: Sequence[str]) -> str:
    if quick:
        return f"**Features from the truth ({', '.join(quick)}), not from pictures: a quick look, no result.**"
    return (
        "Rendered camera, real vision, randomised robots, the camera off by up to"
        f" {math.degrees(MOUNT_ANGLE):.2f} deg and {1000.0 * MOUNT_HEIGHT:.0f} mm as its calibration leaves it."
    )


def _about_walks(walks: Sequence[Row]) -> list[str]:
    whole = [row for row in walks if row["upright"]]
    lines = [f"- walks: {len(whole)} of {len(walks)} without a fall, median {_median(walks, 'distance [m]'):.1f} m"]
    rated = [row for row in walks if row["RMSE [m]"] is not None]
    if rated:
        position = math.sqrt(float(np.mean([row["RMSE [m]"] ** 2 for row in rated])))
        heading = math.sqrt(float(np.mean([row["RMSE [deg]"] ** 2 for row in rated])))
        lines.append(
            f"- RMSE after {SETTLED:.0f} s: {position:.4f} m and {heading:.3f} deg (bars: 0.10 m, 3 deg); worst walk"
            f" {max(row['RMSE [m]'] for row in rated):.4f} m, {max(row['RMSE [deg]'] for row in rated):.3f} deg"
        )
        late = max(row["absorbed after [s]"] for row in rated)
        lines.append(
            f"- start error absorbed (below {ABSORBED[0]} m, {math.degrees(ABSORBED[1]):.0f} deg, and it stays):"
            f" median {_median(rated, 'absorbed after [s]'):.0f} s, latest {late:.0f} s"
        )
    samples = np.array([value for row in walks for value in row["NEES"][round(SETTLED / LOOK) :]])
    if len(samples):
        lines.append(
            f"- consistency: NEES of (x, y, yaw) below its 95 % bound {BOUND:.2f} in"
            f" {100.0 * np.mean(samples < BOUND):.1f} % of {len(samples)} looks (bar: 95 %);"
            f" mean {samples.mean():.2f} (3 if the covariance is exact, less if it is too careful)"
        )
    if whole:
        low, high = bounds(len(whole))
        means = np.mean([row["NEES"][round(SETTLED / LOOK) :] for row in whole], axis=0)
        lines.append(
            f"- mean NEES of {len(whole)} walks at one time, bounds {low:.2f} to {high:.2f}: inside at"
            f" {int(np.sum((means >= low) & (means <= high)))} of {len(means)} times, above at"
            f" {int(np.sum(means > high))}, below (too careful) at {int(np.sum(means < low))}"
        )
    return lines


def _about_kidnappings(carried: Sequence[Row]) -> list[str]:
    found = [row for row in carried if row["found after [s]"] is not None]
    lines = [
        f"- kidnappings: found within {SEARCH:.0f} s {len(found)} of {len(carried)} (bar: 95 of 100),"
        f" mirrored {sum(row['mirrored'] for row in carried)} (bar: 0), fallen"
        f" {sum(not row['upright'] for row in carried)}"
    ]
    if found:
        times = np.array([row["found after [s]"] for row in found])
        noticed = [row["noticed after [s]"] for row in carried if row["noticed after [s]"] is not None]
        lines.append(
            f"- found after: median {np.median(times):.2f} s, 95 % {np.percentile(times, 95):.2f} s, latest"
            f" {times.max():.2f} s; noticed after median {np.median(noticed) if noticed else math.nan:.2f} s"
        )
    return lines


def _median(rows: Sequence[Row], name: str) -> float:
    return float(np.median([row[name] for row in rows]))


def _draw_field(axis: Axes) -> None:
    field = load_field()
    for segment in field.line_segments:
        axis.plot(*zip(segment.start, segment.end, strict=True), color="0.75", lw=1.0)
    turn = np.linspace(0.0, 2.0 * math.pi, 60)
    radius = field.centre_circle.radius
    axis.plot(radius * np.cos(turn), radius * np.sin(turn), color="0.75", lw=1.0)
    for post in field.goal_posts:
        axis.plot(post.x, post.y, "o", color="goldenrod")


def _draw_way(axis: Axes, row: Row) -> None:
    truth, believed = np.array(row["true x, y [m], yaw [rad]"]), np.array(row["believed x, y [m], yaw [rad]"])
    axis.plot(truth[:, 0], truth[:, 1], color="black", lw=0.9, label="truth")
    axis.plot(believed[:, 0], believed[:, 1], ".", color="tab:blue", ms=3, label="believed")
    for (x, y, _), (xx, xy, yy) in zip(believed, row["covariance xx, xy, yy [m^2]"], strict=True):
        values, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
        width, height = 2.0 * ENLARGED * np.sqrt(np.maximum(values, 0.0))
        angle = math.degrees(math.atan2(vectors[1, 0], vectors[0, 0]))
        ellipse = Ellipse((x, y), width, height, angle=angle, fill=False, color="tab:orange", lw=0.6)
        axis.add_patch(ellipse)
    title = f"walk {row['seed']}: error ellipses of 1 sigma, {ENLARGED:.0f} times enlarged"
    axis.set(title=title, xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(-5.2, 5.2), ylim=(-3.7, 3.7))
    axis.legend(loc="upper right", fontsize="small")


TRIALS = [("walk", seed) for seed in range(WALKS)] + [("kidnap", seed) for seed in range(KIDNAPPINGS)]
BENCH = Bench("localization", "Localization", TRIALS, measure, summarize, draw)
