"""Pictures of random scenes by a robot that stands or walks, each with what the robot itself knew and with the truth.

The robot walks in the physics, far from everything; for each picture it is then moved to a random place on the field,
with ball, an opponent and poles. Every other opponent is a still figure, the rest are robots that do just what this one
does. Camera poses come the way that they come in a match: joints, IMU and motion control's odometry through the pose
buffer. The world is rendered for every millisecond of the exposure.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_mount import load_mount
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import Field, load_field
from tulip_description.planar import Pose2D
from tulip_description.quaternion import quaternion_product
from tulip_description.robot import Robot, load_robot
from tulip_description.robot_io import JointCommand
from tulip_motion.head import HeadMovement, HeadParameters
from tulip_motion.interface import HeadCommand, HeadMode, MotionMode, WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench.random_walk import random_commands
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.timing import SLOW_TICKS, TICK
from tulip_sim.truth import OtherRobot, Truth
from tulip_sim.world import World
from tulip_vision.lens import head_camera_lens
from tulip_vision.opponents import OpponentParameters
from tulip_vision.own_body import OwnBody
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.pose_buffer import MissingPose, PoseBuffer, PoseBufferParameters

Array = NDArray[np.float64]

AWAY = Pose2D(-40.0, 0.0, 0.0)  # where the physics has nothing in the robot's way
EXPOSURE = (2, 10)  # [ms] assumed: a camera in a hall lit for sport; 10 ms is one flash of the lamps
SETTLING = 1.0  # [s] until a robot just put down stands still
BETWEEN = (0.6, 0.9)  # [s] from picture to picture: the head reaches its next target, the gait another phase
STARTING = 1.0  # [s] of walking before the first picture of it
MOVEMENTS = ("stand", "stand", "stand", "stand", "walk", "walk", "walk", "walk", "sweep", "sweep")
"""What the robot does at each of the ten pictures that it takes; "sweep" walks and turns the head in search."""
BALL_SHARE = 0.85  # of the pictures have a ball ahead; in the others it lies behind the robot
FARTHEST_BALL = 9.0  # [m]


@dataclass(frozen=True)
class Shot:
    """One picture.

    Attributes:
        picture: (height, width, 3) BGR.
        stamp: Middle of the exposure [ns].
        believed: (4, 4) camera_optical_frame in base_footprint as the robot knew it.
        true: (4, 4) the same as it was.
        truth: The world at the middle of the exposure, with the robot at its place on the field.
        movement: One of MOVEMENTS.
        exposure: [ms].
        camera: Light and colours of the picture.
    """

    picture: NDArray[np.uint8]
    stamp: int
    believed: Array
    true: Array
    truth: Truth
    movement: str
    exposure: int
    camera: CameraParameters


def vision_of(shot: Shot) -> Vision:
    """Return vision as the robot that took a picture has it."""
    own = OpponentParameters(team_colour=shot.camera.team_colour)
    return Vision(VisionParameters(opponents=own), head_camera_lens(), OwnBody(load_robot()))


class Photographer:
    """World, motion control, head movement and pose buffer, as in a match but without anything to play."""

    def __init__(self, seed: int, robot: Robot) -> None:
        """Put the robot down; friction, masses and the sensors' errors are drawn by the seed."""
        self.world = World(Scenario(AWAY, (40.0, 0.0), poles=False), WorldParameters(), seed, robot=robot)
        self.motion = Motion(MotionParameters(), robot)
        self.head = HeadMovement(HeadParameters(), robot)
        self.poses = PoseBuffer(PoseBufferParameters(), partial(camera_in_footprint, robot, mount=load_mount()))
        self.gaze = HeadCommand(0, HeadMode.LOOK_AT, (3.0, 0.0, 0.0))
        self.walk = WalkCommand(0, WalkMode.STAND)
        self._pending: list[JointCommand] = []
        self._tick = 0

    def tick(self) -> list[Truth]:
        """Advance by one control tick; return the world after each millisecond of it."""
        sensors = self.world.sensors()
        for command in self._pending:
            self.world.apply(command)
        self.motion.command(self.walk)
        self._pending = [self.motion.tick(sensors)]
        if self._tick % SLOW_TICKS == 0:
            odometry, angles = self.motion.odometry(), sensors.joint_positions[12:]
            self.poses.add_body(sensors.stamp, float(odometry.position[2]), odometry.orientation)
            self.poses.add_head(sensors.stamp, float(angles[0]), float(angles[1]))
            self._pending.append(self.head.update(sensors.stamp, self.gaze, angles))
        self._tick += 1
        states = []
        for _ in range(TICK):
            self.world.advance(1)
            states.append(self.world.truth())
        return states

    def go(self, seconds: float) -> None:
        """Let time pass [s]."""
        for _ in range(round(seconds * 1000 / TICK)):
            self.tick()

    def expose(self, milliseconds: int) -> list[Truth]:
        """Return the world at each millisecond of an exposure that begins now, both ends included."""
        states = [self.world.truth()]
        while len(states) <= milliseconds:
            states += self.tick()
        return states[: milliseconds + 1]

    def camera_pose(self, stamp: int) -> Array | None:
        """Return the (4, 4) camera pose at a stamp [ns] as soon as it is known; None if it never is."""
        for _ in range(4 * SLOW_TICKS):
            pose = self.poses.camera_in_footprint(stamp)
            if not isinstance(pose, MissingPose):
                return pose
            self.tick()
        return None


