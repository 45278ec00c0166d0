from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from kinematic_bench import game_state, motion_state, seen_object

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_motion.interface import MotionMode, WalkMode
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.goalkeeper import guarding_place
from tulip_strategy.interface import Decision, UserCommand, UserRequest
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_worldmodel.world_state import ObjectEstimate, RobotEstimate, WorldState

FIELD = load_field()
GOAL = FIELD.own_goal
PARAMETERS = StrategyParameters()
PLAY = UserCommand(0, UserRequest.PLAY, "goalkeeper")
TICK = 66_666_667  # [ns] 15 Hz
PLACE = GOAL.x + PARAMETERS.keeper_out  # [m] x of the keeper before its goal

Point = tuple[float, float]


class Keeper:
    """A goalkeeper at a pose, told of a ball and of opponents in map."""

    def __init__(self, pose: Pose2D, parameters: StrategyParameters = PARAMETERS) -> None:
        self.strategy = Strategy(parameters, FIELD)
        self.pose = pose
        self.stamp = 0

    def tick(self, ball: Point | None, velocity: Point = (0.0, 0.0), opponents: tuple[Point, ...] = ()) -> Decision:
        self.stamp += TICK
        seen: ObjectEstimate | None = None if ball is None else seen_object(self.pose, ball, velocity)
        others = tuple(seen_object(self.pose, each, (0.0, 0.0)) for each in opponents)
        world = WorldState(self.stamp, RobotEstimate(self.pose, np.eye(3) * 1e-4, self.pose), seen, others)
        state = motion_state(self.stamp, MotionMode.STAND)
        return self.strategy.decide(self.stamp, world, game_state(self.stamp), PLAY, state)

    def ticks(self, seconds: float, ball: Point | None, opponents: tuple[Point, ...] = ()) -> list[Decision]:
        return [self.tick(ball, opponents=opponents) for _ in range(round(seconds * 1e9 / TICK))]


@pytest.mark.parametrize("ball", [(-1.0, 0.0), (-1.5, 2.0), (2.0, -2.5), (-2.5, -1.0)])
def test_its_place_lies_on_the_middle_of_the_angle_that_the_goal_fills(ball: Point) -> None:
    place = guarding_place(ball, Context(PARAMETERS, FIELD))
    assert place.x == pytest.approx(PLACE)
    to_posts = [math.atan2(post.y - ball[1], post.x - ball[0]) for post in GOAL.posts]
    own = math.atan2(place.y - ball[1], place.x - ball[0])
    sides = [math.remainder(post - own, 2.0 * math.pi) for post in to_posts]
    assert sides[0] == pytest.approx(-sides[1], abs=1e-9)
    assert place.yaw == pytest.approx(math.atan2(ball[1] - place.y, ball[0] - place.x))


def test_it_stays_before_the_goal_when_the_ball_lies_beside_it_or_is_not_known() -> None:
    context = Context(PARAMETERS, FIELD)
    beside = guarding_place((GOAL.x + 0.3, 2.5), context)
    assert abs(beside.y) <= 0.5 * GOAL.width
    assert GOAL.x < beside.x < GOAL.x + 0.3
    assert guarding_place(None, context) == Pose2D(PLACE, 0.0, 0.0)


def test_it_goes_to_its_place_and_steps_on_the_spot_while_a_shot_may_come() -> None:
    going = Keeper(Pose2D(PLACE, 0.6, 0.0)).ticks(0.5, (-1.5, 0.0))[-1]
    assert going.walk.mode is WalkMode.WALK
    assert going.walk.velocity[1] < -0.05
    there = Keeper(Pose2D(PLACE, 0.0, 0.0))
    near, far = there.ticks(0.5, (-1.5, 0.0))[-1], there.ticks(1.0, (2.5, 0.0))[-1]
    assert (near.walk.mode, near.walk.velocity) == (WalkMode.WALK, (0.0, 0.0, 0.0))
    assert far.walk.mode is WalkMode.STAND


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_steps_at_once_to_the_side_where_a_shot_will_pass(side: float) -> None:
    keeper = Keeper(Pose2D(PLACE, 0.0, 0.0))
    keeper.ticks(1.0, (-1.5, 0.0))
    decision = keeper.tick((-1.6, side * 0.05), (-1.5, side * 0.45))
    assert decision.tree.endswith("block")
    assert decision.walk.velocity == pytest.approx((0.0, side * PARAMETERS.keeper_side_speed, 0.0))


