"""Find a ball that is not known: look back, sweep the head, turn, change place; then from the beginning."""

from __future__ import annotations

import math

from py_trees.composites import Sequence

from tulip_strategy.behaviour.base import Condition, ForSeconds
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.gaze import look_at_ball, look_for_ball
from tulip_strategy.behaviour.steering import towards


def find_lost_ball(context: Context) -> Sequence:
    """Return the subtree that runs while the ball is not known, and fails else."""
    lost = Sequence("ball lost", memory=False)
    lost.add_children([Condition("ball unknown", context, lambda c: not c.ball.known), find_ball(context)])
    return lost


def find_ball(context: Context) -> Sequence:
    """Return the subtree that looks for the ball as a striker does: also by walking about."""
    parameters = context.parameters
    sequence = Sequence("find ball", memory=True)
    sequence.add_children(
        [
            ForSeconds("look where it was", context, _look_back_time, _look_back),
            ForSeconds("sweep the head", context, lambda _: parameters.sweep_time, _sweep),
            ForSeconds("turn round", context, lambda _: 2.0 * math.pi / parameters.search_turn_speed, _turn),
            ForSeconds("go to the middle", context, lambda _: parameters.search_walk_time, _go_to_middle),
        ]
    )
    return sequence


def _bearing(context: Context) -> float:
    """Direction of the ball's last known place [rad], 0 without one."""
    last = context.ball.position
    return 0.0 if last is None else math.atan2(last[1], last[0])


def _look_back_time(context: Context) -> float:
    if context.ball.position is None:
        return 0.0
    return context.parameters.look_back_time + abs(_bearing(context)) / context.parameters.search_turn_speed


def _look_back(context: Context) -> None:
    """Look where the ball was, and turn there where the head alone reaches it badly."""
    bearing = _bearing(context)
    if abs(bearing) > context.parameters.look_back_reach:
        context.walk((0.0, 0.0, math.copysign(context.parameters.search_turn_speed, bearing)))
    else:
        context.stand()
    look_at_ball(context)


def _sweep(context: Context) -> None:
    context.stand()
    look_for_ball(context)


def _turn(context: Context) -> None:
    last = context.ball.position
    side = 1.0 if last is None or last[1] >= 0.0 else -1.0
    context.walk((0.0, 0.0, side * context.parameters.search_turn_speed))
    look_for_ball(context)


def _go_to_middle(context: Context) -> None:
    look_for_ball(context)
    if context.world is None:
        return
    middle = context.world.robot.pose.inverse().transform((0.0, 0.0))
    way_left = math.hypot(*middle)
    if way_left > context.parameters.place_tolerance:
        context.walk(towards(middle, way_left, 0.0, True, context.parameters))
