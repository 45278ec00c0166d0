"""The striker of the dribble and kick competition."""

from __future__ import annotations

from py_trees.composites import Selector, Sequence

from tulip_strategy.behaviour.approach import Approach, BehindBall
from tulip_strategy.behaviour.base import Condition
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.dribble import Dribble
from tulip_strategy.behaviour.kick import kick_ball
from tulip_strategy.behaviour.search import find_ball


def dribble_and_kick(context: Context) -> Selector:
    """Return the subtree: find the ball, come round behind it, dribble it to the goal, kick it in."""
    lost = Sequence("ball lost", memory=False)
    lost.add_children([Condition("ball unknown", context, lambda c: not c.ball.known), find_ball(context)])
    forward = Selector("kick or dribble", memory=False)
    forward.add_children([kick_ball(context), Dribble(context)])
    attack = Sequence("attack", memory=False)
    attack.add_children([BehindBall(context), forward])
    striker = Selector("dribble_and_kick", memory=False)
    striker.add_children([lost, attack, Approach(context)])
    return striker
