"""What there is to see of a robot at an instant: made from its messages, wherever these come from.

Everything is in `map`, lengths in metres, angles in radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from threading import RLock
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tulip_description.camera_mount import load_mount
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.quaternion import pose_on_ground
from tulip_description.robot import Foot, Robot
from tulip_ros import topics
from tulip_view.body_pose import BodyPose, pose_row, turned
from tulip_view.columns import MODES, SUPPORTS, name_of
from tulip_view.ellipse import ball_ellipse, robot_ellipse
from tulip_view.live.buffers import Buffers
from tulip_view.live.sight import Sight, look

Array = NDArray[np.float64]
T = TypeVar("T")


@dataclass(frozen=True)
class Balance:
    """The robot over its feet.

    Attributes:
        com: (3,) centre of mass.
        zmp, zmp_desired, dcm: (2,) zero-moment point, measured and commanded, and divergent component of motion; NaN
            where there is none.
        soles: (2, 4, 3) corners of the left and of the right sole.
        carrying: Pose of the foot that carries, or of the middle between both.
        carries: (2,) which soles are planned to carry.
        words: Mode and support, as in "walk, left".
    """

    com: Array
    zmp: Array
    zmp_desired: Array
    dcm: Array
    soles: Array
    carrying: Pose2D
    carries: tuple[bool, bool]
    words: str


@dataclass(frozen=True)
class Around:
    """What is around the robot.

    Attributes:
        pose: Where the robot believes to be, or None.
        robot_spread, ball_spread: (33, 2) ellipses of two standard deviations, or None.
        ball: (2,) where it believes the ball to be, or None.
        opponents: (n, 2) where it believes opponents to be.
        true_ball: (3,) where the ball really is, or None.
        true_others: Where other figures really are.
    """

    pose: Pose2D | None
    robot_spread: Array | None
    ball_spread: Array | None
    ball: Array | None
    opponents: Array
    true_ball: Array | None
    true_others: tuple[Pose2D, ...]


@dataclass(frozen=True)
class Body:
    """A body in the map.

    Attributes:
        links: (links, 7) position and quaternion x, y, z, w of each link of `Scene.body`.
        footprint: Where it stands, seen from above.
    """

    links: NDArray[np.float32]
    footprint: Pose2D


class Scene:
    """Takes messages and tells what there is to see. May be fed by one thread and asked by others.

    Attributes:
        body: Boxes of the robot's links.
        changes: Grows with whatever changes what there is to see.
    """

    def __init__(self, robot: Robot) -> None:
        """Begin with nothing.

        Args:
            robot: Its body.
        """
        self.robot = robot
        self.body = BodyPose(robot)
        self._mount = load_mount()
        self._lock = RLock()
        self._buffers = Buffers()
        self.changes = 0

    def begin_anew(self) -> None:
        """Forget all: time began anew, or another moment of a recording is looked at."""
        with self._lock:
            self._buffers = Buffers()
            self.changes += 1

    def take(self, name: str, message: Any, arrival: float) -> None:
        """Take a message.

        Args:
            name: Of its topic within the robot's namespace, one of `INPUTS`.
            message: The message.
            arrival: When it came, by a clock that always runs forward [s].
        """
        with self._lock:
            self._buffers.take(name, message, arrival)
            self.changes += 1

    def forget(self, topic: topics.Topic) -> None:
        """Forget what came of a topic."""
        with self._lock:
            self._buffers.forget(topic)
            self.changes += 1

    def told(self, tell: Callable[[Buffers], T]) -> T:
        """Return what a function makes of the messages; none comes in meanwhile."""
        with self._lock:
            return tell(self._buffers)

    @property
    def stamp(self) -> float:
        """Newest stamp [s]."""
        return self._buffers.stamp

    def estimate(self) -> Body | None:
        """Return the robot at its estimated pose, or None where odometry or the angles of its legs are missing.

        Height and attitude are those of the odometry; so is the place, where no world model says better.
        """
        with self._lock:
            odometry, angles = self._buffers.newest(topics.ODOMETRY), self._angles()
            if odometry is None or angles is None:
                return None
            base = np.array(pose_row(odometry.pose.pose), dtype=float)
            to_map = self._odom_in_map()
        base[:2] = to_map.transform(base[:2])
        base[3:] = turned(base[None], np.array([to_map.yaw]))[0]
        return self._placed(base, angles)

    def truth(self) -> Body | None:
        """Return the robot as it really stands, or None where nobody tells."""
        with self._lock:
            truth = self._buffers.newest(topics.GROUND_TRUTH)
        if truth is None:
            return None
        angles = np.asarray(truth.joint_positions, dtype=float)[: len(self.robot.joint_names)]
        return self._placed(np.array(pose_row(truth.robot), dtype=float), angles)

    def around(self) -> Around:
        """Return what is around the robot."""
        with self._lock:
            world, truth = self._buffers.newest(topics.WORLD_STATE), self._buffers.newest(topics.GROUND_TRUTH)
        ball = world.ball if world is not None and world.ball_known else None
        others = [] if truth is None else [*([truth.keeper] if truth.keeper_present else []), *truth.obstacles]
        rows = [pose_row(other) for other in others]
        return Around(
            pose=Pose2D(*(float(value) for value in world.robot_pose)) if world is not None else None,
            robot_spread=robot_ellipse(world) if world is not None else None,
            ball_spread=ball_ellipse(world) if ball is not None else None,
            ball=np.array(ball.position_in_map, dtype=np.float64) if ball is not None else None,
            opponents=np.array([each.position_in_map for each in world.opponents] if world is not None else [])
            .reshape(-1, 2)
            .astype(float),
            true_ball=np.array(pose_row(truth.ball)[:3]) if truth is not None else None,
            true_others=tuple(pose_on_ground(row[:2], row[3:]) for row in rows),
        )

    def balance(self) -> Balance | None:
        """Return the robot over its feet, or None where motion control says nothing."""
        with self._lock:
            motion, to_map = self._buffers.newest(topics.MOTION_STATE), self._odom_in_map()
        if motion is None:
            return None
        turn = to_map.rotation()
        shift = np.array([to_map.x, to_map.y])
        frames = np.array([motion.left_sole, motion.right_sole], dtype=float).reshape(2, 4, 4)
        corners = np.array([_corners(foot, frame) for foot, frame in zip(self.robot.feet, frames, strict=True)])
        corners[:, :, :2] = corners[:, :, :2] @ turn.T + shift
        support = int(motion.support)
        carries = (
            support in (motion.SUPPORT_DOUBLE, motion.SUPPORT_LEFT),
            support in (motion.SUPPORT_DOUBLE, motion.SUPPORT_RIGHT),
        )
        feet = [to_map @ Pose2D(frame[0, 3], frame[1, 3], math.atan2(frame[1, 0], frame[0, 0])) for frame in frames]
        com = np.array(motion.com, dtype=float)
        com[:2] = com[:2] @ turn.T + shift
        return Balance(
            com=com,
            zmp=np.asarray(motion.zmp) @ turn.T + shift,
            zmp_desired=np.asarray(motion.zmp_desired) @ turn.T + shift,
            dcm=np.asarray(motion.dcm) @ turn.T + shift,
            soles=corners,
            carrying=feet[0] if carries == (True, False) else feet[1] if carries == (False, True) else _middle(*feet),
            carries=carries,
            words=f"{name_of(MODES, motion.mode)}, {name_of(SUPPORTS, support)}",
        )

    def footsteps(self) -> list[Array]:
        """Return the planned footsteps, the one under way first: (4, 3) corners of each sole."""
        with self._lock:
            message, to_map = self._buffers.newest(topics.FOOTSTEPS), self._odom_in_map()
        feet = self.robot.feet
        found = []
        for pose in message.poses if message is not None else ():
            row = pose_row(pose)
            place = to_map @ pose_on_ground(row[:2], row[3:])
            frame = np.eye(4)
            frame[:2, :2], frame[:2, 3] = place.rotation(), (place.x, place.y)
            found.append(_corners(feet[0], frame))  # both soles are alike
        return found

    def sight(self) -> Sight | None:
        """Return what the camera saw last, or None where no picture comes."""
        return self.told(lambda buffers: look(buffers, self.robot, self._mount))

    def _placed(self, base: Array, angles: Array) -> Body | None:
        links = self.body.links(base, angles)
        if not np.isfinite(links).all():
            return None
        return Body(links, pose_on_ground(base[:2], base[3:]))

    def _angles(self) -> Array | None:
        """Return (n,) joint angles; 0 for joints of the neck that nobody tells; None where legs are not told."""
        joints, motion = self._buffers.newest(topics.JOINT_STATES), self._buffers.newest(topics.MOTION_STATE)
        if joints is not None:
            told = dict(zip(joints.name, joints.position, strict=False))
            return np.array([told.get(name, 0.0) for name in self.robot.joint_names])
        if motion is None:
            return None
        angles = np.zeros(len(self.robot.joint_names))
        angles[: len(motion.joint_positions)] = motion.joint_positions
        return angles

    def _odom_in_map(self) -> Pose2D:
        world = self._buffers.newest(topics.WORLD_STATE)
        if world is None:
            return Pose2D()
        pose, in_odom = (Pose2D(*(float(v) for v in row)) for row in (world.robot_pose, world.robot_pose_in_odom))
        return pose @ in_odom.inverse()


def _middle(left: Pose2D, right: Pose2D) -> Pose2D:
    turn = left.yaw + wrap_angle(right.yaw - left.yaw) / 2.0
    return Pose2D((left.x + right.x) / 2.0, (left.y + right.y) / 2.0, turn)


def _corners(foot: Foot, frame: Array) -> Array:
    """Return (4, 3) corners of a sole in the frame that its own (4, 4) frame is given in."""
    corners = [(foot.x[i], foot.y[j], 0.0, 1.0) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    found: Array = (np.array(corners) @ frame.T)[:, :3]
    return found
