"""Head movement: sharing the gaze between ball and landmarks, finding the ball, following one that rolls."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tulip_description.field import load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import load_robot
from tulip_motion.head import HeadParameters
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_sim.bench.fixed_glance import FixedGlance
from tulip_sim.bench.head_play import HeadPlay, Velocity
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.search_coverage import Coverage, CoverageParameters, search_coverage
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.gaze import look_at_ball, track_ball
from tulip_strategy.interface import GamePhase, GameState, UserCommand, UserRequest
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_vision.lens import head_camera_lens

Array = NDArray[np.float64]
Gaze = Callable[[Context], None]
SHARE_SEEDS, SHARE_DURATION = 12, 60.0  # [s]
SEARCH_SEEDS, SEARCH_LIMIT = 60, 60.0  # [s]
ROLL_SEEDS = 6
SPEEDS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)  # [m/s]
START_ERROR = (0.3, math.radians(10.0))  # [m] of each axis, [rad]
NEAR = 0.7  # [m] a ball nearer than this is about to be kicked or dribbled
STOP = 0.45  # [m] from the ball, where the walk ends
SURE = (0.03, 0.06, 0.12)  # [m] edges between the classes of the pose's claimed deviation
WINDOW = 0.25  # [s] between two looks at the errors
GAZES = ("planner", "fixed glance", "ball only")


class Follower:
    """Decides as strategy does while a ball is followed: walks by the truth to the ball, looks by the estimate."""

    def __init__(self, play: HeadPlay, gaze: str, walks: bool = True) -> None:
        """Prepare one of GAZES."""
        self.context = Context(StrategyParameters(), play.field)
        self._look: Gaze = {
            "planner": track_ball,
            "fixed glance": FixedGlance().track,
            "ball only": look_at_ball,
        }[gaze]
        self._walks = walks
        self.kicks = False
        self._velocity = np.zeros(3)

    def decide(self, play: HeadPlay) -> tuple[HeadCommand, Velocity]:
        """Return what head and body shall do."""
        context = self.context
        assert play.state is not None
        context.clear_wish()
        context.stamp, context.world = play.stamp, play.state
        context.ball.update(play.state)
        if self.kicks:
            look_at_ball(context)
        else:
            self._look(context)
        glance = context.glance if context.head is HeadMode.TRACK else None
        command = HeadCommand(context.stamp, context.head, context.target, glance)
        return command, self._walk(play) if self._walks else (0.0, 0.0, 0.0)

    def _walk(self, play: HeadPlay) -> Velocity:
        x, y, _ = play.ball_in_footprint().tolist()
        bearing, way = math.atan2(y, x), math.hypot(x, y) - STOP
        wanted = np.array([0.0, 0.0, max(-0.8, min(0.8, 1.5 * bearing))])
        if abs(bearing) < 0.6 and way > 0.02:
            wanted[0] = min(0.4, 0.9 * way)
        if abs(wanted[2]) < 0.05:
            wanted[2] = 0.0
        self._velocity += np.clip(wanted - self._velocity, -0.03, 0.03)  # 1.5 m/s^2 at 50 Hz
        forward, left, turn = self._velocity.tolist()
        return forward, left, turn


def inside(play: HeadPlay, rng: np.random.Generator, margin: float) -> tuple[float, float]:
    """Return a place on the field, so far from its lines [m]."""
    x, y = play.field.length / 2.0 - margin, play.field.width / 2.0 - margin
    return float(rng.uniform(-x, x)), float(rng.uniform(-y, y))


def share(gaze: str, seed: int) -> Row:
    """Follow a ball that is kicked on whenever the robot has stood before it for 2 s."""
    rng = np.random.default_rng([seed, 5])
    start = Pose2D(float(rng.uniform(-3.5, 0.0)), float(rng.uniform(-2.0, 2.0)), float(rng.uniform(-0.8, 0.8)))
    off = np.array(START_ERROR) * rng.uniform(-1.0, 1.0, size=(2, 2))[0]
    believed = Pose2D(start.x + float(off[0]), start.y - float(off[0]), start.yaw + float(off[1]))
    ball = start.transform((1.2, 0.3))
    play = HeadPlay(seed, start, ball, believed)
    follower = Follower(play, gaze)
    errors: list[tuple[float, ...]] = []
    looks: list[tuple[float, float, bool, bool]] = []
    arrived: float | None = None
    kicked = -math.inf
    for index in range(round(SHARE_DURATION / WINDOW)):
        pictures = play.pictures
        now = index * WINDOW
        # Strategy stays on the ball while it kicks.
        follower.kicks = now - kicked < 1.0 or (arrived is not None and now - arrived >= 1.0)
        play.go(WINDOW, follower.decide)
        state, true = play.state, play.pose
        assert state is not None
        distance = float(np.hypot(*play.ball_in_footprint()[:2]))
        pose, covariance = state.robot.pose, state.robot.covariance
        deviation = math.sqrt(0.5 * float(np.trace(covariance[:2, :2])))
        if play.pictures > pictures:
            looks.append((distance, deviation, play.ball_in_picture, follower.context.glance is not None))
        ball_error = math.nan
        if state.ball is not None:
            ball_error = math.dist(state.ball.position, play.ball_in_footprint()[:2]) / max(distance, 0.3)
        error = np.array([pose.x - true.x, pose.y - true.y, wrap_angle(pose.yaw - true.yaw)])
        nees = float(error @ np.linalg.solve(covariance, error))
        if now > 5.0:  # the start error is absorbed
            errors.append((*np.square(error).tolist(), nees, ball_error, deviation, math.sqrt(covariance[2, 2])))
        here = distance < STOP + 0.1 and float(np.hypot(*play.ball_velocity)) == 0.0
        arrived = None if not here else now if arrived is None else arrived
        if arrived is not None and now - arrived >= 2.0:
            aim = np.array(inside(play, rng, 1.0)) - play.ball
            speed = min(2.0, math.sqrt(2.0 * 0.3 * float(np.hypot(*aim))))
            play.ball_velocity = aim / max(float(np.hypot(*aim)), 1e-6) * speed
            arrived, kicked = None, now
    table = np.array(errors)
    seen = np.array([look[2] for look in looks])
    aside = np.array([look[3] for look in looks])
    near = np.array([look[0] < NEAR for look in looks])
    classes = np.digitize([look[1] for look in looks], SURE)
    return {
        "what": "share",
        "gaze": gaze,
        "seed": seed,
        "position RMSE [m]": round(math.sqrt(float(table[:, :2].sum(axis=1).mean())), 4),
        "heading RMSE [deg]": round(math.degrees(math.sqrt(float(table[:, 2].mean()))), 3),
        "NEES": round(float(table[:, 3].mean()), 2),
        "ball error, median [%]": round(100.0 * float(np.nanmedian(table[:, 4])), 2),
        "ball error, 95 % [%]": round(100.0 * float(np.nanpercentile(table[:, 4], 95.0)), 2),
        "ball unknown [%]": round(100.0 * float(np.isnan(table[:, 4]).mean()), 2),
        "position deviation [m]": round(float(table[:, 5].mean()), 4),
        "heading deviation [deg]": round(math.degrees(float(table[:, 6].mean())), 3),
        "ball in picture [%]": round(100.0 * float(seen.mean()), 1),
        "near ball in picture [%]": round(100.0 * float(seen[near].mean()), 1) if near.any() else math.nan,
        "pictures by deviation": [int((classes == each).sum()) for each in range(len(SURE) + 1)],
        "beside the ball": [int(aside[classes == each].sum()) for each in range(len(SURE) + 1)],
    }


def search(seed: int) -> Row:
    """Look for a ball anywhere on the field with strategy's own search; measure until the world model knows it."""
    rng = np.random.default_rng([seed, 6])
    field = load_field()
    x, y = field.length / 2.0 - 0.3, field.width / 2.0 - 0.3
    pose = Pose2D(float(rng.uniform(-x, x)), float(rng.uniform(-y, y)), float(rng.uniform(-math.pi, math.pi)))
    ball = pose.transform((0.0, 0.0))
    while math.dist(ball, (pose.x, pose.y)) < 0.35:
        ball = float(rng.uniform(-x, x)), float(rng.uniform(-y, y))
    play = HeadPlay(seed, pose, ball)
    strategy = Strategy(StrategyParameters(), field)
    user = UserCommand(0, UserRequest.PLAY)
    bearing, distance = math.atan2(*play.ball_in_footprint()[1::-1]), float(np.hypot(*play.ball_in_footprint()[:2]))

    def decide(now: HeadPlay) -> tuple[HeadCommand, Velocity]:
        game = GameState(now.stamp, 7, GamePhase.PLAYING, True, True, 1, 150, 0, 0, 0, 0)
        decision = strategy.decide(now.stamp, now.state, game, user, None)
        return decision.head, decision.walk.velocity

    found = math.nan
    while play.stamp * 1e-9 < SEARCH_LIMIT:
        play.go(0.1, decide)
        if play.state is not None and play.state.ball is not None:
            error = math.dist(play.state.ball.position, play.ball_in_footprint()[:2])
            if error < 0.5 * max(1.0, float(np.hypot(*play.ball_in_footprint()[:2]))):
                found = play.stamp * 1e-9
                break
    return {
        "what": "search",
        "seed": seed,
        "distance [m]": round(distance, 2),
        "bearing [deg]": round(math.degrees(bearing), 1),
        "found after [s]": round(found, 2),
    }


