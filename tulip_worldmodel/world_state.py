"""What the world model gives: where the robot, the ball and the opponents are, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_worldmodel.rolling import DECELERATION, rest

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RobotEstimate:
    """The robot on the field.

    Attributes:
        pose: base_footprint in map.
        covariance: (3, 3) of x [m], y [m], yaw [rad].
        pose_in_odom: base_footprint in odom at the same stamp.
    """

    pose: Pose2D
    covariance: Array
    pose_in_odom: Pose2D


@dataclass(frozen=True)
class ObjectEstimate:
    """A movable object: the ball or an opponent.

    The relative position comes from vision and dead reckoning alone, so it stays good when localization is not.

    Attributes:
        position: (2,) in base_footprint [m].
        velocity: (2,) over the ground, in base_footprint axes [m/s].
        covariance: (4, 4) of the two, relative to the robot.
        position_in_map: (2,) [m], through the estimated robot pose.
        velocity_in_map: (2,) [m/s].
        age: Time since it was last seen [s].
        confidence: 0 to 1, grows with sightings and decays when it should be visible but is not.
    """

    position: Array
    velocity: Array
    covariance: Array
    position_in_map: Array
    velocity_in_map: Array
    age: float
    confidence: float


@dataclass(frozen=True)
class BallRest:
    """Where a rolling ball will stop by itself, and when.

    Attributes:
        position: (2,) in base_footprint of now [m].
        position_in_map: (2,) [m].
        after: From the state's stamp [s]; 0 for a ball that rests.
    """

    position: Array
    position_in_map: Array
    after: float


@dataclass(frozen=True)
class WorldState:
    """The world at one instant.

    Attributes:
        stamp: Stamp of the newest input used [ns].
        robot: The robot's own pose.
        ball: The ball, or None while it is not known.
        opponents: Confirmed opponents.
        picture: Stamp of the newest picture whose features were used [ns]; 0 before the first.
    """

    stamp: int
    robot: RobotEstimate
    ball: ObjectEstimate | None
    opponents: tuple[ObjectEstimate, ...]
    picture: int = 0

    @property
    def ball_rest(self) -> BallRest | None:
        """Where the ball will stop and when, if nothing meets it; None while it is not known."""
        if self.ball is None:
            return None
        position, after = rest(self.ball.position, self.ball.velocity, DECELERATION)
        in_map, _ = rest(self.ball.position_in_map, self.ball.velocity_in_map, DECELERATION)
        return BallRest(position, in_map, after)
