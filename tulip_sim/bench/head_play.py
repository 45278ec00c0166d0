"""A robot that looks while it is moved about by a script: world model and head movement as they play, fake legs.

The body slides over the field without dynamics, exactly as told; dead reckoning errs. What vision would find comes from
the truth (tulip_sim.perception), seen by a camera whose believed pose errs as much as vision says. Timing is that of
lockstep.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import Field, load_field
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.head import HeadMovement, HeadParameters
from tulip_motion.interface import HeadCommand, HeadMode, Odometry
from tulip_sim.bench.camera_sway import CameraSway
from tulip_sim.perception import Perception, PerceptionParameters
from tulip_sim.timing import CAMERA_TICKS, DECISION_TICKS, FEATURE_DELAY_TICKS, SLOW_TICKS, TICK
from tulip_sim.truth import Truth
from tulip_vision.features import FeatureClass, Features
from tulip_vision.lens import head_camera_lens
from tulip_vision.view import SpreadParameters
from tulip_worldmodel.world_model import WorldModel, WorldModelParameters
from tulip_worldmodel.world_state import WorldState

Array = NDArray[np.float64]
Velocity = tuple[float, float, float]
DECELERATION = 0.3  # [m/s^2] of the rolling ball
SECONDS = TICK * 1e-3  # [s] of a tick
UPRIGHT = (0.0, 0.0, 0.0, 1.0)


class HeadPlay:
    """Advances robot, ball, head and world model together.

    Attributes:
        pose: base_footprint in map, truly.
        ball, ball_velocity: (2,) in map, truly [m], [m/s].
        head: (2,) pan and tilt [rad].
        stamp: [ns].
        state: What the world model says; new at each decision.
        opponents: Where they stand, in map; the first hides what is behind it, the others hide nothing.
        opponents_in_picture: Which of them the last picture showed, found or not.
        ball_in_picture: Whether the last picture showed the ball, found or not.
    """

    def __init__(self, seed: int, pose: Pose2D, ball: tuple[float, float], believed: Pose2D | None = None) -> None:
        """Begin.

        Args:
            seed: Of all that is random.
            pose: base_footprint in map.
            ball: In map [m].
            believed: Where the robot is told that it stands; None for the truth.
        """
        self.field: Field = load_field()
        robot = self._robot = load_robot()
        self._posture = standing_posture(robot)
        self._rng = np.random.default_rng([seed, 4])
        self._perception = Perception(PerceptionParameters(), self.field, robot, head_camera_lens())
        self._sway = CameraSway(SpreadParameters(), self._rng)
        self._head_movement = HeadMovement(HeadParameters(), robot)
        self._world_model = WorldModel(WorldModelParameters(), self.field, believed or pose)
        self.pose, self._odom, self._distance = pose, Pose2D(), 0.0
        self._scale = 1.0 + 0.04 * float(self._rng.normal())  # feet slip, always about the same
        self._turn_scale = 1.0 + 0.03 * float(self._rng.normal())
        self._gyro_drift = math.radians(0.3) * float(self._rng.normal())  # [rad/s]
        self.ball, self.ball_velocity = np.array(ball), np.zeros(2)
        self.head, self._head_velocity = np.zeros(2), np.zeros(2)
        self._commanded: tuple[Array, Array] | None = None
        self._command = HeadCommand(0, HeadMode.HOLD)
        self._waiting: Features | None = None
        self._tick = 0
        self.stamp = 0
        self.pictures = 0
        self.ball_in_picture = False
        self.opponents: list[Pose2D] = []
        self.opponents_in_picture: list[bool] = []
        self.state: WorldState | None = None

    def go(self, seconds: float, decide: Callable[[HeadPlay], tuple[HeadCommand, Velocity]]) -> None:
        """Advance.

        Args:
            seconds: For how long [s].
            decide: Asked after each world state: what the head shall do, and the body's velocity [m/s, m/s, rad/s].
        """
        velocity: Velocity = (0.0, 0.0, 0.0)
        for _ in range(round(seconds / SECONDS)):
            tick = self._tick
            if tick % SLOW_TICKS == 0:
                self._odometry(velocity)
                if self._commanded is not None:  # the command before acts from now on: one tick of the head late
                    self.head, self._head_velocity = self._commanded
                answer = self._head_movement.update(self.stamp, self._command, self.head)
                self._commanded = answer.position, answer.velocity
            if tick % CAMERA_TICKS == 0:
                self._expose()
            if tick % CAMERA_TICKS == FEATURE_DELAY_TICKS and self._waiting is not None:
                self._world_model.add_features(self._waiting)
                self._waiting = None
            if tick % DECISION_TICKS == 0:
                self.state = self._world_model.state(self.stamp)
                self._command, velocity = decide(self)
            self._move(velocity)
            self._tick += 1
            self.stamp = self._tick * TICK * 1_000_000

    def ball_in_footprint(self) -> Array:
        """Return (3,) the ball's centre in base_footprint [m], truly."""
        x, y = self.pose.inverse().transform((float(self.ball[0]), float(self.ball[1])))
        return np.array([x, y, self.field.ball_radius])

    def _expose(self) -> None:
        since = (self._tick % SLOW_TICKS) * SECONDS
        head = self.head + self._head_velocity * since
        truth = self._truth(head)
        glimpses = self._perception.in_view(truth)
        of_first = any(each.kind is FeatureClass.OPPONENT for each in glimpses)
        self.opponents_in_picture = [of_first][: len(self.opponents)]
        for other in self.opponents[1:]:
            alone = self._perception.in_view(replace(truth, keeper=other))
            shown = tuple(each for each in alone if each.kind is FeatureClass.OPPONENT)
            self.opponents_in_picture.append(bool(shown))
            glimpses += shown
        self.ball_in_picture = any(each.kind is FeatureClass.BALL for each in glimpses)
        noticed = self._perception.noticed(glimpses, truth, self._rng)
        believed = self._sway.of(self.camera(head), CAMERA_TICKS * SECONDS)
        self._waiting = self._perception.features(noticed, self.stamp, believed, self._rng)
        self.pictures += 1

    def camera(self, head: Array) -> Array:
        """Return the (4, 4) camera_optical_frame in base_footprint of the upright robot, given pan and tilt [rad]."""
        return camera_in_footprint(self._robot, self._posture.base_height, UPRIGHT, float(head[0]), float(head[1]))

    def _truth(self, head: Array) -> Truth:
        """Return the world as it is, with the robot in its standing posture."""
        joints, velocities = self._posture.joint_positions.copy(), np.zeros(len(self._posture.joint_positions))
        joints[-2:], velocities[-2:] = head, self._head_velocity
        still, half = np.zeros(3), self.pose.yaw / 2.0
        return Truth(
            stamp=self.stamp,
            base_position=np.array([self.pose.x, self.pose.y, self._posture.base_height]),
            base_orientation=np.array([0.0, 0.0, math.sin(half), math.cos(half)]),
            base_linear_velocity=still,
            base_angular_velocity=still,
            joint_positions=joints,
            joint_velocities=velocities,
            ball_position=np.array([*self.ball, self.field.ball_radius]),
            ball_orientation=np.array(UPRIGHT),
            ball_linear_velocity=np.array([*self.ball_velocity, 0.0]),
            ball_angular_velocity=still,
            keeper=self.opponents[0] if self.opponents else None,
            keeper_path=(),
            foot_touches=(0, 0),
            body_touches=0,
            keeper_touches=0,
            poles=True,
        )

    def _odometry(self, velocity: Velocity) -> None:
        forward, left, turn = velocity
        half = self._odom.yaw / 2.0
        self._world_model.add_odometry(
            Odometry(
                self.stamp,
                np.array([self._odom.x, self._odom.y, 0.9]),
                np.array([0.0, 0.0, math.sin(half), math.cos(half)]),
                np.array([forward, left, 0.0]),
                np.array([0.0, 0.0, turn]),
                self._distance,
            )
        )

    def _move(self, velocity: Velocity) -> None:
        forward, left, turn = (each * SECONDS for each in velocity)
        self.pose = self.pose @ Pose2D(forward, left, turn)
        walking = forward != 0.0 or left != 0.0 or turn != 0.0
        drift = self._gyro_drift * SECONDS if walking else 0.0
        self._odom = self._odom @ Pose2D(forward * self._scale, left * self._scale, turn * self._turn_scale + drift)
        self._distance += math.hypot(forward, left)
        speed = float(np.hypot(*self.ball_velocity))
        if speed > 0.0:
            self.ball = self.ball + self.ball_velocity * SECONDS
            self.ball_velocity = self.ball_velocity * max(0.0, 1.0 - DECELERATION * SECONDS / speed)
