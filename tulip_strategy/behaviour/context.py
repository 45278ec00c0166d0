"""What all behaviours share during one decision: inputs, what follows from them, and the wish so far."""

from __future__ import annotations

from tulip_description.field import Field, GoalPost, Pole
from tulip_description.robot import load_robot
from tulip_motion.gaze import GazePlanner
from tulip_motion.interface import HeadMode, KickGoal, MotionState, WalkMode
from tulip_strategy.behaviour.aim import Aim
from tulip_strategy.behaviour.keep_off import Obstacle
from tulip_strategy.behaviour.keeper_glance import KeeperGlance
from tulip_strategy.behaviour.steering import STILL, Velocity
from tulip_strategy.interface import GameState, UserCommand, UserRequest
from tulip_strategy.parameters import StrategyParameters
from tulip_worldmodel.world_state import ObjectEstimate, WorldState

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


class Context:
    """The state of one decision; behaviours read the inputs and write the wish.

    Attributes:
        stamp: Of the newest input [ns].
        dt: Since the last decision [s].
        world, game, user, motion: Inputs.
        ball, aim: What follows from them.
        opponents: Those that stand on the carpet; others are none.
        gaze: Shares the gaze between ball and landmarks.
        keeper_glance: Looks at the other goal's keeper now and then.
        kick_sent: When the running kick was asked for [ns], None without one.
        kick_seen: Whether motion control has reported it.
        kicks: How many kicks have ended since play began.
        mode, velocity, head, target, glance, kick: The wish, see `Decision`.
        sudden: Whether the velocity counts at once, as a shot demands, and not within the limits of acceleration.
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
        self.opponents: tuple[ObjectEstimate, ...] = ()
        self.gaze = GazePlanner(parameters, field, load_robot())
        self.keeper_glance = KeeperGlance(parameters, field)
        self.kick_sent: int | None = None
        self.kick_seen = False
        self.kicks = 0
        self.clear_wish()

    def see(self, world: WorldState | None) -> None:
        """Take the newest world state."""
        self.world = world
        if world is None:
            return
        self.ball.update(world)
        reach = 0.5 * self.field.carpet_length, 0.5 * self.field.carpet_width
        self.opponents = tuple(
            each
            for each in world.opponents
            if all(abs(at) < most for at, most in zip(each.position_in_map, reach, strict=True))
        )

    @property
    def bodies(self) -> list[Point]:
        """Where opponents stand, in base_footprint [m]."""
        return [(float(each.position[0]), float(each.position[1])) for each in self.opponents]

    @property
    def obstacles(self) -> list[Obstacle]:
        """What the robot could walk into: opponents as they are seen, goal posts and poles as the map has them."""
        p = self.parameters
        found = [Obstacle(each, p.keep_off, p.opponent_clearance) for each in self.bodies]
        if self.world is not None:
            to_footprint = self.world.robot.pose.inverse()
            uprights: tuple[GoalPost | Pole, ...] = (*self.field.goal_posts, *self.field.poles)
            places = (to_footprint.transform((each.x, each.y)) for each in uprights)
            found += [Obstacle(place, p.keep_off_upright, p.upright_clearance) for place in places]
        return found

    def clear_wish(self) -> None:
        """Forget the last wish: stand and hold the head."""
        self.mode = WalkMode.STAND
        self.velocity: Velocity = STILL
        self.sudden = False
        self.head = HeadMode.HOLD
        self.target: Point3 = (1.0, 0.0, 0.0)
        self.glance: Point3 | None = None
        self.kick: KickGoal | None = None

    def seconds_since(self, stamp: int) -> float:
        """Return the time from a stamp [ns] to now [s]."""
        return (self.stamp - stamp) * 1e-9

    def walk(self, velocity: Velocity, sudden: bool = False) -> None:
        """Wish to walk with a velocity in base_footprint, at once if it is sudden."""
        self.mode, self.velocity, self.sudden = WalkMode.WALK, velocity, sudden

    def stand(self) -> None:
        """Wish to stand."""
        self.mode, self.velocity = WalkMode.STAND, STILL
