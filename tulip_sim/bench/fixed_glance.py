"""What the gaze planner is measured against: every 3 s a glance, at the goal attacked or the nearest landmark."""

from __future__ import annotations

import math

from tulip_motion.interface import HeadMode
from tulip_strategy.behaviour.context import Context, Point
from tulip_strategy.behaviour.gaze import look_at_ball, look_for_ball

PERIOD, LENGTH = 3.0, 0.7  # [s] from the end of a glance to the next; of a glance, way there included
TURN = 5.0  # [s] then the other landmark
REACH = 1.2  # [rad] to both sides
NEAREST, FARTHEST = 0.8, 7.0  # [m]
HEIGHT = 0.2  # [m] of the point looked at


class FixedGlance:
    """Tracks the ball; knows nothing of how sure the world model is."""

    def __init__(self) -> None:
        self._begun: int | None = None

    def track(self, context: Context) -> None:
        """Follow the ball, and glance; without a ball, search it."""
        if not context.ball.known:
            look_for_ball(context)
            self._begun = None
            return
        look_at_ball(context)
        context.head = HeadMode.TRACK
        if self._begun is None:
            self._begun = context.stamp
        if context.seconds_since(self._begun) % (PERIOD + LENGTH) >= PERIOD:
            context.glance = self._landmark(context)

    def _landmark(self, context: Context) -> tuple[float, float, float] | None:
        if context.world is None:
            return None
        field, to_robot = context.field, context.world.robot.pose.inverse()
        places: list[Point] = [
            *((post.x, post.y) for post in field.goal_posts),
            *((pole.x, pole.y) for pole in field.poles),
            *((crossing.x, crossing.y) for crossing in field.crossings),
            *field.penalty_marks,
        ]
        near = sorted((p for p in map(to_robot.transform, places) if _in_view(p)), key=lambda p: math.hypot(*p))
        goal = to_robot.transform((field.opponent_goal.x, 0.0))
        choice = ([goal] if _in_view(goal) else []) + near[:1]
        return (*choice[int(context.stamp * 1e-9 / TURN) % len(choice)], HEIGHT) if choice else None


def _in_view(point: Point) -> bool:
    return abs(math.atan2(point[1], point[0])) <= REACH and NEAREST <= math.hypot(*point) <= FARTHEST
