"""The goalkeeper: between ball and goal, steps into the way of a shot, clears a ball that lies near."""

from __future__ import annotations

import math

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from tulip_description.planar import Pose2D, wrap_angle
from tulip_strategy.behaviour.approach import Approach, BehindBall
from tulip_strategy.behaviour.base import Do, Leaf
from tulip_strategy.behaviour.context import Context, Point
from tulip_strategy.behaviour.gaze import look_at_ball, look_for_ball, track_ball
from tulip_strategy.behaviour.kick import line_up_and_kick
from tulip_strategy.behaviour.place import go_to
from tulip_worldmodel.rolling import DECELERATION

FREE = math.radians(25.0)
"""To either side of an opponent, where a ball that is cleared would meet it."""
CLEARING = [math.radians(angle) for angle in range(-60, 61, 15)]
"""Directions in which a ball may be cleared, from straight out of the goal."""
NEAR = 0.5  # [m] a ball at the feet
SAME = math.radians(8.0)  # two directions nearer than this are one
BLOCKED, KEPT = 3.0, 0.3  # [rad] of way round the ball that a free direction, and the one chosen before, are worth


def goalkeeper(context: Context) -> Behaviour:
    """Return the subtree: block a shot, else clear a ball that lies near, else guard the goal."""
    kick_away = Sequence("kick it away", memory=False)
    kick_away.add_children([BehindBall(context), line_up_and_kick(context)])
    clear = Selector("go and kick it", memory=False)
    clear.add_children([kick_away, Approach(context)])
    near = Sequence("clear the ball", memory=False)
    near.add_children([NearBall(context), Do("aim out of the goal", context, Outwards().aim), clear])
    keeper = Selector("goalkeeper", memory=False)
    keeper.add_children([Block(context), near, Guard(context)])
    return keeper


class Block(Leaf):
    """Steps sideways into the way of a ball that rolls towards the goal, until it is past or still."""

    def __init__(self, context: Context) -> None:
        super().__init__("block", context)
        self._blocks = False

    def update(self) -> Status:
        """Step."""
        context, parameters = self.context, self.context.parameters
        crossing = self._crossing()
        self._blocks = crossing is not None
        if crossing is None:
            return Status.FAILURE
        look_at_ball(context)
        off = math.copysign(max(abs(crossing) - parameters.keeper_cover, 0.0), crossing)
        speed = max(-1.0, min(1.0, off / parameters.keeper_full_speed_offset)) * parameters.keeper_side_speed
        context.walk((0.0, speed, 0.0), sudden=True)
        return Status.RUNNING

    def _crossing(self) -> float | None:
        """Return where, to the left [m], the ball will pass the robot's feet, or None where no shot threatens."""
        context, parameters = self.context, self.context.parameters
        ball, world = context.ball, context.world
        if world is None or ball.position is None or not ball.known:
            return None
        vx, vy = ball.velocity
        speed = math.hypot(vx, vy)
        if speed < (parameters.keeper_shot_over if self._blocks else parameters.keeper_shot_speed):
            return None
        ahead = ball.position[0] - parameters.keeper_toes
        if ahead <= 0.0 or vx >= -0.3 * speed:
            return None
        way = ahead * speed / -vx
        if way > speed**2 / (2.0 * DECELERATION) + parameters.keeper_roll_margin:
            return None  # it stops before
        if not self._threatens_goal(world.robot.pose, ball.position, (vx, vy)):
            return None
        return ball.position[1] + vy * way / speed

    def _threatens_goal(self, pose: Pose2D, ball: Point, velocity: Point) -> bool:
        """Tell whether a ball, in base_footprint, rolls to the goal or hardly beside it."""
        goal = self.context.field.own_goal
        x, y = pose.transform(ball)
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        vx, vy = c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]
        if goal.outward * vx <= 0.0:
            return False
        across = y + vy / vx * (goal.x - x)
        return abs(across) < 0.5 * goal.width + self.context.parameters.keeper_beside