def roll(gaze: str, speed: float, seed: int) -> Row:
    """Stand and watch a ball that rolls by, in front of the robot, from rest."""
    rng = np.random.default_rng([seed, 7])
    start = Pose2D(-1.0, 0.0, float(rng.uniform(-0.3, 0.3)))
    side, ahead = float(rng.choice((-1.0, 1.0))), float(rng.uniform(0.7, 1.8))
    begin = start.transform((ahead + 0.5, 2.2 * side))
    play = HeadPlay(seed, start, begin)
    follower = Follower(play, gaze, walks=False)
    while not follower.context.ball.known and play.stamp < 12_000_000_000:
        play.go(0.5, follower.decide)
    known = follower.context.ball.known
    play.go(1.0, follower.decide)
    aim = np.array(start.transform((ahead, 0.0))) - play.ball
    play.ball_velocity = aim / float(np.hypot(*aim)) * speed
    shown: list[bool] = []
    off_axis: list[float] = []
    while abs(math.atan2(*play.ball_in_footprint()[1::-1])) < 2.0 and float(np.hypot(*play.ball_velocity)) > 0.1:
        pictures = play.pictures
        play.go(0.02, follower.decide)
        if play.pictures > pictures:
            shown.append(play.ball_in_picture)
            camera = play.seen.camera(play.head)
            x, y, z = camera[:3, :3].T @ (play.ball_in_footprint() - camera[:3, 3])
            off_axis.append(math.degrees(math.atan2(math.hypot(x, y), z)))
        if float(np.hypot(*play.ball_in_footprint()[:2])) > 4.0 or len(shown) > 400:
            break
    gaps, longest = 0, 0
    for each in shown:
        gaps = 0 if each else gaps + 1
        longest = max(longest, gaps)
    return {
        "what": "roll",
        "gaze": gaze,
        "seed": seed,
        "speed [m/s]": speed,
        "passes at [m]": round(ahead, 2),
        "known before": known,
        "pictures": len(shown),
        "ball in picture [%]": round(100.0 * float(np.mean(shown)), 1),
        "longest gap [pictures]": longest,
        "off axis, median [deg]": round(float(np.median(off_axis)), 2),
        "off axis, most [deg]": round(max(off_axis), 2),
    }