@pytest.mark.parametrize(
    ("ball", "velocity"),
    [
        ((-1.5, 0.0), (1.5, 0.3)),  # away from the goal
        ((-1.5, 0.0), (-0.4, 0.0)),  # too slow to be a shot
        ((-0.5, 0.0), (-0.8, 0.0)),  # it stops before
        ((-1.5, 0.0), (-1.2, 1.2)),  # far beside the post
        ((-4.2, 0.4), (-1.0, 0.0)),  # past the keeper already
    ],
)
def test_it_does_not_block_what_is_no_shot(ball: Point, velocity: Point) -> None:
    keeper = Keeper(Pose2D(PLACE, 0.0, 0.0))
    keeper.ticks(0.5, ball)
    assert not keeper.tick(ball, velocity).tree.endswith("block")


def test_a_shot_at_its_feet_is_met_without_a_step_aside() -> None:
    keeper = Keeper(Pose2D(PLACE, 0.0, 0.0))
    decision = keeper.tick((-1.6, 0.03), (-1.5, 0.0))
    assert decision.tree.endswith("block")
    assert decision.walk.velocity == (0.0, 0.0, 0.0)


def test_it_clears_a_ball_that_lies_near_unless_an_opponent_is_nearer() -> None:
    ball = (PLACE + 0.6, 0.3)
    assert "clear the ball" in Keeper(Pose2D(PLACE, 0.0, 0.0)).tick(ball).tree
    alone = Keeper(Pose2D(PLACE, 0.0, 0.0)).tick(ball, opponents=((PLACE + 2.5, 0.3),))
    assert "clear the ball" in alone.tree
    taken = Keeper(Pose2D(PLACE, 0.0, 0.0)).tick(ball, opponents=((PLACE + 0.9, 0.4),))
    assert taken.tree.endswith("guard the goal")
    assert "guard" in Keeper(Pose2D(PLACE, 0.0, 0.0)).tick((PLACE + 2.0, 0.3)).tree


@pytest.mark.parametrize("opponents", [(), ((-1.5, 0.0),)])
def test_a_cleared_ball_goes_out_of_the_goal_and_past_opponents(opponents: tuple[Point, ...]) -> None:
    keeper = Keeper(Pose2D(PLACE, 0.4, 0.15))
    ball = keeper.pose.transform((PARAMETERS.kick_ahead, PARAMETERS.kick_lateral))
    kick = next(each.kick for each in keeper.ticks(30.0, ball, opponents) if each.kick is not None)
    direction = keeper.pose.yaw + kick.direction
    assert abs(direction) < math.radians(60.0)
    for x, y in opponents:
        assert abs(direction - math.atan2(y - ball[1], x - ball[0])) > math.radians(10.0)


def test_a_fallen_robot_that_was_taken_out_is_told_to_stand() -> None:
    strategy = Strategy(PARAMETERS, FIELD)
    world = WorldState(0, RobotEstimate(Pose2D(), np.eye(3), Pose2D()), None, ())
    fallen = motion_state(0, MotionMode.FALLEN)
    lies = strategy.decide(0, world, game_state(0), PLAY, fallen)
    assert lies.walk.mode is WalkMode.LIMP
    removed = strategy.decide(TICK, world, replace(game_state(TICK), penalty=5), PLAY, fallen)
    assert removed.walk.mode is WalkMode.STAND