def camera_of(rng: np.random.Generator) -> CameraParameters:
    """Return a camera in some hall: brightness 0.6 to 1.4, warm or cold light, either team colour."""
    ours, theirs = rng.permutation(["cyan", "magenta"]).tolist()
    return CameraParameters(
        brightness=float(rng.uniform(0.6, 1.4)),
        red_gain=float(rng.uniform(0.95, 1.05)),
        blue_gain=float(rng.uniform(0.95, 1.05)),
        team_colour=ours,
        keeper_colour=theirs,
        hall_seed=int(rng.integers(10_000)),
    )


def shots(seed: int) -> Iterator[Shot]:
    """Yield the pictures of one robot in one hall, in the order of MOVEMENTS; fewer if it falls.

    Args:
        seed: Of the robot, its sensors, the hall, the light, and what stands where.
    """
    rng = np.random.default_rng([seed, 17])
    field, robot = load_field(), load_robot()
    camera = camera_of(rng)
    renderer = CameraRenderer(camera, field, robot, head_camera_lens())
    body = Photographer(seed, robot)
    try:
        body.go(SETTLING)
        walks = random_commands(rng, 60.0)
        for number, movement in enumerate(MOVEMENTS):
            pan = _look_somewhere(body, movement, rng)
            if movement != "stand":
                _walk_somehow(body, walks)
            body.go(float(rng.uniform(*BETWEEN)))
            exposure = 2 * int(rng.integers(EXPOSURE[0] // 2, EXPOSURE[1] // 2 + 1))  # even, so that it has a middle
            states = body.expose(exposure)
            middle = states[exposure // 2]
            believed = body.camera_pose(middle.stamp)
            if body.motion.mode is MotionMode.FALLEN:
                return
            if believed is None:
                raise RuntimeError(f"no camera pose for a picture at {middle.stamp} ns")
            if movement == "sweep":
                pan = float(middle.joint_positions[12])
            arrange = _arranged(middle, pan, field, rng, opponent_is_robot=number % 2 == 1)
            picture = renderer.render_over([arrange(each) for each in states], rng)
            truth = arrange(middle)
            yield Shot(
                picture, middle.stamp, believed, true_camera_pose(truth, robot), truth, movement, exposure, camera
            )
    finally:
        body.world.close()


def true_camera_pose(truth: Truth, robot: Robot) -> Array:
    """Return the (4, 4) transform of camera_optical_frame in base_footprint as it really is."""
    pan, tilt = truth.joint_positions[12:].tolist()
    return camera_in_footprint(robot, float(truth.base_position[2]), truth.base_orientation, pan, tilt)


def _look_somewhere(body: Photographer, movement: str, rng: np.random.Generator) -> float:
    """Begin to turn the head; return where to [rad]."""
    if movement == "sweep":
        body.gaze = HeadCommand(0, HeadMode.SEARCH)
        return 0.0
    pan = float(rng.uniform(-0.9, 0.9))
    tilt = float(rng.choice([rng.uniform(0.1, 0.45), rng.uniform(0.3, 0.9)]))
    distance = 1.1 / math.tan(tilt)  # from a camera 1.1 m above the ground
    body.gaze = HeadCommand(0, HeadMode.LOOK_AT, (distance * math.cos(pan), distance * math.sin(pan), 0.0))
    return pan


def _walk_somehow(body: Photographer, walks: Iterator[tuple[float, tuple[float, float, float] | None]]) -> None:
    start = body.walk.mode is WalkMode.STAND
    velocity = None
    while velocity is None:
        _, velocity = next(walks)
    body.walk = WalkCommand(0, WalkMode.WALK, velocity)
    if start:
        body.go(STARTING)


@dataclass(frozen=True)
class _Arrangement:
    move: Pose2D  # from where the physics has the robot to the field
    ball: Array  # (3,) [m]
    keeper: Pose2D | None
    robot: Pose2D | None  # from where the physics has the robot to where its double stands

    def __call__(self, truth: Truth) -> Truth:
        position, orientation = _moved(truth, self.move)
        others = () if self.robot is None else (OtherRobot(*_moved(truth, self.robot), truth.joint_positions),)
        return replace(
            truth,
            base_position=position,
            base_orientation=orientation,
            ball_position=self.ball,
            keeper=self.keeper,
            others=others,
            poles=True,
        )


def _moved(truth: Truth, move: Pose2D) -> tuple[Array, Array]:
    """Return position and orientation of base_link after a move over the ground."""
    x, y = move.transform((float(truth.base_position[0]), float(truth.base_position[1])))
    turn = (0.0, 0.0, math.sin(move.yaw / 2), math.cos(move.yaw / 2))
    return (
        np.array([x, y, float(truth.base_position[2])]),
        np.array(quaternion_product(turn, truth.base_orientation.tolist())),
    )


def _arranged(
    truth: Truth, pan: float, field: Field, rng: np.random.Generator, opponent_is_robot: bool
) -> _Arrangement:
    """Draw where on the field the robot, the ball and the opponent are, with something to see ahead."""
    x = rng.uniform(-field.length / 2 - 0.2, field.length / 2 - 0.6)
    y = rng.uniform(-field.width / 2, field.width / 2)
    seen = rng.uniform(-0.5, 0.5, 2) * (field.length, field.width)  # a picture of the hall's wall tells little
    heading = math.atan2(seen[1] - y, seen[0] - x)
    yaw = heading - pan
    ball = _place(x, y, heading, (0.5, FARTHEST_BALL), field, rng)
    if ball is None or rng.uniform() > BALL_SHARE:
        ball = (x - math.cos(heading), y - math.sin(heading))
    ahead = None
    if rng.uniform() < 0.6:
        ahead = _place(x, y, heading, (1.0, 8.5), field, rng)
    place = Pose2D(field.length / 2 - 0.3, float(rng.uniform(-1.0, 1.0)), math.pi)
    if ahead is not None:
        place = Pose2D(*ahead, float(rng.uniform(-math.pi, math.pi)))
    if math.hypot(place.x - x, place.y - y) < 0.7 or math.hypot(place.x - ball[0], place.y - ball[1]) < 0.3:
        place = Pose2D(20.0, 20.0, 0.0)  # they would stand in one another
    home = truth.footprint.inverse()
    return _Arrangement(
        Pose2D(float(x), float(y), float(yaw)) @ home,
        np.array([*ball, field.ball_radius]),
        None if opponent_is_robot else place,
        place @ home if opponent_is_robot else None,
    )


def _place(
    x: float, y: float, heading: float, reach: tuple[float, float], field: Field, rng: np.random.Generator
) -> tuple[float, float] | None:
    """Draw a place on the field within sight; None if none is found."""
    for _ in range(50):
        distance, turn = rng.uniform(*reach), heading + rng.uniform(-0.5, 0.5)
        place = x + distance * math.cos(turn), y + distance * math.sin(turn)
        if abs(place[0]) < field.length / 2 and abs(place[1]) < field.width / 2:
            return float(place[0]), float(place[1])
    return None