def coverage(duration: float, turning: float) -> Coverage:
    """Return what the search pattern sees of the ground up to the field's diagonal."""
    field = load_field()
    directions = np.radians(np.arange(-180.0, 180.0, 3.0))
    ranges = np.geomspace(0.25, math.hypot(field.length, field.width), 40)
    parameters = CoverageParameters(field.ball_radius)
    return search_coverage(
        HeadParameters(), load_robot(), head_camera_lens(), directions, ranges, duration, parameters, turning
    )


def covered(turning: bool) -> Row:
    """Measure the pattern's coverage, with the head alone or while the body turns round."""
    p = StrategyParameters()
    duration = 2.0 * math.pi / p.search_turn_speed if turning else p.sweep_time
    result = coverage(duration, p.search_turn_speed if turning else 0.0)
    every = result.seen.all(axis=1)
    blind = np.abs(np.degrees(result.directions[~every]))
    return {
        "what": "coverage",
        "body": "turns" if turning else "stands",
        "duration [s]": round(duration, 2),
        "seen [%]": round(100.0 * float(result.seen.mean()), 2),
        "complete up to [deg]": round(float(blind.min()) - 3.0, 1) if len(blind) else 180.0,
        "last seen after [s]": round(float(np.nanmax(result.first)), 2),
    }


