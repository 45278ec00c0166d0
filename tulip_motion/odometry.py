"""How far dead reckoning may be off: its covariance, carried along over steps and time.

The position follows the soles over the ground (ground_track.py); the heading is the IMU's. So the errors
e = truth - odometry grow like this:

- The IMU's heading drifts at a rate b that is constant in a run but unknown: e_yaw(t) = e_yaw(0) + b t.
- A heading that is off turns all of the way that follows: e_xy += J d (e_yaw + b dt / 2), where d is the way of
  the base in odom and J the quarter turn. With b in the state, e = (x, y, yaw, b), this is linear and exact in d.
- To second order, a heading that is off shortens the way by d e_yaw^2 / 2. After two minutes that is more than all
  slips. The heading's error is nearly all drift, z sigma(t) with one z in a run, so that the shortening is
  z^2 / 2 sum sigma^2 d. Its mean square is taken: 3 / 4 of the square of the sum.
- Each step adds what the IMU's noise makes of the way from foot to foot: some tenths of a millimetre.
- Soles slip when they twist on the ground, which IMU and joints show. `GroundTrack` takes most of the shift off; the
  rest is a share of the twist, in the axes of the foot, more across than along it. Steps whose sole did not twist were
  found to slip by some thousandths of a millimetre, so that no share of the way is added.
- A robot that hops slides freely meanwhile: its error grows by a speed.
- The IMU's tilt error carries over the height of base_link into the position. It does not add up, and the part that
  is fixed to the body is part of where odom was put at the start: it shows by how much the robot has turned since.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_motion.ground_track import SlipSigns
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]
Point = tuple[float, float]
NANOSECOND = 1e-9  # [s]
YAW, DRIFT = 2, 3
PLANE = np.ix_((0, 1, 5), (0, 1, 5))  # x, y and yaw among the six of a pose


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
        self._position: Point = (0.0, 0.0)
        self._signs = SlipSigns(0.0, 0.0)
        self._bent: Point = (0.0, 0.0)  # [m rad^2] sum of the way, each part by the variance of the heading
        self._unknown_tilt = 1.0  # share of the IMU's tilt error that the soles have not told yet
        # odom lies where the robot stood when it was switched on, turned by the error of the first reading
        self._covariance = np.diag([0.0, 0.0, p.odometry_yaw_noise**2, p.odometry_yaw_drift**2])
        linear = (p.odometry_velocity_noise**2,) * 2 + (p.odometry_climb_noise**2,)
        self._twist = np.diag(linear + (p.odometry_rate_noise**2,) * 3)

    def begin(self, stamp: int, position: Point) -> None:
        """Start at a stamp [ns] with base_link at a position (2,) in odom [m]; later calls change nothing."""
        if self._stamp is None:
            self._stamp, self._position = stamp, position

    @property
    def uncertainty(self) -> Array:
        """(4, 4) covariance of x, y [m], yaw [rad] and its drift [rad/s] at the last step or start."""
        return self._covariance.copy()

    def continue_from(self, distance: float, uncertainty: Array, gap: float) -> None:
        """Go on from what another one has counted. In the meantime the robot may have walked, or fallen.

        Args:
            distance: Path length walked [m].
            uncertainty: (4, 4) of the other one.
            gap: Time since then [s].
        """
        p = self._parameters
        self.distance, self._covariance = distance, uncertainty.copy()
        self._covariance[:2, :2] += min(p.max_speed_forward * gap, p.odometry_fall_spread) ** 2 * np.eye(2)

    def step(
        self, stamp: int, position: Point, before: Sequence[Pose2D], after: Sequence[Pose2D], signs: SlipSigns
    ) -> None:
        """Add a step: the feet stand anew.

        Args:
            stamp: When the foot landed [ns].
            position: (x, y) of base_link in odom [m].
            before: Left and right foot as they stood, in odom.
            after: Left and right foot as they stand now.
            signs: Of slip, from the start to the landing.
        """
        p = self._parameters
        # The body moves half as far as a foot does.
        way = 0.5 * np.sum([(new.x - old.x, new.y - old.y) for old, new in zip(before, after, strict=True)], axis=0)
        self.distance += float(np.hypot(*way))
        self._covariance = self._extrapolated(stamp, position)
        self._covariance[:2, :2] += self._slip(signs, after[0].yaw) + p.odometry_step_noise**2 * np.eye(2)
        if self._stamp is not None:
            step_time = min(1e-9 * (stamp - self._stamp), LONGEST_STEP)
            self._unknown_tilt *= math.exp(-max(step_time - p.double_support_time, 0.0) / p.imu_bias_time)
        self._bent = self._bent_until(position)
        self._stamp, self._position, self._signs = stamp, position, signs

    def fall(self) -> None:
        """Say that the robot fell: where the referee's hands will set it up is known only roughly.

        The heading stays known, since the IMU goes on turning with the body.
        """
        self._covariance[:2, :2] += self._parameters.odometry_fall_spread**2 * np.eye(2)

    def pose_covariance(self, stamp: int, position: Array, yaw: float, signs: SlipSigns, lying: bool = False) -> Array:
        """Return the (6, 6) covariance of base_link's pose in odom: x, y, z [m], roll, pitch, yaw [rad].

        Args:
            stamp: [ns].
            position: (3,) of base_link in odom [m].
            yaw: Heading in odom [rad].
            signs: Of slip, from the start until now.
            lying: The feet may not be on the ground, so that the height is not known.
        """
        p = self._parameters
        planar = self._extrapolated(stamp, (float(position[0]), float(position[1])))[:3, :3]
        bent = self._bent_until((float(position[0]), float(position[1])))
        planar[:2, :2] += self._slip(signs, yaw) + 0.75 * np.outer(bent, bent)
        # |k R(yaw) b - b|^2 of a lean b of which a share k is still unknown: that turns with the body, the whole of it
        # put the start off; and the white noise of now and of the start
        unknown = self._unknown_tilt
        lean = (1.0 + unknown**2 - 2.0 * unknown * math.cos(yaw)) * p.odometry_tilt_bias**2
        lean += 2.0 * p.odometry_tilt_noise**2
        planar[0, 0] += lean * position[2] ** 2
        planar[1, 1] += lean * position[2] ** 2
        planar[YAW, YAW] += p.odometry_yaw_noise**2
        tilt = (unknown * p.odometry_tilt_bias) ** 2 + p.odometry_tilt_noise**2
        height = p.odometry_fall_spread if lying else p.odometry_height_noise
        covariance = np.diag([0.0, 0.0, height**2, tilt, tilt, 0.0])
        covariance[PLANE] = planar
        return covariance

    def _bent_until(self, position: Point) -> Point:
        variance, last = float(self._covariance[YAW, YAW]), self._position
        return self._bent[0] + variance * (position[0] - last[0]), self._bent[1] + variance * (position[1] - last[1])

    def _slip(self, signs: SlipSigns, yaw: float) -> Array:
        """Return the (2, 2) covariance [m^2] of what slipped since the last step, of a foot with this yaw [rad]."""
        p = self._parameters
        twist, flight = signs.twist - self._signs.twist, signs.flight - self._signs.flight
        along = (p.odometry_twist_slip_along * twist) ** 2
        across = (p.odometry_twist_slip_across * twist) ** 2
        hop = (p.odometry_flight_slip * flight) ** 2
        c, s = math.cos(yaw), math.sin(yaw)
        mixed = c * s * (along - across)
        return np.array(((c * c * along + s * s * across + hop, mixed), (mixed, s * s * along + c * c * across + hop)))

    def twist_covariance(self) -> Array:
        """Return the (6, 6) covariance of linear [(m/s)^2] and angular velocity [(rad/s)^2]."""
        return self._twist.copy()

    def _extrapolated(self, stamp: int, position: Point) -> Array:
        """Return the (4, 4) covariance of (x, y, yaw, drift) after the way since the last step, without new slip."""
        if self._stamp is None:
            return self._covariance.copy()
        dt = (stamp - self._stamp) * NANOSECOND
        dx, dy = position[0] - self._position[0], position[1] - self._position[1]
        transition = np.eye(4)
        transition[:2, YAW] = (-dy, dx)
        transition[:2, DRIFT] = (-0.5 * dy * dt, 0.5 * dx * dt)
        transition[YAW, DRIFT] = dt
        covariance: Array = transition @ self._covariance @ transition.T
        walk = self._parameters.odometry_yaw_walk**2 * abs(dt)
        covariance[YAW, YAW] += walk
        return covariance
