"""The ground truth: what really is, for renderer, referee, reports and tests; never for a component that plays."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_description.quaternion import pose_on_ground

Array = NDArray[np.float64]
HALF_TURN = np.array([-1.0, -1.0, 1.0])


@dataclass(frozen=True)
class OtherRobot:
    """Another robot on the field, as it stands or lies; all in map.

    Attributes:
        base_position: (3,) of base_link [m].
        base_orientation: (4,) quaternion x, y, z, w of base_link.
        joint_positions: (14,) [rad], order of `tulip_description.robot.JOINTS`.
    """

    base_position: Array
    base_orientation: Array
    joint_positions: Array

    @property
    def footprint(self) -> Pose2D:
        """base_footprint in map."""
        return pose_on_ground(self.base_position, self.base_orientation)

    def turned(self) -> OtherRobot:
        """Return the same in a map that is turned by half a circle."""
        return OtherRobot(HALF_TURN * self.base_position, _turned(self.base_orientation), self.joint_positions)


@dataclass(frozen=True)
class Truth:
    """The state of the whole world at one instant; all in map unless said otherwise.

    Attributes:
        stamp: Time since the world's start [ns].
        base_position: (3,) of base_link [m].
        base_orientation: (4,) quaternion x, y, z, w of base_link.
        base_linear_velocity: (3,) of base_link's origin [m/s].
        base_angular_velocity: (3,) [rad/s].
        joint_positions: (14,) [rad], order of `tulip_description.robot.JOINTS`.
        joint_velocities: (14,) [rad/s].
        ball_position: (3,) centre of the ball [m].
        ball_orientation: (4,) quaternion x, y, z, w.
        ball_linear_velocity: (3,) [m/s].
        ball_angular_velocity: (3,) [rad/s].
        keeper: Where the keeper stands, or None without one.
        keeper_path: Points between which the keeper goes to and fro [m]; empty for one that stands.
        foot_touches: How often the left and the right foot have met the ball.
        body_touches: How often any other part of the robot has met the ball.
        keeper_touches: How often the keeper has met the ball.
        poles: Whether the landmark poles stand.
        others: The other robots.
        obstacles: Where further figures stand.
    """

    stamp: int
    base_position: Array
    base_orientation: Array
    base_linear_velocity: Array
    base_angular_velocity: Array
    joint_positions: Array
    joint_velocities: Array
    ball_position: Array
    ball_orientation: Array
    ball_linear_velocity: Array
    ball_angular_velocity: Array
    keeper: Pose2D | None
    keeper_path: tuple[tuple[float, float], ...]
    foot_touches: tuple[int, int]
    body_touches: int
    keeper_touches: int
    poles: bool
    others: tuple[OtherRobot, ...] = ()
    obstacles: tuple[Pose2D, ...] = ()

    @property
    def figures(self) -> tuple[Pose2D, ...]:
        """Where figures stand: the keeper, if there is one, and the obstacles."""
        return self.obstacles if self.keeper is None else (self.keeper, *self.obstacles)

    @property
    def footprint(self) -> Pose2D:
        """base_footprint in map: where the robot is and looks to, seen from above."""
        return pose_on_ground(self.base_position, self.base_orientation)

    def turned(self) -> Truth:
        """Return the same in the map of the team that attacks the other goal: turned by half a circle."""
        return replace(
            self,
            base_position=HALF_TURN * self.base_position,
            base_orientation=_turned(self.base_orientation),
            base_linear_velocity=HALF_TURN * self.base_linear_velocity,
            base_angular_velocity=HALF_TURN * self.base_angular_velocity,
            ball_position=HALF_TURN * self.ball_position,
            ball_orientation=_turned(self.ball_orientation),
            ball_linear_velocity=HALF_TURN * self.ball_linear_velocity,
            ball_angular_velocity=HALF_TURN * self.ball_angular_velocity,
            keeper=None if self.keeper is None else _turned_pose(self.keeper),
            keeper_path=tuple((-x, -y) for x, y in self.keeper_path),
            others=tuple(other.turned() for other in self.others),
            obstacles=tuple(_turned_pose(each) for each in self.obstacles),
        )


def _turned_pose(pose: Pose2D) -> Pose2D:
    return Pose2D(-pose.x, -pose.y, pose.yaw + math.pi)


def _turned(orientation: Array) -> Array:
    """Return a quaternion (4,) x, y, z, w after a turn by half a circle about map's z axis: (0, 0, 1, 0) times it."""
    x, y, z, w = orientation.tolist()
    return np.array([-y, x, w, -z])
