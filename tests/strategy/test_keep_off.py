from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from kinematic_bench import KinematicTrial, seen_object

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_motion.interface import WalkCommand
from tulip_strategy.behaviour.approach import Approach
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.keep_off import Obstacle, in_kicks_way, kept_off
from tulip_strategy.parameters import StrategyParameters
from tulip_worldmodel.world_state import RobotEstimate, WorldState

PARAMETERS = StrategyParameters()
OFF, GAIN = PARAMETERS.keep_off, PARAMETERS.keep_off_gain
SPEEDS = st.floats(-0.5, 0.5)


def at(*place: float) -> Obstacle:
    return Obstacle(place, OFF, PARAMETERS.opponent_clearance)


def test_far_opponents_change_nothing() -> None:
    assert kept_off((0.4, 0.1, 0.3), [at(3.0, 0.0), at(0.0, -2.0)], GAIN) == (0.4, 0.1, 0.3)


def test_speed_towards_somebody_falls_to_nothing_and_then_leads_away() -> None:
    for distance in (OFF + 0.2, OFF, OFF - 0.1):
        forward, left, turn = kept_off((0.4, 0.1, 0.3), [at(distance, 0.0)], GAIN)
        assert forward == pytest.approx(GAIN * (distance - OFF))
        assert (left, turn) == (0.1, 0.3)


@given(SPEEDS, SPEEDS, st.floats(0.3, 2.0), st.floats(-math.pi, math.pi))
def test_nobody_is_walked_into_and_the_way_past_stays_open(forward, left, distance, angle) -> None:
    place = (distance * math.cos(angle), distance * math.sin(angle))
    x, y, _ = kept_off((forward, left, 0.0), [at(*place)], GAIN)
    towards, along = math.cos(angle), math.sin(angle)
    assert x * towards + y * along <= max(GAIN * (distance - OFF), forward * towards + left * along) + 1e-9
    assert x * towards + y * along <= GAIN * (distance - OFF) + 1e-9 or (x, y) == (forward, left)
    assert -x * along + y * towards == pytest.approx(-forward * along + left * towards, abs=1e-9)


def test_posts_and_poles_of_the_map_are_obstacles_wherever_the_robot_is() -> None:
    field = load_field()
    context = Context(PARAMETERS, field)
    assert context.obstacles == []  # it does not know where it is yet
    pose = Pose2D(-3.0, 1.0, 2.0)
    context.see(WorldState(0, RobotEstimate(pose, np.eye(3) * 0.01, Pose2D()), None, ()))
    found = sorted(np.round(pose.transform(each.position), 9).tolist() for each in context.obstacles)
    expected = sorted([each.x, each.y] for each in (*field.goal_posts, *field.poles))
    assert np.allclose(found, expected)


class Watched(KinematicTrial):
    """A trial near the own goal that notes how near the robot comes to a post of it."""

    def __init__(self, parameters: StrategyParameters, robot: Pose2D, ball: tuple[float, float]) -> None:
        super().__init__(3, parameters=parameters)
        self.robot, self.ball = robot, np.array(ball)
        self.post = self.field.own_goal.posts[0]
        self.nearest = math.inf

    def _step(self, command: WalkCommand) -> None:
        super()._step(command)
        self.nearest = min(self.nearest, math.dist((self.robot.x, self.robot.y), (self.post.x, self.post.y)))


def test_the_way_to_a_ball_behind_a_goal_post_leads_round_the_post() -> None:
    start = Pose2D(-4.25, 2.0, -1.6), (-4.1, 0.5)
    careless = Watched(replace(PARAMETERS, keep_off_upright=0.01, upright_clearance=0.01), *start)
    careless.run(60.0)
    assert careless.nearest < 0.2
    careful = Watched(PARAMETERS, *start)
    careful.run(60.0)
    assert careful.nearest > 0.3
    assert careful.touches > 0


def test_where_the_shorter_way_round_the_ball_has_no_room_beside_a_post_the_other_one_is_taken() -> None:
    """The ball lies 0.54 m from a post of the own goal, and the robot comes from the post's side."""
    robot, ball = Pose2D(-3.3, 1.5, math.pi), (-4.09, 1.71)
    turns = {}
    for name, parameters in {"no post": replace(PARAMETERS, keep_off_upright=0.01), "post": PARAMETERS}.items():
        context = Context(parameters, load_field())
        seen = seen_object(robot, ball, (0.0, 0.0))
        context.see(WorldState(10**9, RobotEstimate(robot, np.eye(3) * 1e-4, robot), seen, ()))
        context.aim.direction = math.radians(169.0)  # to the opponent's goal, behind the robot
        approach = Approach(context)
        approach.initialise()
        approach.update()
        turns[name] = context.velocity[2]
    assert turns["post"] < 0.0 < turns["no post"]


def test_a_kick_is_held_back_where_the_leg_would_meet_somebody() -> None:
    near = PARAMETERS.kick_clear_distance - 0.05
    assert in_kicks_way(0.0, [(near, 0.1)], PARAMETERS)
    assert not in_kicks_way(0.0, [(near + 0.1, 0.0)], PARAMETERS)
    assert not in_kicks_way(0.0, [(0.0, near)], PARAMETERS)