def measure(what: str, *arguments: object) -> Row:
    """Run one trial."""
    trials: dict[str, Callable[..., Row]] = {"share": share, "search": search, "roll": roll, "coverage": covered}
    return trials[what](*arguments)


def summarize(rows: list[Row]) -> list[str]:
    """Return the tables."""
    lines = [
        "World model, gaze planner, strategy's search and head movement as they play, in the timing of lockstep."
        " Simulated without dynamics or pictures: the body slides as told with dead reckoning that errs by some"
        " percent, and what vision would find comes from the truth through the real lens, with noise, misses (also of"
        " a fast head), a camera that sways, and 48 ms of delay; localization gets no lines.",
        "",
        *_coverage_lines([row for row in rows if row["what"] == "coverage"]),
        *_share_lines([row for row in rows if row["what"] == "share"]),
        *_search_lines([row for row in rows if row["what"] == "search"]),
        *_roll_lines([row for row in rows if row["what"] == "roll"]),
    ]
    return lines


def _coverage_lines(rows: Sequence[Row]) -> list[str]:
    return [
        f"- search, body {row['body']}, {row['duration [s]']} s: {row['seen [%]']} % of the ground from 0.25 m to the"
        f" field's diagonal seen (a ball of at least 4 px in 3 sharp pictures), complete within"
        f" {row['complete up to [deg]']:.0f} deg to both sides"
        for row in rows
    ] + [""]


def _share_lines(rows: Sequence[Row]) -> list[str]:
    names = (
        "position RMSE [m]", "heading RMSE [deg]", "position deviation [m]", "heading deviation [deg]", "NEES",
        "ball error, median [%]", "ball error, 95 % [%]", "ball in picture [%]", "near ball in picture [%]",
    )  # fmt: skip
    lines = [
        f"A ball followed for {SHARE_DURATION:.0f} s and kicked on again and again; started with up to 0.3 m and 10 deg"
        f" of error, judged after 5 s. Ball error in per cent of its range; near is nearer than {NEAR} m. Means of"
        f" {len({row['seed'] for row in rows})} trials.",
        "",
        "| gaze | " + " | ".join(names) + " |",
        "| --- |" + " --- |" * len(names),
    ]
    for gaze in GAZES:
        of = [row for row in rows if row["gaze"] == gaze]
        if of:
            lines.append(
                f"| {gaze} | " + " | ".join(f"{np.nanmean([row[name] for row in of]):.3g}" for name in names) + " |"
            )
    lines += [
        "",
        "Share of the time in which the gaze is beside the ball or at landmarks, by how sure the pose is:",
        "",
        "| gaze | " + " | ".join(_class_names()) + " |",
        "| --- |" + " --- |" * (len(SURE) + 1),
    ]
    for gaze in GAZES:
        shares = _shares([row for row in rows if row["gaze"] == gaze])
        if shares:
            lines.append(f"| {gaze} | " + " | ".join(shares) + " |")
    return [*lines, ""]


def _class_names() -> list[str]:
    edges = [f"{edge:g} m" for edge in SURE]
    return [f"< {edges[0]}", *(f"{a} to {b}" for a, b in pairwise(edges)), f"> {edges[-1]}"]


def _shares(rows: Sequence[Row]) -> list[str]:
    if not rows:
        return []
    all_pictures = np.sum([row["pictures by deviation"] for row in rows], axis=0)
    beside = np.sum([row["beside the ball"] for row in rows], axis=0)
    return [
        f"{100.0 * part / whole:.0f} % of {whole}" if whole else "-"
        for part, whole in zip(beside, all_pictures, strict=True)
    ]


