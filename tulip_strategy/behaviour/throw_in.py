"""Technical challenge "throw-in": the ball lies beside the line; walk to it, line up, kick it to a target, once."""

from __future__ import annotations

import math

from py_trees.composites import Selector, Sequence

from tulip_strategy.behaviour.approach import Approach, BehindBall
from tulip_strategy.behaviour.base import Act, Condition, Do
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.gaze import track_ball
from tulip_strategy.behaviour.kick import line_up_and_kick
from tulip_strategy.behaviour.search import find_lost_ball
from tulip_worldmodel.rolling import DECELERATION, ROLLING_SHARE


def throw_in(context: Context) -> Sequence:
    """Return the subtree: find the ball, come round behind it, kick it to the target, then stand."""
    done = Sequence("thrown in", memory=False)
    done.add_children([Condition("has kicked", context, lambda c: c.kicks > 0), Act("stand", context, _watch)])
    kick = Sequence("kick to the target", memory=False)
    kick.add_children([BehindBall(context), line_up_and_kick(context)])
    ways = Selector("bring the ball in", memory=False)
    ways.add_children([done, find_lost_ball(context), kick, Approach(context)])
    challenge = Sequence("throw_in", memory=False)
    challenge.add_children([Do("aim at the target", context, aim_at_target), ways])
    return challenge


def aim_at_target(context: Context) -> None:
    """Aim at the target, with the speed from which the ball stops there: it slides, then rolls with v^2 = 2 a d."""
    world, ball, p = context.world, context.ball.position, context.parameters
    if world is None or ball is None:
        return
    target = (p.throw_target_x, p.throw_target_y)
    way = math.dist(world.robot.pose.transform(ball), target)
    context.aim.at_point(world, ball, target, context.dt, math.sqrt(2.0 * DECELERATION * way) / ROLLING_SHARE)


def _watch(context: Context) -> None:
    context.stand()
    track_ball(context)
