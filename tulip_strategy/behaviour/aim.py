"""Where to send the ball: the free part of the goal beside the keeper, or a point."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from tulip_description.field import Field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_strategy.parameters import StrategyParameters
from tulip_worldmodel.world_state import ObjectEstimate, WorldState

Point = tuple[float, float]


@dataclass(frozen=True)
class Gap:
    """A free angle of the goal, seen from the ball.

    Attributes:
        right, left: Its edges [rad], directions in the frame of the points.
    """

    right: float
    left: float

    @property
    def width(self) -> float:
        """Free angle [rad]."""
        return self.left - self.right

    @property
    def middle(self) -> float:
        """Direction of its middle [rad]."""
        return 0.5 * (self.left + self.right)


def free_gaps(
    ball: Point,
    posts: tuple[Point, Point],
    post_radius: float,
    obstacles: Iterable[Point],
    obstacle_radius: float,
    ball_radius: float,
    obstacle_reach: float = 0.0,
) -> tuple[Gap, ...]:
    """Return the directions in which the ball passes into the goal, from right to left.

    Everything that the ball could touch is made larger by the ball's radius. All points are in one frame.

    Args:
        ball: Ball's centre on the ground [m].
        posts: Axes of the left and the right post, as seen from the field [m].
        post_radius: [m].
        obstacles: Where opponents stand [m]; those farther away than the goal block nothing.
        obstacle_radius: [m].
        ball_radius: [m].
        obstacle_reach: How far an opponent moves while the ball rolls a metre [m/m].
    """
    left_post, right_post = posts
    middle = (0.5 * (left_post[0] + right_post[0]), 0.5 * (left_post[1] + right_post[1]))
    forward = math.atan2(middle[1] - ball[1], middle[0] - ball[0])
    goal_distance = math.dist(ball, middle)

    def seen(point: Point, radius: float) -> tuple[float, float]:
        distance = max(math.dist(ball, point), 1e-6)
        direction = wrap_angle(math.atan2(point[1] - ball[1], point[0] - ball[0]) - forward)
        return direction, math.asin(min(1.0, (radius + ball_radius) / distance))

    left, left_half = seen(left_post, post_radius)
    right, right_half = seen(right_post, post_radius)
    free = [(right + right_half, left - left_half)]
    for point in obstacles:
        if math.dist(ball, point) > goal_distance + obstacle_radius:
            continue
        direction, half = seen(point, obstacle_radius + obstacle_reach * math.dist(ball, point))
        cut = []
        for low, high in free:
            cut += [(low, min(high, direction - half)), (max(low, direction + half), high)]
        free = [(low, high) for low, high in cut if high > low]
    return tuple(Gap(forward + low, forward + high) for low, high in sorted(free) if high > low)


def choose_gap(gaps: tuple[Gap, ...], previous: float | None, preference: float) -> Gap | None:
    """Return the widest gap; the one that holds the previous direction counts `preference` times its width.

    Args:
        gaps: Free gaps, may be empty.
        previous: Direction aimed at before [rad], or None.
        preference: Factor >= 1.
    """

    def worth(gap: Gap) -> float:
        held = previous is not None and abs(wrap_angle(previous - gap.middle)) <= 0.5 * gap.width
        return gap.width * (preference if held else 1.0)

    return max(gaps, key=worth, default=None)


class Aim:
    """Keeps a smooth point to send the ball to: each strategy says at every decision what it aims at.

    The point is smoothed in odom, whose short-term errors are far smaller than those of localization: a pose
    estimate that jitters would else turn the direction with it.

    Attributes:
        direction: From the ball to the point, in base_footprint [rad].
        gap: Free angle round it [rad], 0 without a free gap.
        distance: Ball to the middle of the goal, or to the point [m].
        speed: That a kicked ball shall have [m/s].
    """

    def __init__(self, parameters: StrategyParameters, field: Field) -> None:
        self._parameters = parameters
        self._field = field
        self._point_in_odom: Point | None = None  # on the goal line [m]
        self.direction = 0.0
        self.gap = 0.0
        self.distance = math.inf
        self.speed = parameters.kick_speed

    def at_point(self, world: WorldState, ball: Point, point: Point, dt: float, speed: float = math.inf) -> None:
        """Aim at a point.

        Args:
            world: Newest world state.
            ball: In base_footprint [m].
            point: In map [m].
            dt: Since the last time [s].
            speed: Of a kicked ball [m/s], brought within what kicks can do.
        """
        p = self._parameters
        relative = world.robot.pose.inverse().transform(point)
        self.distance, self.gap = math.dist(ball, relative), 0.0
        self.speed = min(p.kick_speed, max(p.kick_least_speed, speed))
        odom = world.robot.pose_in_odom
        self._point_in_odom = self._smoothed(odom.transform(relative), dt)
        self.direction = self._direction(odom, ball, self._point_in_odom)

    def at_goal(self, world: WorldState, ball: Point, opponents: Iterable[ObjectEstimate], dt: float) -> None:
        """Aim at the free part of the goal that is widest, as ball and opponents are relative to the robot now."""
        p, goal = self._parameters, self._field.opponent_goal
        self.speed = p.kick_speed
        robot, odom = world.robot.pose, world.robot.pose_in_odom
        to_robot = robot.inverse()
        left, right = (to_robot.transform((post.x, post.y)) for post in goal.posts)
        middle = to_robot.transform((goal.x, 0.0))
        self.distance = math.dist(ball, middle)
        places = [(float(seen.position[0]), float(seen.position[1])) for seen in opponents]
        in_front = [point for point in places if math.dist(ball, point) < self.distance + 0.5]
        gaps = free_gaps(
            ball,
            (left, right),
            goal.posts[0].radius,
            in_front or [middle],  # a keeper not seen yet most likely stands in the middle
            p.opponent_radius,
            self._field.ball_radius,
            p.opponent_reach,
        )
        if not gaps and in_front:
            nearest = min(in_front, key=lambda point: math.dist(ball, point))
            if math.dist(ball, nearest) < p.stuck_distance:
                self._out_of_the_way(world, ball, nearest, middle, dt)
                return
        previous = None if self._point_in_odom is None else self._direction(odom, ball, self._point_in_odom)
        gap = choose_gap(gaps, previous, self._parameters.gap_preference)
        self.gap = 0.0 if gap is None else gap.width
        across = 0.0 if gap is None else self._crossing(robot, ball, gap.middle)
        point = odom.transform(to_robot.transform((goal.x, across)))
        self._point_in_odom = self._smoothed(point, dt)
        self.direction = self._direction(odom, ball, self._point_in_odom)

    def _out_of_the_way(self, world: WorldState, ball: Point, opponent: Point, goal: Point, dt: float) -> None:
        """Aim sideways, for a short pass past an opponent at whose feet the ball lies.

        The robot then stands beside the ball, off the opponent; of both sides it is the one that takes less of a way.
        """
        p = self._parameters
        blocked = math.atan2(opponent[1] - ball[1], opponent[0] - ball[0])
        present = math.atan2(ball[1], ball[0])
        turns = [p.stuck_turn, -p.stuck_turn]
        best = blocked + min(turns, key=lambda turn: abs(wrap_angle(blocked + turn - present)))
        place = (ball[0] + p.stuck_pass * math.cos(best), ball[1] + p.stuck_pass * math.sin(best))
        self.at_point(world, ball, world.robot.pose.transform(place), dt, 0.0)
        self.distance, self.gap = math.dist(ball, goal), p.kick_gap

    def _crossing(self, robot: Pose2D, ball: Point, direction: float) -> float:
        """Return y in map [m] where a ray from the ball crosses the goal line, kept between the posts."""
        x, y = robot.transform(ball)
        along = robot.yaw + direction
        slope = math.sin(along) / max(math.cos(along), 0.05)
        half = 0.5 * self._field.goal_width - self._field.ball_radius
        return max(-half, min(half, y + slope * (self._field.opponent_goal.x - x)))

    def _smoothed(self, point: Point, dt: float) -> Point:
        old = self._point_in_odom
        if old is None or math.dist(old, point) > self._parameters.aim_jump:
            return point
        share = 1.0 - math.exp(-dt / self._parameters.aim_time)
        return old[0] + share * (point[0] - old[0]), old[1] + share * (point[1] - old[1])

    def _direction(self, odom: Pose2D, ball: Point, point_in_odom: Point) -> float:
        point = odom.inverse().transform(point_in_odom)
        return math.atan2(point[1] - ball[1], point[0] - ball[0])
