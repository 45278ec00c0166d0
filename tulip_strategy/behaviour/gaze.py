"""Where the head looks: at the ball, and at landmarks when the gaze planner finds the robot's place less sure."""

from __future__ import annotations

import math

from tulip_motion.interface import GazeInput, HeadMode
from tulip_strategy.behaviour.context import Context, Point3


def look_ahead(context: Context) -> None:
    """Look straight at the field in front."""
    context.head, context.target = HeadMode.LOOK_AT, (3.0, 0.0, 0.0)


def look_for_ball(context: Context) -> None:
    """Sweep over the field."""
    context.head = HeadMode.SEARCH


def look_at_ball(context: Context) -> None:
    """Stay on the ball's last known place."""
    if context.ball.position is None:
        look_for_ball(context)
        return
    context.head = HeadMode.LOOK_AT
    context.target = (*context.ball.position, context.field.ball_radius)


def track_ball(context: Context) -> None:
    """Follow the ball and glance at landmarks; without a ball, search it."""
    if not context.ball.known:
        look_for_ball(context)
        return
    look_at_ball(context)
    context.head = HeadMode.TRACK
    context.glance = _towards_keeper(context)
    if context.glance is not None:
        return
    known = gaze_input(context)
    context.glance = None if known is None else context.gaze.plan(known)


def _towards_keeper(context: Context) -> Point3 | None:
    """Return where to glance to see the keeper, in base_footprint, or None where that is not of use now."""
    world, ball = context.world, context.ball.position
    near = ball is not None and math.hypot(*ball) < context.parameters.keeper_glance_ball
    if world is None or not near or context.aim.distance > context.parameters.keeper_glance_range:
        return None
    return context.keeper_glance.point(context.stamp, world.robot.pose, context.opponents)


def gaze_input(context: Context) -> GazeInput | None:
    """Return what the gaze planner needs of the world, None while there is no estimate of the ball."""
    world = context.world
    if world is None or world.ball is None:
        return None
    ball = world.ball
    return GazeInput(
        world.stamp,
        world.robot.pose,
        world.robot.covariance,
        ball.position,
        ball.velocity,
        ball.covariance,
        ball.age,
    )
