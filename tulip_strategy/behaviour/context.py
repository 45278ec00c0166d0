"""What all behaviours share during one decision: inputs, what follows from them, and the wish so far."""

from __future__ import annotations

import math

from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.gaze import GazePlanner
from tulip_motion.interface import HeadMode, KickGoal, MotionState, WalkMode
from tulip_strategy.behaviour.aim import choose_gap, free_gaps
from tulip_strategy.behaviour.steering import STILL, Velocity
from tulip_strategy.interface import GameState, UserCommand, UserRequest
from tulip_strategy.parameters import StrategyParameters
from tulip_worldmodel.world_state import WorldState

Point = tuple[float, float]
Point3 = tuple[float, float, float]


class BallMemory:
    """Knows the ball's place, also for a while after it was lost.

    Attributes:
        known: The ball is where `position` says.
        position: Last known place in base_footprint [m], carried along by dead reckoning; None before the first.
        velocity: Over the ground, in base_footprint axes [m/s].
    """

    def __init__(self, parameters: StrategyParameters) -> None:
        self._parameters = parameters
        self._place_in_odom: Point | None = None
        self._good_stamp = 0  # [ns]
        self.known = False
        self.position: Point | None = None
        self.velocity: Point = (0.0, 0.0)

    def update(self, world: WorldState) -> None:
        """Take the newest world state."""
        ball = world.ball
        odom = world.robot.pose_in_odom
        oldest = self._parameters.ball_lost_age if self.known else self._parameters.ball_found_age
        good = ball is not None and ball.age <= oldest and ball.confidence >= self._parameters.ball_confidence
        if good:
            self._good_stamp = world.stamp
        # An estimate may drop out for a moment and come again; the place is remembered meanwhile.
        dropped_out = ball is None or ball.age <= oldest
        just_now = (world.stamp - self._good_stamp) * 1e-9 <= self._parameters.ball_gone_time
        self.known = good or (self.known and dropped_out and just_now)
        if ball is not None and good:
            self._place_in_odom = odom.transform(ball.position)
            self.velocity = (float(ball.velocity[0]), float(ball.velocity[1]))
        else:
            self.velocity = (0.0, 0.0)
        self.position = None if self._place_in_odom is None else odom.inverse().transform(self._place_in_odom)


class Aim:
    """Keeps a smooth point to send the ball to.

    The point is smoothed in odom, whose short-term errors are far smaller than those of localization: a pose
    estimate that jitters would else turn the direction with it.

    Attributes:
        direction: From the ball to the point, in base_footprint [rad].
        gap: Free angle round it [rad], 0 without a free gap.
        goal_distance: Ball to the middle of the goal [m].
    """

    def __init__(self, parameters: StrategyParameters, field: Field) -> None:
        self._parameters = parameters
        self._field = field
        self._point_in_odom: Point | None = None  # on the goal line [m]
        self.direction = 0.0
        self.gap = 0.0
        self.goal_distance = math.inf

    def update(self, world: WorldState, ball: Point, dt: float) -> None:
        """Choose the gap from where ball and opponents are, relative to the robot, `dt` [s] after the last time."""
        goal = self._field.opponent_goal
        robot, odom = world.robot.pose, world.robot.pose_in_odom
        to_robot = robot.inverse()
        left, right = (to_robot.transform((post.x, post.y)) for post in goal.posts)
        middle = to_robot.transform((goal.x, 0.0))
        self.goal_distance = math.dist(ball, middle)
        opponents = [(float(seen.position[0]), float(seen.position[1])) for seen in world.opponents]
        in_front = [point for point in opponents if math.dist(ball, point) < self.goal_distance + 0.5]
        gaps = free_gaps(
            ball,
            (left, right),
            goal.posts[0].radius,
            in_front or [middle],  # a keeper not seen yet most likely stands in the middle
            self._parameters.opponent_radius,
            self._field.ball_radius,
        )
        previous = None if self._point_in_odom is None else self._direction(odom, ball, self._point_in_odom)
        gap = choose_gap(gaps, previous, self._parameters.gap_preference)
        self.gap = 0.0 if gap is None else gap.width
        across = 0.0 if gap is None else self._crossing(robot, ball, gap.middle)
        point = odom.transform(to_robot.transform((goal.x, across)))
        self._point_in_odom = self._smoothed(point, dt)
        self.direction = self._direction(odom, ball, self._point_in_odom)

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


class Context:
    """The state of one decision; behaviours read the inputs and write the wish.

    Attributes:
        stamp: Of the newest input [ns].
        dt: Since the last decision [s].
        world, game, user, motion: Inputs.
        ball, aim: What follows from them.
        gaze: Shares the gaze between ball and landmarks.
        kick_sent: When the running kick was asked for [ns], None without one.
        kick_seen: Whether motion control has reported it.
        mode, velocity, head, target, glance, kick: The wish, see `Decision`.
    """

    def __init__(self, parameters: StrategyParameters, field: Field) -> None:
        self.parameters = parameters
        self.field = field
        self.stamp = 0
        self.dt = 0.0
        self.world: WorldState | None = None
        self.game: GameState | None = None
        self.user = UserCommand(0, UserRequest.STOP)
        self.motion: MotionState | None = None
        self.ball = BallMemory(parameters)
        self.aim = Aim(parameters, field)
        self.gaze = GazePlanner(parameters, field, load_robot())
        self.kick_sent: int | None = None
        self.kick_seen = False
        self.clear_wish()

    def clear_wish(self) -> None:
        """Forget the last wish: stand and hold the head."""
        self.mode = WalkMode.STAND
        self.velocity: Velocity = STILL
        self.head = HeadMode.HOLD
        self.target: Point3 = (1.0, 0.0, 0.0)
        self.glance: Point3 | None = None
        self.kick: KickGoal | None = None

    def seconds_since(self, stamp: int) -> float:
        """Return the time from a stamp [ns] to now [s]."""
        return (self.stamp - stamp) * 1e-9

    def walk(self, velocity: Velocity) -> None:
        """Wish to walk with a velocity in base_footprint."""
        self.mode, self.velocity = WalkMode.WALK, velocity

    def stand(self) -> None:
        """Wish to stand."""
        self.mode, self.velocity = WalkMode.STAND, STILL