class NearBall(Leaf):
    """Succeeds while the ball lies where the keeper may go and kick it away before anybody else."""

    def __init__(self, context: Context) -> None:
        super().__init__("ball lies near", context)
        self._holds = False

    def update(self) -> Status:
        """Test, with wider limits once it holds."""
        self._holds = self._near()
        return Status.SUCCESS if self._holds else Status.FAILURE

    def _near(self) -> bool:
        context, parameters = self.context, self.context.parameters
        ball, world = context.ball, context.world
        if world is None or ball.position is None or not ball.known:
            return False
        if math.hypot(*ball.velocity) > parameters.keeper_still_speed * (2.0 if self._holds else 1.0):
            return False
        more = parameters.keeper_clear_margin if self._holds else 0.0
        goal = context.field.own_goal
        x, y = world.robot.pose.transform(ball.position)
        if abs(x - goal.x) > parameters.keeper_clear_depth + more or abs(y) > 0.5 * goal.width + 1.0 + more:
            return False
        own = math.hypot(*ball.position)
        others = [math.dist(ball.position, each) for each in context.bodies]
        return all(own < other + more for other in others)


class Guard(Leaf):
    """Stands, or goes, to where it hides most of the goal from the ball; steps on the spot while a shot may come."""

    def __init__(self, context: Context) -> None:
        super().__init__("guard the goal", context)
        self._there = False

    def update(self) -> Status:
        """Go to the place between ball and goal and face the ball."""
        context, parameters = self.context, self.context.parameters
        world = context.world
        if world is None:
            return Status.FAILURE
        if context.ball.known:
            track_ball(context)
        else:
            look_for_ball(context)
        ball = None
        if context.ball.known and context.ball.position is not None:
            ball = world.robot.pose.transform(context.ball.position)
        place = guarding_place(ball, context)
        tolerance = parameters.keeper_place_tolerance * (2.0 if self._there else 1.0)
        self._there = go_to(context, place, tolerance)
        if self._there and ball is not None and math.dist(ball, (place.x, place.y)) < parameters.keeper_alert:
            context.walk((0.0, 0.0, 0.0))  # from steps on the spot, a step aside comes at once
        return Status.RUNNING


def guarding_place(ball: Point | None, context: Context) -> Pose2D:
    """Return where the keeper shall stand, in map: on the middle of the angle that the goal fills, seen from the ball.

    Args:
        ball: In map [m], or None if it is not known.
        context: Parameters and field.
    """
    parameters, goal = context.parameters, context.field.own_goal
    out = parameters.keeper_out
    x = goal.x - goal.outward * out
    facing = math.pi if goal.outward > 0.0 else 0.0
    if ball is None:
        return Pose2D(x, 0.0, facing)
    to_posts = [math.atan2(post.y - ball[1], post.x - ball[0]) for post in goal.posts]
    middle = to_posts[0] + 0.5 * wrap_angle(to_posts[1] - to_posts[0])
    depth = goal.outward * (goal.x - ball[0])  # of the ball before the goal line
    if depth < out + parameters.keeper_nearest:
        x = goal.x - goal.outward * 0.5 * max(depth, 0.2)
    y = ball[1] + math.tan(middle) * (x - ball[0])
    y = max(-0.5 * goal.width, min(0.5 * goal.width, y))
    yaw = math.atan2(ball[1] - y, ball[0] - x)
    return Pose2D(x, y, yaw)


class Outwards:
    """Aims out of the goal, where no opponent stands, with as little of a way round the ball as that takes."""

    def __init__(self) -> None:
        self._last: float | None = None  # direction chosen before, in map [rad]

    def aim(self, context: Context) -> None:
        """Aim at a point in the best direction; the one chosen before counts for a little more."""
        world, ball = context.world, context.ball.position
        if world is None or ball is None:
            self._last = None
            return
        pose, goal = world.robot.pose, context.field.own_goal
        x, y = pose.transform(ball)
        straight = math.atan2(y, x - goal.x)  # from the middle of the goal through the ball
        # A ball at the feet is kicked where the robot faces, one far away where the way to it leads.
        far = max(0.0, min(1.0, (math.hypot(*ball) - NEAR) / NEAR))
        present = pose.yaw + far * math.atan2(ball[1], ball[0])
        opponents = [pose.transform(each) for each in context.bodies]
        at = [math.atan2(oy - y, ox - x) for ox, oy in opponents]

        def cost(direction: float) -> float:
            blocked = sum(max(0.0, 1.0 - abs(wrap_angle(direction - each)) / FREE) for each in at)
            kept = self._last is not None and abs(wrap_angle(direction - self._last)) < SAME
            return abs(wrap_angle(direction - present)) + BLOCKED * blocked - (KEPT if kept else 0.0)

        self._last = min((wrap_angle(straight + turn) for turn in CLEARING), key=cost)
        reach = context.parameters.keeper_clear_reach
        point = (x + reach * math.cos(self._last), y + reach * math.sin(self._last))
        context.aim.at_point(world, ball, point, context.dt)
