"""Where the head looks: at the ball, with glances at landmarks that tell where the robot is."""

from __future__ import annotations

import math

from tulip_motion.interface import HeadMode
from tulip_strategy.behaviour.context import Context, Point


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
    context.glance = glance(context)


def glance(context: Context) -> tuple[float, float, float] | None:
    """Return the landmark to glance at [m], in base_footprint: the goal attacked and the nearest, in turns."""
    parameters = context.parameters
    if context.world is None:
        return None
    to_robot = context.world.robot.pose.inverse()

    def relative(point: Point) -> Point:
        return to_robot.transform(point)

    def in_view(point: Point) -> bool:
        return (
            abs(math.atan2(point[1], point[0])) <= parameters.glance_reach
            and parameters.glance_nearest <= math.hypot(*point) <= parameters.glance_farthest
        )

    goal = relative((context.field.opponent_goal.x, 0.0))
    landmarks = sorted((point for point in map(relative, _landmarks(context)) if in_view(point)), key=_distance)
    choice = ([goal] if in_view(goal) else []) + landmarks[:1]
    if not choice:
        return None
    turn = int(context.stamp * 1e-9 / parameters.glance_period)
    return (*choice[turn % len(choice)], parameters.glance_height)


def _distance(point: Point) -> float:
    return math.hypot(*point)


def _landmarks(context: Context) -> list[Point]:
    field = context.field
    posts = [(post.x, post.y) for post in field.goal_posts]
    poles = [(pole.x, pole.y) for pole in field.poles]
    crossings = [(crossing.x, crossing.y) for crossing in field.crossings]
    return [*posts, *poles, *crossings, *field.penalty_marks]
