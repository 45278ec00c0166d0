"""The striker of the dribble and kick competition."""

from __future__ import annotations

from py_trees.composites import Selector, Sequence

from tulip_strategy.behaviour.approach import Approach, BehindBall
from tulip_strategy.behaviour.base import Do
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.dribble import Dribble
from tulip_strategy.behaviour.kick import kick_at_goal
from tulip_strategy.behaviour.search import find_lost_ball


def dribble_and_kick(context: Context) -> Sequence:
    """Return the subtree: find the ball, come round behind it, dribble it to the goal, kick it in."""
    forward = Selector("kick or dribble", memory=False)
    forward.add_children([kick_at_goal(context), Dribble(context)])
    attack = Sequence("attack", memory=False)
    attack.add_children([BehindBall(context), forward])
    ways = Selector("bring the ball in", memory=False)
    ways.add_children([find_lost_ball(context), attack, Approach(context)])
    striker = Sequence("dribble_and_kick", memory=False)
    striker.add_children([Do("aim at the goal", context, aim_at_goal), ways])
    return striker


def aim_at_goal(context: Context) -> None:
    """Aim at the free part of the goal, if the ball's place is known."""
    if context.world is not None and context.ball.position is not None:
        context.aim.at_goal(context.world, context.ball.position, context.opponents, context.dt)
