from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from kinematic_bench import game_state, motion_state, seen_object

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_motion.interface import MotionMode, WalkMode
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.dribble_course import _Course
from tulip_strategy.behaviour.keeper_glance import MIDDLE, KeeperGlance
from tulip_strategy.behaviour.path import distance_to_way
from tulip_strategy.interface import Decision, GamePhase, UserCommand, UserRequest
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_worldmodel.rolling import DECELERATION, ROLLING_SHARE
from tulip_worldmodel.world_state import RobotEstimate, WorldState

FIELD = load_field()
PARAMETERS = StrategyParameters()
TICK = 66_666_667  # [ns] 15 Hz

Point = tuple[float, float]


class Player:
    """A robot that plays a strategy by name; ball and opponents in map."""

    def __init__(self, strategy: str, pose: Pose2D, parameters: StrategyParameters = PARAMETERS) -> None:
        self.strategy = Strategy(parameters, FIELD)
        self.user = UserCommand(0, UserRequest.PLAY, strategy)
        self.pose = pose
        self.stamp = 0

    def tick(
        self,
        ball: Point,
        opponents: tuple[Point, ...] = (),
        mode: MotionMode = MotionMode.STAND,
        phase: GamePhase = GamePhase.PLAYING,
    ) -> Decision:
        self.stamp += TICK
        others = tuple(seen_object(self.pose, each, (0.0, 0.0)) for each in opponents)
        seen = seen_object(self.pose, ball, (0.0, 0.0))
        world = WorldState(self.stamp, RobotEstimate(self.pose, np.eye(3) * 1e-4, self.pose), seen, others)
        game = game_state(self.stamp, phase)
        return self.strategy.decide(self.stamp, world, game, self.user, motion_state(self.stamp, mode))


def before_the_foot(pose: Pose2D) -> Point:
    x, y = pose.transform((PARAMETERS.kick_ahead, PARAMETERS.kick_lateral))
    return x, y


def test_throw_in_kicks_once_with_the_speed_from_which_the_ball_stops_at_the_target() -> None:
    pose = Pose2D(0.5, -3.2, 0.5 * math.pi)
    parameters = replace(PARAMETERS, throw_target_x=before_the_foot(pose)[0])
    player, ball = Player("throw_in", pose, parameters), before_the_foot(pose)
    decisions = [player.tick(ball) for _ in range(60)]
    kicks = [each.kick for each in decisions if each.kick is not None]
    assert len(kicks) >= 1
    assert kicks[0].direction == pytest.approx(0.0, abs=0.05)
    assert (ROLLING_SHARE * kicks[0].speed) ** 2 / (2.0 * DECELERATION) == pytest.approx(-ball[1], rel=0.02)
    for _ in range(20):
        player.tick(ball, mode=MotionMode.KICK)
    after = [player.tick(ball) for _ in range(60)]
    assert all(each.kick is None and each.walk.mode is WalkMode.STAND for each in after)
    assert after[-1].tree.endswith("thrown in > stand")
    player.tick(ball, phase=GamePhase.SET)
    assert any(player.tick(ball).kick is not None for _ in range(60))  # the next try


@pytest.mark.parametrize("obstacles", [((1.0, 0.1),), ((1.0, 0.1), (2.2, -0.6)), ((0.8, -0.3), (1.6, 0.5), (2.6, 0.0))])
def test_the_way_of_a_dribbled_ball_keeps_clear_of_the_obstacles(obstacles: tuple[Point, ...]) -> None:
    course = _Course(Context(PARAMETERS, FIELD))
    goal, ball, way = (4.5, 0.0), (-1.0, 0.0), [(-1.0, 0.0)]
    while math.dist(ball, goal) > 0.4 and len(way) < 200:
        to_goal = (goal[0] - ball[0], goal[1] - ball[1])
        place = course.next_place(to_goal, [(x - ball[0], y - ball[1]) for x, y in obstacles])
        step = min(0.2, math.hypot(*place)) / math.hypot(*place)
        ball = (ball[0] + step * place[0], ball[1] + step * place[1])
        way.append(ball)
    assert math.dist(ball, goal) <= 0.4
    for obstacle in obstacles:
        nearest = min(distance_to_way(obstacle, a, b) for a, b in pairwise(way))
        assert nearest > 0.6 * PARAMETERS.course_clearance


def test_the_course_is_dribbled_past_an_obstacle_and_not_kicked_against_it() -> None:
    """The robot stands as for a kick along the first piece of the ball's way."""
    for obstacles, kicks, x in ((((2.2, -0.3),), False, 1.2), ((), True, 2.6)):
        pose = Pose2D(x, 0.0, 0.0)
        for _ in range(5):  # until it faces where it aims
            player = Player("dribble_course", pose)
            player.tick(before_the_foot(pose), obstacles)
            pose = replace(pose, yaw=pose.yaw + player.strategy._context.aim.direction)
        player = Player("dribble_course", pose)
        decisions = [player.tick(before_the_foot(pose), obstacles) for _ in range(60)]
        assert any(each.kick is not None for each in decisions) is kicks
        assert kicks or decisions[-1].tree.endswith("dribble")


def test_a_glance_lasts_a_moment_and_comes_again_after_a_while() -> None:
    watch = KeeperGlance(PARAMETERS, FIELD)
    robot = Pose2D(2.0, 0.0, 0.3)
    points = [watch.point(tick * TICK, robot, ()) for tick in range(150)]
    glances = [point is not None for point in points]
    begins = [index for index in range(1, 150) if glances[index] and not glances[index - 1]]
    assert glances[0]
    assert points[0] == pytest.approx((*robot.inverse().transform((4.5, 0.0)), MIDDLE))
    period = PARAMETERS.keeper_glance_time + PARAMETERS.keeper_glance_pause
    assert np.diff([0, *begins]) * TICK * 1e-9 == pytest.approx(period, abs=0.15)
    assert sum(glances) * TICK * 1e-9 / 10.0 == pytest.approx(PARAMETERS.keeper_glance_time / period, abs=0.1)


def test_there_is_no_glance_at_a_keeper_who_was_just_seen_nor_at_others() -> None:
    robot = Pose2D(2.0, 0.0, 0.0)
    keeper, striker = (seen_object(robot, place, (0.0, 0.0)) for place in ((4.2, 0.4), (0.0, 1.0)))
    assert KeeperGlance(PARAMETERS, FIELD).point(0, robot, (keeper,)) is None
    stale = replace(keeper, age=PARAMETERS.keeper_glance_age + 0.1)
    assert KeeperGlance(PARAMETERS, FIELD).point(0, robot, (stale, striker)) == pytest.approx((2.2, 0.4, MIDDLE))
    assert KeeperGlance(PARAMETERS, FIELD).point(0, robot, (striker,)) == pytest.approx((2.5, 0.0, MIDDLE))
