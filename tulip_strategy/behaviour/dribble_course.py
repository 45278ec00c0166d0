"""Technical challenge "obstacle avoidance and dribbling": bring the ball past obstacles into the goal."""

from __future__ import annotations

import math

from py_trees.composites import Selector, Sequence

from tulip_strategy.behaviour.approach import Approach, BehindBall
from tulip_strategy.behaviour.base import Condition, Do
from tulip_strategy.behaviour.context import Context, Point
from tulip_strategy.behaviour.dribble import Dribble
from tulip_strategy.behaviour.kick import kick_at_goal
from tulip_strategy.behaviour.path import distance_to_way, next_waypoint, side_round
from tulip_strategy.behaviour.search import find_lost_ball


def dribble_course(context: Context) -> Sequence:
    """Return the subtree: dribble along a way that keeps clear of the obstacles, kick where none is left."""
    course = _Course(context)
    kick = Sequence("shoot", memory=False)
    kick.add_children([Condition("nothing in the way", context, lambda _: course.free), kick_at_goal(context)])
    forward = Selector("kick or dribble", memory=False)
    forward.add_children([kick, Dribble(context)])
    attack = Sequence("attack", memory=False)
    attack.add_children([BehindBall(context), forward])
    ways = Selector("bring the ball past the obstacles", memory=False)
    ways.add_children([find_lost_ball(context), attack, Approach(context)])
    challenge = Sequence("dribble_course", memory=False)
    challenge.add_children([Do("aim past the obstacles", context, course.aim), ways])
    return challenge


class _Course:
    """Finds the ball's way, and keeps to the side on which it passes an obstacle.

    Attributes:
        free: Whether nothing is left between ball and goal.
    """

    def __init__(self, context: Context) -> None:
        self._clearance = context.parameters.course_clearance
        self._side = 0
        self.free = False

    def aim(self, context: Context) -> None:
        """Aim at the next place of the ball's way to the goal; at the goal itself where the way is free."""
        world, ball = context.world, context.ball.position
        if world is None or ball is None:
            return
        x, y = world.robot.pose.transform(ball)
        goal = context.field.opponent_goal
        obstacles = [(float(o.position_in_map[0]) - x, float(o.position_in_map[1]) - y) for o in context.opponents]
        target = (goal.x - x, -y)
        way = self.next_place(target, obstacles)
        self.free = way == target
        if self.free:
            context.aim.at_goal(world, ball, context.opponents, context.dt)
        else:
            context.aim.at_point(world, ball, (x + way[0], y + way[1]), context.dt)

    def next_place(self, target: Point, obstacles: list[Point]) -> Point:
        """Return the next place on the ball's way, seen from the ball [m], in the axes of map."""
        in_way = [
            each
            for each in obstacles
            if distance_to_way(each, (0.0, 0.0), target) < self._clearance and math.dist(each, target) > self._clearance
        ]
        if not in_way:
            self._side = 0
            return target
        nearest = min(in_way, key=lambda each: math.hypot(*each))
        self._side = side_round(target, nearest, self._side)
        return next_waypoint(target, nearest, self._clearance, self._side, 0.3)
