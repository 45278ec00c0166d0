"""The world model: robot, ball and opponents from dead reckoning and the features of pictures.

A picture's features come later than the odometry of the moment when it was taken. All filters therefore stand at the
stamp of the last picture; the path since then is kept, and `state` predicts along it to the newest moment.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_description.short_numbers import fixed_point, significant
from tulip_motion.interface import Odometry
from tulip_vision.features import Features
from tulip_worldmodel.ball_filter import BallFilter, BallParameters
from tulip_worldmodel.camera_error import CameraErrorParameters
from tulip_worldmodel.landmark_geometry import rehearse
from tulip_worldmodel.localization import Localization
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.moving_point import PointEstimate
from tulip_worldmodel.odometry_history import OdometryHistory, PathPoint, increment
from tulip_worldmodel.opponent_filter import OpponentFilter, OpponentParameters
from tulip_worldmodel.rejected import Rejected
from tulip_worldmodel.sighting import Observer
from tulip_worldmodel.world_state import ObjectEstimate, RobotEstimate, WorldState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WorldModelParameters:
    """Parameters of the world model and its parts."""

    camera: CameraErrorParameters = field(default_factory=CameraErrorParameters)
    localization: LocalizationParameters = field(default_factory=LocalizationParameters)
    ball: BallParameters = field(default_factory=BallParameters)
    opponents: OpponentParameters = field(default_factory=OpponentParameters)
    greatest_delay: float = 0.5  # [s] features older than that, measured by the newest odometry, are not used
    greatest_lead: float = 0.1  # [s] by which a picture may be newer than the newest odometry
    longest_gap: float = 0.5  # [s] between pictures that counts as "not seen": longer ones say nothing about an object

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for name in ("greatest_delay", "greatest_lead", "longest_gap"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)} s; expected > 0")


class WorldModel:
    """Estimates of the robot, the ball and the opponents."""

    def __init__(self, parameters: WorldModelParameters, field: Field, start: Pose2D) -> None:
        """Begin at a known place, with no ball and no opponents.

        Args:
            parameters: See `WorldModelParameters`.
            field: The field played on.
            start: base_footprint in map when the first odometry comes.
        """
        rehearse()
        self._parameters = parameters
        self._localization = Localization(parameters.localization, field, start, parameters.camera)
        self._ball = BallFilter(parameters.ball, field.ball_radius, parameters.camera)
        self._opponents = OpponentFilter(parameters.opponents, parameters.camera)
        self._history = OdometryHistory(2.0 * parameters.greatest_delay)
        self._now: PathPoint | None = None  # where and when all filters stand
        self._last_picture: int | None = None  # stamp [ns]

    @property
    def localization(self) -> Localization:
        """What knows where the robot is, for a look at its hypotheses."""
        return self._localization

    def add_odometry(self, odometry: Odometry) -> None:
        """Take a reading of dead reckoning; one that is not newer than the newest is ignored."""
        if not self._history.append(odometry):
            return
        newest = self._history.at(odometry.stamp)
        if self._now is None:
            self._now = newest
        elif newest.stamp - self._now.stamp > 2.0 * self._parameters.greatest_delay * 1e9:
            # No pictures for long: follow, and stay behind as far as a picture may still be late.
            self._advance(odometry.stamp - round(self._parameters.greatest_delay * 1e9))

    def add_features(self, features: Features) -> tuple[Rejected, ...]:
        """Take the features of one picture, at the stamp when it was taken.

        Args:
            features: Of a picture not older than the last one.

        Returns:
            What was not used, and why.
        """
        newest = self._history.newest
        if newest is None or self._now is None:
            return (Rejected(features.stamp, "no odometry yet"),)
        if features.stamp < self._now.stamp:
            return (Rejected(features.stamp, "older than the last picture used, or than the delay allowed"),)
        if features.stamp > newest.stamp + self._parameters.greatest_lead * 1e9:
            return (Rejected(features.stamp, "newer than the newest odometry"),)
        since_last = 0.0 if self._last_picture is None else (features.stamp - self._last_picture) * 1e-9
        since_last = min(since_last, self._parameters.longest_gap)
        self._last_picture = features.stamp
        self._advance(features.stamp)
        observer = Observer(features.stamp, self._now.pose, features.camera_position)
        return (
            *self._localization.update(features, since_last),
            *self._opponents.update(features, observer, since_last),
            *self._ball.update(features, observer, since_last, self._ball_is_hidden(observer, features)),
        )

    def state(self, stamp: int) -> WorldState:
        """Return the world at a stamp [ns], or at the newest odometry if that is older.

        Moments before the last picture are answered with the state at that picture.
        """
        if self._now is None:
            pose, covariance = self._localization.pose, self._localization.covariance
            return WorldState(stamp, RobotEstimate(pose, covariance, Pose2D()), None, ())
        then = self._history.at(max(stamp, self._now.stamp))
        if then.stamp < self._now.stamp:
            then = self._now
        moved = increment(self._now, then)
        pose, covariance = self._localization.predicted(moved)
        robot = RobotEstimate(_short(pose), significant(covariance), _short(then.pose))
        here = np.array([self._now.pose.x, self._now.pose.y])
        ball = None
        if self._ball.known:
            point = self._ball.extrapolated(moved, here)
            ball = _estimate(point, robot, then.stamp, self._ball.last_seen, self._ball.confidence)
        opponents = tuple(
            _estimate(opponent.extrapolated(moved, here), robot, then.stamp, opponent.last_seen, opponent.confidence)
            for opponent in self._opponents.confirmed
        )
        return WorldState(then.stamp, robot, ball, opponents, self._last_picture or 0)

    def _advance(self, stamp: int) -> None:
        """Predict all filters along the path to a stamp."""
        then = self._history.at(stamp)
        if self._now is None or then.stamp <= self._now.stamp:
            return
        moved = increment(self._now, then)
        here = np.array([self._now.pose.x, self._now.pose.y])
        self._localization.predict(moved)
        self._ball.predict(moved, here)
        self._opponents.predict(moved, here)
        self._now = then

    def _ball_is_hidden(self, observer: Observer, features: Features) -> bool:
        if not self._ball.known:
            return False
        position = self._ball.point.state[:2]
        angles, _ = observer.direction(position, 0.0)
        offset = observer.offset(position, 0.0)[0]
        return self._opponents.hides(angles, float(np.hypot(offset[0], offset[1])), observer, features)


def _estimate(
    point: PointEstimate, robot: RobotEstimate, stamp: int, last_seen: int, confidence: float
) -> ObjectEstimate:
    """Turn a point of odom into what others want to know of it."""
    to_footprint = robot.pose_in_odom.rotation().T
    both = np.zeros((4, 4))
    both[:2, :2] = both[2:, 2:] = to_footprint
    state = point.state
    relative = np.array(robot.pose_in_odom.inverse().transform(state[:2]))
    velocity = to_footprint @ state[2:]
    in_map = robot.pose.transform(relative)
    told = fixed_point(np.concatenate((relative, velocity, in_map, robot.pose.rotation() @ velocity)))
    return ObjectEstimate(
        position=told[:2],
        velocity=told[2:4],
        covariance=significant(both @ point.covariance @ both.T),
        position_in_map=told[4:6],
        velocity_in_map=told[6:],
        age=max(0.0, (stamp - last_seen) * 1e-9),
        confidence=confidence,
    )


def _short(pose: Pose2D) -> Pose2D:
    """Return a pose as it is told: digits that mean nothing would take most of a recording's space."""
    return Pose2D(*fixed_point(pose.as_array()).tolist())
