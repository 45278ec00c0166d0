"""All of one robot's components in this process, wired in the order of the data flow, for lockstep.

What takes time in the graph takes as long here: a joint command acts one tick after the sensors that it
answers, features arrive some ticks after their picture.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_mount import load_mount
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_description.quaternion import pose_on_ground
from tulip_description.robot_io import JointCommand
from tulip_motion.footsteps import Footstep
from tulip_motion.head import HeadMovement, HeadParameters
from tulip_motion.interface import HeadCommand, HeadMode, MotionState
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.camera import CameraParameters
from tulip_sim.eyes import LATENCY, Eyes, EyesBeside, EyesParameters, OwnEyes, Picture, TruthEyes
from tulip_sim.perception import PerceptionParameters
from tulip_sim.timing import CAMERA_TICKS, DECISION_TICKS, SLOW_TICKS
from tulip_sim.world import World
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.interface import Decision, GameState, UserCommand, UserRequest
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_strategy.tree_state import NodeStatus
from tulip_vision.features import Features
from tulip_vision.lens import head_camera_lens
from tulip_vision.pipeline import VisionParameters
from tulip_vision.pose_buffer import MissingPose, PoseBuffer, PoseBufferParameters
from tulip_worldmodel.world_model import WorldModel, WorldModelParameters

Listener = Callable[[str, int, object], None]
"""Is told everything that passes between components: topic name, when it passes [ns], object.

