"""How far dead reckoning may be off: its covariance, carried along over steps and time.

The position is that of the stance foot plus the way from there to base_link; the heading is the IMU's. So the
errors e = truth - odometry grow like this:

- The IMU's heading drifts at a rate b that is constant in a run but unknown: e_yaw(t) = e_yaw(0) + b t.
- A heading that is off turns all of the way that follows: e_xy += J d (e_yaw + b dt / 2), where d is the way of
  the base in odom and J the quarter turn. With b in the state, e = (x, y, yaw, b), this is linear and exact in d.
- Each step adds a slip of its own, in the axes of the foot: a share of the way, more sideways than forward, some
  millimetres for each radian turned, and a little even in place.
- A stance foot that twists on the ground shifts too. The IMU and the joints show the twist, and the foot pivots about
  its centre of pressure: `StanceTwist` takes most of the shift off, the rest is a share of the twist.
- The IMU's tilt error carries over the height of base_link into the position. It does not add up, and the part that
  is fixed to the body is part of where odom was put at the start: it shows by how much the robot has turned since.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.footsteps import Footstep
from tulip_motion.parameters import MotionParameters

TWIST_FILTER = 0.02  # [s] over which the IMU's noise of 1 mrad is smoothed; a step takes twenty times as long

Array = NDArray[np.float64]
NANOSECOND = 1e-9  # [s]
YAW, DRIFT = 2, 3
PLANE = np.ix_((0, 1, 5), (0, 1, 5))  # x, y and yaw among the six of a pose


class StanceTwist:
    """How far the stance foot has moved by twisting on the ground during one step.

    Attributes:
        shift: (x, y) of the sole in odom since the step began [m]: of the body as well, which stands on it.
        twist: Of the sole since the step began [rad].
    """

    def __init__(self, control_period: float) -> None:
        self._share = min(control_period / TWIST_FILTER, 1.0)
        self.restart()

    def restart(self) -> None:
        """Begin a step."""
        self.shift = (0.0, 0.0)
        self.twist = 0.0

    def carried(self, before: tuple[Footstep, Footstep], after: tuple[Footstep, Footstep]) -> tuple[Footstep, Footstep]:
        """Return the feet after a landing, with the foot that stood where and as it has been turned.

        Both feet move by the same, so that they stand to each other as the joints say.

        Args:
            before: Left and right foot before the landing.
            after: The same with the one that landed at its place, shift included.
        """
        if before == after:
            return after
        left, right = (self._moved(new) if new == old else new for old, new in zip(before, after, strict=True))
        return left, right

    def _moved(self, foot: Footstep) -> Footstep:
        x, y = self.shift
        return Footstep(foot.side, Pose2D(foot.pose.x + x, foot.pose.y + y, wrap_angle(foot.pose.yaw + self.twist)))

    def update(self, anchor: Pose2D, yaw: float, pressure: Array) -> None:
        """Look at the foot in single support.

        Args:
            anchor: Where the sole was put down, in odom.
            yaw: Of the sole as the IMU and the joints have it now, in odom [rad].
            pressure: (2,) centre of pressure in odom [m]; NaN without contact.
        """
        turned = self._share * wrap_angle(yaw - anchor.yaw - self.twist)
        self.twist += turned
        x, y = anchor.x - float(pressure[0]), anchor.y - float(pressure[1])
        if math.isfinite(x) and math.isfinite(y):
            self.shift = (self.shift[0] - turned * y, self.shift[1] + turned * x)


LONGEST_STEP = 0.6  # [s] more between two landings is standing


class DeadReckoning:
    """Counts the way and keeps the covariance of the odometry.

    Attributes:
        distance: Path length walked [m].
    """

    def __init__(self, parameters: MotionParameters) -> None:
        p = self._parameters = parameters
        self.distance = 0.0
        self._stamp: int | None = None
        self._position = np.zeros(2)
        self._unknown_tilt = 1.0  # share of the IMU's tilt error that the soles have not told yet
        # odom lies where the robot stood when it was switched on, turned by the error of the first reading
        self._covariance = np.diag([0.0, 0.0, p.odometry_yaw_noise**2, p.odometry_yaw_drift**2])
        linear = (p.odometry_velocity_noise**2,) * 2 + (p.odometry_climb_noise**2,)
        self._twist = np.diag(linear + (p.odometry_rate_noise**2,) * 3)

    def begin(self, stamp: int, position: Array) -> None:
        """Start at a stamp [ns] with base_link at a position (2,) in odom [m]; later calls change nothing."""
        if self._stamp is None:
            self._stamp, self._position = stamp, position.copy()

    def step(
        self, stamp: int, position: Array, before: Sequence[Pose2D], after: Sequence[Pose2D], twist: float = 0.0
    ) -> None:
        """Add a step: the feet stand anew.

        Args:
            stamp: When the foot landed [ns].
            position: (2,) of base_link in odom [m].
            before: Left and right foot as they stood, in odom.
            after: Left and right foot as they stand now.
            twist: Of the stance foot on the ground during the step [rad].
        """
        p = self._parameters
        # The body moves half as far as a foot does.
        way = 0.5 * np.sum([(new.x - old.x, new.y - old.y) for old, new in zip(before, after, strict=True)], axis=0)
        turned = 0.5 * sum(abs(wrap_angle(new.yaw - old.yaw)) for old, new in zip(before, after, strict=True))
        self.distance += float(np.hypot(*way))
        self._covariance = self._extrapolated(stamp, position)
        if self._stamp is not None:
            step_time = min(1e-9 * (stamp - self._stamp), LONGEST_STEP)
            self._unknown_tilt *= math.exp(-max(step_time - p.double_support_time, 0.0) / p.imu_bias_time)
        self._stamp, self._position = stamp, position.copy()
        heading = after[0].rotation()
        forward, left = heading.T @ way
        always = p.odometry_step_noise**2 + (p.odometry_turn_slip * turned) ** 2 + (p.odometry_twist_slip * twist) ** 2
        slip = always + np.array([p.odometry_forward_slip * forward, p.odometry_sideways_slip * left]) ** 2
        self._covariance[:2, :2] += heading @ np.diag(slip) @ heading.T

    def fall(self) -> None:
        """Say that the robot fell: where the referee's hands will set it up is known only roughly.

        The heading stays known, since the IMU goes on turning with the body.
        """
        self._covariance[:2, :2] += self._parameters.odometry_fall_spread**2 * np.eye(2)

    def pose_covariance(self, stamp: int, position: Array, yaw: float, lying: bool = False) -> Array:
        """Return the (6, 6) covariance of base_link's pose in odom: x, y, z [m], roll, pitch, yaw [rad].

        Args:
            stamp: [ns].
            position: (3,) of base_link in odom [m].
            yaw: Heading in odom [rad].
            lying: The feet may not be on the ground, so that the height is not known.
        """
        p = self._parameters
        planar = self._extrapolated(stamp, position[:2])[:3, :3]
        # |k R(yaw) b - b|^2 of a lean b of which a share k is still unknown: that turns with the body, the whole of it
        # put the start off; and the white noise of now and of the start
        unknown = self._unknown_tilt
        lean = (1.0 + unknown**2 - 2.0 * unknown * math.cos(yaw)) * p.odometry_tilt_bias**2
        lean += 2.0 * p.odometry_tilt_noise**2
        planar[0, 0] += lean * position[2] ** 2
        planar[1, 1] += lean * position[2] ** 2
        planar[YAW, YAW] += p.odometry_yaw_noise**2
        tilt = p.odometry_tilt_bias**2 + p.odometry_tilt_noise**2
        height = p.odometry_fall_spread if lying else p.odometry_height_noise
        covariance = np.diag([0.0, 0.0, height**2, tilt, tilt, 0.0])
        covariance[PLANE] = planar
        return covariance

    def twist_covariance(self) -> Array:
        """Return the (6, 6) covariance of linear [(m/s)^2] and angular velocity [(rad/s)^2]."""
        return self._twist.copy()

    def _extrapolated(self, stamp: int, position: Array) -> Array:
        """Return the (4, 4) covariance of (x, y, yaw, drift) after the way since the last step, without new slip."""
        if self._stamp is None:
            return self._covariance.copy()
        dt = (stamp - self._stamp) * NANOSECOND
        dx, dy = position - self._position
        transition = np.eye(4)
        transition[:2, YAW] = (-dy, dx)
        transition[:2, DRIFT] = (-0.5 * dy * dt, 0.5 * dx * dt)
        transition[YAW, DRIFT] = dt
        covariance: Array = transition @ self._covariance @ transition.T
        walk = self._parameters.odometry_yaw_walk**2 * abs(dt)
        covariance[YAW, YAW] += walk
        return covariance
