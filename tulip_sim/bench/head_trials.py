"""Trials of the head: a ball followed, a ball searched, a ball that rolls by, and what the search pattern covers."""

from __future__ import annotations

import math

import numpy as np

from tulip_description.field import load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import load_robot
from tulip_motion.head import HeadParameters
from tulip_motion.interface import HeadCommand
from tulip_sim.bench.fixed_glance import FixedGlance
from tulip_sim.bench.head_play import HeadPlay, Velocity
from tulip_sim.bench.runner import Row
from tulip_sim.bench.strategy_gaze import Gaze, StrategyGaze
from tulip_sim.search_coverage import Coverage, CoverageParameters, search_coverage
from tulip_strategy.behaviour.gaze import look_at_ball, track_ball
from tulip_strategy.interface import GamePhase, GameState, Penalty, SecondaryState, UserCommand, UserRequest
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_vision.lens import head_camera_lens

SHARE_DURATION = 60.0  # [s]
SEARCH_LIMIT = 60.0  # [s]
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
        self._gaze = StrategyGaze(StrategyParameters(), play.field)
        self.context = self._gaze.context
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
        assert play.state is not None
        command = self._gaze.command(play.stamp, play.state, look_at_ball if self.kicks else self._look)
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
        game = GameState(
            now.stamp, 7, GamePhase.PLAYING, True, True, SecondaryState.PENALTY_SHOOT, 150, 0, 0, Penalty.NONE, 0
        )
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
            camera = play.camera(play.head)
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