A picture alone is told late, with the time of its exposure: eyes beside this process give it back with its features.
"""


@dataclass(frozen=True)
class RobotSettings:
    """Parameters of all of a robot's components.

    With `perception` no pictures are rendered and no vision runs; features come from the truth instead, as good as it
    says. For fast tests of behaviour only; None, the default, is the camera with real vision.
    """

    camera: CameraParameters = field(default_factory=CameraParameters)
    vision: VisionParameters = field(default_factory=VisionParameters)
    worldmodel: WorldModelParameters = field(default_factory=WorldModelParameters)
    motion: MotionParameters = field(default_factory=MotionParameters)
    head: HeadParameters = field(default_factory=HeadParameters)
    strategy: StrategyParameters = field(default_factory=StrategyParameters)
    game_input: GameInputParameters = field(default_factory=GameInputParameters)
    perception: PerceptionParameters | None = None


class RobotStack:
    """One robot's components, advanced tick by tick by who owns the world."""

    def __init__(
        self,
        world: World,
        settings: RobotSettings,
        start: Pose2D,
        seed: int,
        listener: Listener | None = None,
        eyes_beside: bool = False,
        robot: int = 0,
        field: Field | None = None,
        camera_phase: int = 0,
    ) -> None:
        """Wire the cores.

        Args:
            world: Where the robot's body is.
            settings: Parameters of all cores.
            start: Where the robot is told to stand, in its own map.
            seed: Of the pictures' noise.
            listener: Told of every message that the graph would carry.
            eyes_beside: Let camera and vision work in a process of their own.
            robot: Its number in the world.
            field: As the robot's team sees it; None for the world's own.
            camera_phase: Ticks by which its pictures come later than the first robot's.
        """
        self.world, self._number, self._settings = world, robot, settings
        self._field = field or world.field
        self._tell = listener or (lambda topic, stamp, value: None)
        eyes = EyesParameters(settings.camera, settings.vision, seed)
        if settings.perception is not None:
            self._eyes: Eyes = TruthEyes(eyes, settings.perception)
        else:
            self._eyes = EyesBeside(eyes) if eyes_beside else OwnEyes(eyes)
        body = world.robot
        self._poses = PoseBuffer(PoseBufferParameters(), partial(camera_in_footprint, body, mount=load_mount()))
        self.world_model = WorldModel(settings.worldmodel, self._field, start)
        self.motion = Motion(settings.motion, body)
        self._footsteps_told: tuple[Footstep, ...] | None = None
        self.head = HeadMovement(settings.head, body)
        self.strategy = Strategy(settings.strategy, self._field)
        self.game_input = GameInput(settings.game_input)
        self.user = UserCommand(0, UserRequest.PLAY)
        self._head_command = HeadCommand(0, HeadMode.HOLD)
        self._pending: list[JointCommand] = []
        self._camera_phase = camera_phase
        self._exposed: int | None = None  # stamp of the picture worked on [ns]
        self._looking = False
        self._seen: deque[tuple[Picture | None, Features]] = deque()  # not used before their time
        self._tick = 0
        self._told_tree: tuple[NodeStatus, ...] = ()
        self.doing = ""
        """Active path of the behaviour tree."""
        self._tell("user_command", 0, self.user)
        if settings.perception is None:
            self._tell("camera/camera_info", 0, head_camera_lens())
        self.refused: list[str] = []
        """Reasons of joint commands and kicks that were refused."""

    def tick(self) -> None:
        """Sense, see, decide, and give the commands that answer the tick before; the world has still to advance."""
        tick, tell, now = self._tick, self._tell, self.world.stamp
        sensors = self.world.sensors(self._number)
        for command in self._pending:
            reason = self.world.apply(command, self._number)
            if reason:
                self.refused.append(reason)
        self._pending = [self.motion.tick(sensors)]
        tell("sensors", now, sensors)
        tell("legs/joint_command", now, self._pending[0])
        if tick % SLOW_TICKS == 0:
            self._slow(sensors.stamp, sensors.joint_positions[12:])
        if tick >= self._camera_phase:
            self._see((tick - self._camera_phase) % CAMERA_TICKS)
        if tick % DECISION_TICKS == 0:
            self._decide(sensors.stamp)
        self._tick += 1

    def hear_referee(self, packet: bytes, stamp: int) -> None:
        """Take a packet of the referee at a stamp [ns]."""
        self.game_input.receive(packet, stamp)
        game = self.game_input.state(stamp)
        if game is not None:
            self._tell("game_state", stamp, game)

    def ask(self, request: UserRequest, strategy: str | None = None) -> None:
        """Take a wish of the user, as through node user_input; None keeps the strategy."""
        before = self.user
        wanted = before.strategy if strategy is None else strategy
        self.user = UserCommand(self.world.stamp, request, wanted, sequence=before.sequence + 1)
        self._tell("user_command", self.user.stamp, self.user)

    def told_to_stand_at(self, pose: Pose2D) -> None:
        """Forget where robot, ball and opponents are: the robot was put down at a pose in its own map."""
        # In the graph the pose comes as a quaternion, which rounds the heading in its last digit.
        half = pose.yaw / 2.0
        told = pose_on_ground((pose.x, pose.y), (0.0, 0.0, math.sin(half), math.cos(half)))
        self.world_model = WorldModel(self._settings.worldmodel, self._field, told)
        self._tell("initialpose", self.world.stamp, pose)

    def close(self) -> None:
        """End the process of the eyes, if there is one."""
        self._eyes.close()

    def _slow(self, stamp: int, head_positions: NDArray[np.float64]) -> None:
        """Do what comes at 50 Hz: odometry to the world model and to the camera's pose, and the head."""
        odometry = self.motion.odometry()
        self.world_model.add_odometry(odometry)
        self._poses.add_body(stamp, float(odometry.position[2]), odometry.orientation)
        self._poses.add_head(stamp, float(head_positions[0]), float(head_positions[1]))
        command = self.head.update(stamp, self._head_command, head_positions)
        self._pending.append(command)
        now = self.world.stamp
        self._tell("odometry", now, odometry)
        state, footsteps = self.motion.state(), self.motion.footsteps
        self._tell("motion_state", now, (state, odometry.distance))
        if footsteps != self._footsteps_told:
            self._footsteps_told = footsteps
            self._tell("footsteps", now, (footsteps, state.stamp))
        self._tell("head/joint_command", now, command)
        self._tell_truth(now)

    def _tell_truth(self, stamp: int) -> None:
        """Tell the listener what really is. For who judges."""

    def _see(self, tick: int) -> None:
        """Take a picture, look at it as soon as its camera pose is known, and use what was seen when it is due."""
        now = self.world.stamp
        if tick == 0 and self.world.robots[self._number].faults.sees(now):
            self._exposed, self._looking = now, False
            self._eyes.expose(self.world.truth(self._number))
        if self._exposed is not None and not self._looking:
            pose = self._poses.camera_in_footprint(self._exposed)
            if not isinstance(pose, MissingPose):
                if pose[2, 3] > 0.0:
                    self._eyes.look(self._exposed, pose)
                    self._looking = True
                else:
                    self._exposed = None  # a fallen robot's belief puts the camera below the ground: nothing to see
        # Vision beside this process has until then to work.
        if self._exposed is not None and self._looking and now - self._exposed >= min(LATENCY, self._eyes.latency):
            self._seen.append(self._eyes.collect())
            self._exposed = None
        while self._seen and now - self._seen[0][1].stamp >= self._eyes.latency:
            picture, features = self._seen.popleft()
            self.world_model.add_features(features)
            if picture is not None:
                self._tell("camera/image_raw", features.stamp, picture)
            self._tell("features", now, features)

    def _decide(self, stamp: int) -> None:
        """Let strategy see the world and command the legs and the head."""
        world = self.world_model.state(stamp)
        game: GameState | None = self.game_input.state(stamp)
        state: MotionState = self.motion.state()
        decision: Decision = self.strategy.decide(stamp, world, game, self.user, state)
        self.doing = decision.tree
        self.motion.command(decision.walk)
        self._head_command = decision.head
        if decision.kick is not None:
            reason = self.motion.start_kick(decision.kick)
            if reason:
                self.refused.append(f"kick: {reason}")
        now = self.world.stamp
        self._tell("world_state", now, world)
        self._tell("walk_command", now, decision.walk)
        self._tell("head_command", now, decision.head)
        self._tell("decision", now, decision)
        if self.strategy.tree.statuses != self._told_tree:
            self._told_tree = self.strategy.tree.statuses
            self._tell("behaviour_tree", now, self.strategy.tree)
