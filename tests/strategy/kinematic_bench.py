"""A fake world for strategy: no dynamics, but a ball that strays, legs that lag and senses that err."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from tulip_description.field import Field, load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.interface import KickGoal, MotionMode, MotionState, Side, Support, WalkCommand, WalkMode
from tulip_motion.parameters import MotionParameters
from tulip_strategy.interface import (
    Decision,
    GamePhase,
    GameState,
    Penalty,
    SecondaryState,
    UserCommand,
    UserRequest,
)
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_worldmodel.world_state import ObjectEstimate, RobotEstimate, WorldState

STEP = 1.0 / 60.0  # [s] of the fake physics
STEPS_PER_DECISION = 4  # 15 Hz, as the camera
LAG = 0.3  # [s] of the legs behind the command
KICK_LATERAL = 0.5 * MotionParameters().stance_width  # [m] of the kicking foot
FEET_FRONT, FEET_BACK, FEET_SIDE = 0.217, 0.007, KICK_LATERAL + 0.075  # [m] box of both feet in base_footprint
KEEPER_RADIUS = 0.25  # [m]
ROLLING_DECELERATION = 0.3  # [m/s^2]
KICK_DURATION, KICK_IMPACT = 2.5, 1.3  # [s] after its start
BALL_SIGHT = 6.0  # [m]
SIGHT_ANGLE = 1.9  # [rad] pan of the head and half the picture


def motion_state(stamp: int, mode: MotionMode, reason: str = "") -> MotionState:
    """Return a motion state in which only stamp, mode and reason mean something."""
    two, three, twelve = np.zeros(2), np.zeros(3), np.zeros(12)
    return MotionState(
        stamp=stamp,
        mode=mode,
        support=Support.DOUBLE,
        phase=0.0,
        step_count=0,
        com=three,
        com_desired=three,
        com_velocity=three,
        com_velocity_desired=three,
        dcm=two,
        dcm_desired=two,
        zmp=two,
        zmp_desired=two,
        soles=np.zeros((2, 4, 4)),
        joint_positions=twelve,
        joint_positions_desired=twelve,
        joint_velocities=twelve,
        joint_velocities_desired=twelve,
        torque_feedback=twelve,
        torque_feedforward=twelve,
        reason=reason,
    )


def game_state(stamp: int, phase: GamePhase = GamePhase.PLAYING, penalty: int = 0) -> GameState:
    """Return the game of a penalty-shoot-like trial."""
    return GameState(stamp, 7, phase, True, True, SecondaryState.PENALTY_SHOOT, 150, 0, 0, Penalty(penalty), 0)


def seen_object(
    pose: Pose2D, position: tuple[float, float], velocity: tuple[float, float], age: float = 0.0
) -> ObjectEstimate:
    """Return an estimate of an object whose place and velocity in map are given."""
    relative = np.array(pose.inverse().transform(position))
    rotation = pose.rotation().T
    return ObjectEstimate(
        relative, rotation @ np.array(velocity), np.eye(4) * 1e-3, np.array(position), np.array(velocity), age, 1.0
    )


@dataclass
class Wander:
    """Noise that drifts: standard deviation `spread`, correlated over `time` [s]."""

    spread: float
    time: float
    value: float = 0.0

    def step(self, rng: np.random.Generator, dt: float) -> float:
        keep = math.exp(-dt / self.time)
        self.value = keep * self.value + self.spread * math.sqrt(1.0 - keep**2) * float(rng.normal())
        return self.value


@dataclass(frozen=True)
class Legs:
    """How badly the legs follow."""

    gain: tuple[float, float] = (1.0, 1.0)  # range of realised over commanded velocity
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)  # largest constant error while walking [m/s, m/s, rad/s]
    swing: float = 0.0  # [m] the feet swing ahead and back by this
    stray: float = 0.15  # random sideways part of a touch
    pose_error: float = 1.0  # times the usual error of localization


PERFECT_LEGS = Legs()
BAD_LEGS = Legs(gain=(0.75, 1.05), drift=(0.03, 0.03, 0.1), swing=0.08, stray=0.5, pose_error=2.0)


@dataclass
class Outcome:
    """How a trial ended."""

    result: str
    seconds: float
    kicks: int
    touches: int
    early_touches: int
    path: list[str] = field(default_factory=list)


class KinematicTrial:
    """One trial of dribble and kick with a standing keeper."""

    def __init__(self, seed: int, legs: Legs = PERFECT_LEGS, parameters: StrategyParameters | None = None) -> None:
        self.legs = legs
        self.rng = np.random.default_rng(seed)
        self.field: Field = load_field()
        rng = self.rng
        self.robot = Pose2D(
            float(rng.uniform(-4.0, -0.3)), float(rng.uniform(-2.4, 2.4)), float(rng.uniform(-1, 1) * math.pi / 4)
        )
        self.ball = self._ball_place()
        self.ball_velocity = np.zeros(2)
        self.keeper = (self.field.length / 2.0 - 0.15, float(rng.choice((-1, 1)) * rng.uniform(0.2, 0.7)))
        self.velocity = np.zeros(3)
        self.mode = MotionMode.STAND
        self.stamp = 0
        self.kick: KickGoal | None = None
        self.kick_begun = 0
        self.still_since = 0
        self.kicks = self.touches = self.early_touches = 0
        self.gain = rng.uniform(*legs.gain, size=3)
        self.drift = rng.uniform(-1.0, 1.0, size=3) * np.array(legs.drift)
        self._touching = False
        self.ball_seen = -(10**12)
        self.last_seen_ball = (0.0, 0.0)
        self.blind_until = 0
        error = legs.pose_error
        self.pose_noise = (Wander(0.05 * error, 2.0), Wander(0.05 * error, 2.0), Wander(0.03 * error, 2.0))
        self.ball_noise = (Wander(0.03, 0.3), Wander(0.03, 0.3))
        self.keeper_noise = (Wander(0.06, 1.0), Wander(0.06, 1.0))
        self.strategy = Strategy(parameters or StrategyParameters(), self.field)
        self.decision: Decision | None = None

    def _ball_place(self) -> np.ndarray:
        """0.5 to 3 m away in any direction, on the field."""
        while True:
            distance, angle = self.rng.uniform(0.5, 3.0), self.rng.uniform(-math.pi, math.pi)
            x, y = self.robot.x + distance * math.cos(angle), self.robot.y + distance * math.sin(angle)
            if abs(x) < self.field.length / 2.0 - 0.3 and abs(y) < self.field.width / 2.0 - 0.3:
                return np.array([x, y])

    def world_state(self) -> WorldState:
        """What a world model with errors would say."""
        dt = STEP * STEPS_PER_DECISION
        ex, ey, eyaw = (noise.step(self.rng, dt) for noise in self.pose_noise)
        pose = Pose2D(self.robot.x + ex, self.robot.y + ey, wrap_angle(self.robot.yaw + eyaw))
        relative = np.array(self.robot.inverse().transform(self.ball))
        bearing = math.atan2(relative[1], relative[0])
        if self.rng.random() < 0.002:
            self.blind_until = self.stamp + 1_500_000_000
        if abs(bearing) < SIGHT_ANGLE and np.hypot(*relative) < BALL_SIGHT and self.stamp >= self.blind_until:
            self.ball_seen = self.stamp
            self.last_seen_ball = (float(self.ball[0]), float(self.ball[1]))
        age = (self.stamp - self.ball_seen) * 1e-9
        ball = None
        if age < 10.0:
            believed = np.array(self.robot.inverse().transform(self.last_seen_ball))
            believed = believed + [noise.step(self.rng, dt) for noise in self.ball_noise]
            velocity = self.ball_velocity if age == 0.0 else np.zeros(2)
            ball = seen_object(pose, pose.transform(believed), tuple(velocity), age)
        keeper = tuple(
            place + noise.step(self.rng, dt) for place, noise in zip(self.keeper, self.keeper_noise, strict=True)
        )
        opponents = ()
        if math.dist(keeper, (self.robot.x, self.robot.y)) < 6.0:
            opponents = (seen_object(self.robot, keeper, (0.0, 0.0)),)
        odom = Pose2D(3.0, -2.0, 1.0) @ self.robot  # another origin: strategy must not mix the frames
        return WorldState(self.stamp, RobotEstimate(pose, np.eye(3) * 0.01, odom), ball, opponents)

    def run(self, seconds: float = 150.0) -> Outcome:
        """Play until a goal, a ball out or the end of the time."""
        path: list[str] = []
        while self.stamp * 1e-9 < seconds:
            self.decision = self.strategy.decide(
                self.stamp,
                self.world_state(),
                game_state(self.stamp),
                UserCommand(0, UserRequest.PLAY),
                motion_state(self.stamp, self.mode),
            )
            if not path or path[-1] != self.decision.tree:
                path.append(self.decision.tree)
            if self.decision.kick is not None and self.kick is None:
                self.kick, self.kick_begun = self.decision.kick, self.stamp
                self.kicks += 1
            for _ in range(STEPS_PER_DECISION):
                self._step(self.decision.walk)
                result = self._result()
                if result:
                    return Outcome(result, self.stamp * 1e-9, self.kicks, self.touches, self.early_touches, path)
        return Outcome("time", seconds, self.kicks, self.touches, self.early_touches, path)

    def _step(self, command: WalkCommand) -> None:
        self.stamp += round(STEP * 1e9)
        walks = command.mode is WalkMode.WALK and self.kick is None
        wanted = np.array(command.velocity) * self.gain + self.drift if walks else np.zeros(3)
        self.velocity += (wanted - self.velocity) * (STEP / LAG)
        if walks:
            self.still_since = self.stamp
        dx, dy, dyaw = self.velocity * STEP
        self.robot = self.robot @ Pose2D(dx, dy, dyaw)
        standing = (self.stamp - self.still_since) * 1e-9 > 0.8
        self.mode = MotionMode.STAND if standing else MotionMode.WALK
        self._kick()
        self._roll()
        self._touch()

    def _kick(self) -> None:
        if self.kick is None:
            return
        self.mode = MotionMode.KICK
        before = (self.stamp - self.kick_begun) * 1e-9
        if KICK_IMPACT - STEP < before <= KICK_IMPACT:
            x, y = self.robot.inverse().transform(self.ball)
            offset = y - (KICK_LATERAL if self.kick.side is Side.LEFT else -KICK_LATERAL)
            if 0.28 < x < 0.42 and abs(offset) < 0.08:
                direction = self.robot.yaw + self.kick.direction + 1.5 * offset + self.rng.normal(0.0, 0.05)
                self.ball_velocity = 2.5 * np.array([math.cos(direction), math.sin(direction)])
        if before > KICK_DURATION:
            self.kick = None

    def _roll(self) -> None:
        speed = float(np.hypot(*self.ball_velocity))
        if speed > 0.0:
            self.ball_velocity *= max(0.0, speed - ROLLING_DECELERATION * STEP) / speed
        self.ball = self.ball + self.ball_velocity * STEP
        for place, radius in [(self.keeper, KEEPER_RADIUS)] + [
            ((post.x, post.y), post.radius) for post in self.field.opponent_goal.posts
        ]:
            away = self.ball - np.array(place)
            distance = float(np.hypot(*away))
            if distance < radius + self.field.ball_radius:
                normal = away / distance
                self.ball = np.array(place) + normal * (radius + self.field.ball_radius)
                into = float(self.ball_velocity @ normal)
                if into < 0.0:
                    self.ball_velocity -= 1.3 * into * normal

    def _touch(self) -> None:
        x, y = self.robot.inverse().transform(self.ball)
        swing = self.legs.swing * math.sin(7.0 * self.stamp * 1e-9) if self.mode is MotionMode.WALK else 0.0
        nearest = np.array([min(FEET_FRONT + swing, max(FEET_BACK, x)), min(FEET_SIDE, max(-FEET_SIDE, y))])
        away = np.array([x, y]) - nearest
        distance = float(np.hypot(*away))
        touching = distance < self.field.ball_radius
        if touching:
            normal = away / distance if distance > 0.0 else np.array([1.0, 0.0])
            turn = self.velocity[2]
            foot = np.array([self.velocity[0] - turn * y, self.velocity[1] + turn * x])
            rotation = self.robot.rotation()
            ball_velocity = rotation.T @ self.ball_velocity
            closing = float(foot @ normal - ball_velocity @ normal)
            if closing > 0.0:
                # The swinging foot hits faster than the body walks; off-centre it drives the ball sideways.
                sideways = np.array([-normal[1], normal[0]])
                stray = 0.8 * float(nearest @ sideways) / FEET_SIDE + self.rng.normal(0.0, self.legs.stray)
                ball_velocity += 1.6 * closing * (normal + stray * sideways)
                self.ball_velocity = rotation @ ball_velocity
            self.ball = np.array(self.robot.transform(nearest + normal * self.field.ball_radius))
        if touching and not self._touching:
            self.touches += 1
            if self.decision is not None and self.decision.tree.endswith("come round behind the ball"):
                self.early_touches += 1
        self._touching = touching

    def _result(self) -> str:
        radius, goal = self.field.ball_radius, self.field.opponent_goal
        x, y = self.ball
        if x > goal.x + radius and abs(y) < goal.width / 2.0:
            return "goal"
        if abs(x) > self.field.length / 2.0 + radius or abs(y) > self.field.width / 2.0 + radius:
            return "out"
        return ""