def _search_lines(rows: Sequence[Row]) -> list[str]:
    if not rows:
        return []
    times = np.array([row["found after [s]"] for row in rows])
    found = times[~np.isnan(times)]
    lines = [f"- search for a ball anywhere on the field: found {len(found)} of {len(rows)}"]
    if len(found):
        lines[0] += (
            f"; median {np.median(found):.1f} s, 90 % {np.percentile(found, 90):.1f} s, most {found.max():.1f} s"
        )
    return [*lines, ""]


def _roll_lines(rows: Sequence[Row]) -> list[str]:
    lines = [
        "A resting ball is kicked and rolls by at 0.7 to 1.8 m in front of the standing robot:",
        "",
        "| gaze | " + " | ".join(f"{speed:g} m/s" for speed in SPEEDS) + " |",
        "| --- |" + " --- |" * len(SPEEDS),
    ]
    for gaze in GAZES:
        cells = []
        for speed in SPEEDS:
            of = [row for row in rows if row["gaze"] == gaze and row["speed [m/s]"] == speed]
            cells.append(
                f"{np.mean([row['ball in picture [%]'] for row in of]):.0f} %, off axis"
                f" {np.median([row['off axis, median [deg]'] for row in of]):.1f} deg"
                if of
                else "-"
            )
        if any(cell != "-" for cell in cells):
            lines.append(f"| {gaze} | " + " | ".join(cells) + " |")
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the ground that the search sees, and the shares and errors of the gazes."""
    p = StrategyParameters()
    figure = Figure(figsize=(10, 9), layout="constrained")
    pictures = (
        (p.sweep_time, 0.0, f"search, head alone, {p.sweep_time:.0f} s"),
        (2.0 * math.pi / p.search_turn_speed, p.search_turn_speed, "search while the body turns round"),
    )
    for index, (duration, turning, title) in enumerate(pictures):
        axis = figure.add_subplot(2, 2, index + 1, projection="polar")
        result = coverage(duration, turning)
        shown = np.where(result.seen, result.first, np.nan).T
        mesh = axis.pcolormesh(result.directions, result.ranges, shown, cmap="viridis", shading="nearest")
        axis.set_facecolor("tab:red")
        axis.set_theta_zero_location("N")  # type: ignore[attr-defined]  # of polar axes only
        axis.set_rscale("symlog", linthresh=1.0)  # type: ignore[attr-defined]
        axis.set_rticks([0.5, 1.0, 3.0, 10.0])  # type: ignore[attr-defined]
        axis.set_title(f"{title}: seen after [s]; red is never")
        figure.colorbar(mesh, ax=axis, shrink=0.7)
    shares = [row for row in rows if row["what"] == "share"]
    gazes = [gaze for gaze in GAZES if any(row["gaze"] == gaze for row in shares)]
    axis = figure.add_subplot(2, 2, 3)
    for gaze in gazes:
        of = [row for row in shares if row["gaze"] == gaze]
        x = [row["position RMSE [m]"] for row in of]
        axis.scatter(x, [row["ball in picture [%]"] for row in of], label=gaze)
    axis.set(xlabel="position RMSE [m]", ylabel="ball in picture [%]", title="each dot one trial")
    axis.legend()
    axis = figure.add_subplot(2, 2, 4)
    rolls = [row for row in rows if row["what"] == "roll"]
    for gaze in GAZES:
        of = [row for row in rolls if row["gaze"] == gaze]
        means = [
            np.mean([row["ball in picture [%]"] for row in of if row["speed [m/s]"] == speed] or [math.nan])
            for speed in SPEEDS
        ]
        axis.plot(SPEEDS, means, marker="o", label=gaze)
    axis.set(xlabel="speed [m/s]", ylabel="ball in picture [%]", title="ball rolling by", ylim=(0.0, 102.0))
    axis.legend()
    figure.savefig(path, dpi=110)


TRIALS: list[tuple[object, ...]] = [
    *(("coverage", turning) for turning in (False, True)),
    *(("share", gaze, seed) for seed in range(SHARE_SEEDS) for gaze in GAZES),
    *(("search", seed) for seed in range(SEARCH_SEEDS)),
    *(("roll", gaze, speed, seed) for gaze in GAZES for speed in SPEEDS for seed in range(ROLL_SEEDS)),
]
BENCH = Bench("head", "Head movement", TRIALS, measure, summarize, draw)
