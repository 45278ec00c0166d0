"""Where the feet stand and the body is in odom: the estimator's anchors, slips over the ground, and dead reckoning."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_description.quaternion import matrix_quaternion
from tulip_description.robot import Foot
from tulip_description.robot_io import Sensors
from tulip_description.short_numbers import significant
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import between_soles
from tulip_motion.ground_track import GroundTrack, carried
from tulip_motion.interface import Odometry, Side, Whereabouts
from tulip_motion.inverse_kinematics import rotation_z
from tulip_motion.odometry import DeadReckoning
from tulip_motion.parameters import MotionParameters
from tulip_motion.state_estimator import Estimate, StateEstimator
from tulip_motion.tilt_filter import TiltFilter

Array = NDArray[np.float64]
Feet = tuple[Footstep, Footstep]


class Footing:
    """Follows feet and body of a robot in odom."""

    def __init__(self, parameters: MotionParameters, estimator: StateEstimator, soles: Sequence[Foot]) -> None:
        """Begin where the estimator does.

        Args:
            parameters: Of motion control.
            estimator: Of the body's state, which is told where the feet stand.
            soles: Left and right.
        """
        p = self._parameters = parameters
        self._estimator = estimator
        self._dead_reckoning = DeadReckoning(p)
        self._ground = GroundTrack(p, [sole.cells for sole in soles])
        self._tilt = TiltFilter(p.control_period, p.imu_bias_time, p.imu_bias_limit)
        self.shift = (0.0, 0.0)
        """Of base_link in odom by slips since the feet were last put where they are [m]."""

    @property
    def feet(self) -> Feet:
        """The left and right foot where they stand, in odom; one in the air where it stood last."""
        left, right = self._estimator.anchors
        return Footstep(Side.LEFT, left), Footstep(Side.RIGHT, right)

    @property
    def middle(self) -> tuple[float, float]:
        """Where a standing robot has its ZMP, in odom [m]."""
        return between_soles(self.feet, self._parameters.zmp_forward, self._parameters.zmp_inward)

    def feet_beside(self, base: Pose2D) -> tuple[Pose2D, Pose2D]:
        """Return the left and right sole in base_footprint, which is at a pose in odom."""
        to_base = base.inverse()
        left, right = self.feet
        return to_base @ left.pose, to_base @ right.pose

    def begin(self, stamp: int) -> None:
        """Count the way from where the robot is at a stamp [ns]."""
        self._dead_reckoning.begin(stamp, self._ground.position)

    def fall(self) -> None:
        """Note that the robot falls: how far its body rolls cannot be known."""
        self._dead_reckoning.fall()

    def update(
        self, estimate: Estimate, sensors: Sensors, left_weight: float, com_acceleration: Array | None, walks: bool
    ) -> None:
        """Follow base_link over the ground for a tick.

        Args:
            estimate: Of this tick.
            sensors: As read.
            left_weight: Share of the weight that the left foot is to carry.
            com_acceleration: (3,) that is wanted [m/s^2]; None for a robot that lies or sinks, which is taken to stay
                where its feet are.
            walks: While it walks, the robot minds where its body is, and steps there; else, how it stands on its feet.
        """
        estimator = self._estimator
        self._tilt.update(sensors, estimate.base_rotation, estimate.soles, estimate.loads, left_weight)
        x, y, _ = estimate.base_position.tolist()
        x, y = x - estimator.shift[0], y - estimator.shift[1]
        if com_acceleration is not None:
            ax, ay, _ = com_acceleration.tolist()
            self._ground.update(estimate, sensors.foot_cells, (ax, ay))
        else:
            self._ground.begin(estimate, (x + self.shift[0], y + self.shift[1]))
        self.shift = (self._ground.position[0] - x, self._ground.position[1] - y)
        estimator.shift = self.shift if walks else (0.0, 0.0)
        estimator.pivots = self._ground.pivots

    def move_feet_along(self) -> None:
        """Take the feet to stand where slips have carried them with the body."""
        for side, foot in zip(Side, self._estimator.anchors, strict=True):
            moved = Pose2D(foot.x + self.shift[0], foot.y + self.shift[1], foot.yaw)
            self._estimator.anchor(Footstep(side, moved))
        self.shift = (0.0, 0.0)

    def carried(self, before: Feet, feet: Feet, estimate: Estimate) -> Feet:
        """Return the feet that a walk has put down, with the slips that odometry has seen."""
        return carried(before, feet, self.shift, estimate)

    def put(self, feet: Feet, stamp: int) -> None:
        """Keep where the feet stand at a stamp [ns], and count the way."""
        before = self._estimator.anchors
        if (feet[0].pose, feet[1].pose) != tuple(before):
            self._dead_reckoning.step(
                stamp, self._ground.position, before, [foot.pose for foot in feet], self._ground.signs
            )
            for foot in feet:
                self._estimator.anchor(foot)
            self.shift = self._estimator.shift = (0.0, 0.0)

    def odometry(self, estimate: Estimate, stamp: int, fallen: bool) -> Odometry:
        """Return dead reckoning.

        Args:
            estimate: Of the last tick.
            stamp: Of it [ns].
            fallen: Whether the robot lies.
        """
        yaw = math.atan2(estimate.base_rotation[1, 0], estimate.base_rotation[0, 0])
        position = np.array([*self._ground.position, estimate.base_position[2]])
        reckoning = self._dead_reckoning
        return Odometry(
            stamp,
            position,
            matrix_quaternion(self._tilt.corrected(estimate.base_rotation)),
            rotation_z(-yaw) @ estimate.base_velocity,
            estimate.base_rotation.T @ estimate.angular_velocity,
            reckoning.distance,
            significant(reckoning.pose_covariance(stamp, position, yaw, self._ground.signs, fallen)),
            significant(reckoning.twist_covariance()),
        )

    def whereabouts(self, stamp: int, sequence: int) -> Whereabouts:
        """Return what `continue_from` takes, with the number of the last command."""
        x, y = self._ground.position
        reckoning = self._dead_reckoning
        return Whereabouts(
            stamp,
            (float(x), float(y)),
            self._estimator.heading_offset,
            reckoning.distance,
            reckoning.uncertainty.ravel().tolist(),
            sequence,
        )

    def continue_from(self, before: Whereabouts, stamp: int) -> None:
        """Go on at a stamp [ns] in the odom of motion control that has died; call before the first tick."""
        gap = (stamp - before.stamp) * 1e-9
        self._estimator.continue_from(before.heading_offset, (before.base[0], before.base[1]))
        self._dead_reckoning.continue_from(before.distance, np.reshape(before.uncertainty, (4, 4)), gap)
