"""What a gait asks of the body at one instant, and the swing foot's path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import Side, Support

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FootMotion:
    """Pose of a sole in odom with its derivatives; the sole stays level.

    Attributes:
        position, velocity, acceleration: (3,) [m], [m/s], [m/s^2].
        yaw, yaw_rate, yaw_acceleration: [rad], [rad/s], [rad/s^2].
    """

    position: Array
    velocity: Array
    acceleration: Array
    yaw: float
    yaw_rate: float = 0.0
    yaw_acceleration: float = 0.0

    @staticmethod
    def resting(pose: Pose2D) -> FootMotion:
        """Return a foot that stands on the ground."""
        return FootMotion(np.array([pose.x, pose.y, 0.0]), np.zeros(3), np.zeros(3), pose.yaw)


@dataclass(frozen=True)
class Reference:
    """What the gait wants now, in odom.

    Attributes:
        support: Which feet carry.
        stance: The foot that all tasks are relative to.
        other: The other foot: swinging, or standing as well.
        zmp, dcm: (2,) planned [m].
        torso_yaw, torso_yaw_rate: [rad], [rad/s].
        phase: Progress of the step or kick, 0 to 1.
        torso_yaw_acceleration: [rad/s^2].
    """

    support: Support
    stance: Footstep
    other: FootMotion
    zmp: tuple[float, float]
    dcm: tuple[float, float]
    torso_yaw: float
    torso_yaw_rate: float
    phase: float
    torso_yaw_acceleration: float = 0.0


def support_on(side: Side) -> Support:
    """Return single support on a foot."""
    return Support.LEFT if side is Side.LEFT else Support.RIGHT


def sole_point(foot: Footstep, forward: float, inward: float) -> tuple[float, float]:
    """Return a point of a sole in odom [m]; `inward` points to the other foot."""
    return foot.pose.transform((forward, -inward if foot.side is Side.LEFT else inward))


class MinimumJerk:
    """One coordinate steered to a target that may move, arriving at rest with minimum jerk.

    Each tick applies the first instant of the quintic that leads from the present state to the target
    in the time that remains: with a fixed target the path is that quintic.
    """

    def __init__(self, position: float) -> None:
        self.position = position
        self.velocity = 0.0
        self.acceleration = 0.0

    def advance(self, target: float, remaining: float, dt: float) -> None:
        """Advance by dt [s] towards a target that is to be reached in `remaining` [s]."""
        if remaining <= dt:
            # The quintic's jerk grows without bound at its end; what is left is below a millimetre.
            self.velocity = self.acceleration = 0.0
            return
        t = remaining
        jerk = 60.0 * (target - self.position) / t**3 - 36.0 * self.velocity / t**2 - 9.0 * self.acceleration / t
        self.position += dt * (self.velocity + dt * (self.acceleration / 2.0 + dt * jerk / 6.0))
        self.velocity += dt * (self.acceleration + dt * jerk / 2.0)
        self.acceleration += dt * jerk


class SwingFoot:
    """Path of the swing foot from where it stood to a landing place that may still move."""

    def __init__(self, start: Pose2D, duration: float, height: float, landing_speed: float) -> None:
        """Begin a swing.

        Args:
            start: Where the foot stands.
            duration: Time until it lands [s].
            height: Greatest height of the sole [m].
            landing_speed: Speed downwards when the ground has not come at the end [m/s].
        """
        self._axes = (MinimumJerk(start.x), MinimumJerk(start.y), MinimumJerk(start.yaw))
        self._duration = duration
        self._height = height
        self._landing_speed = landing_speed
        self._time = 0.0

    def advance(self, target: Pose2D, dt: float) -> FootMotion:
        """Advance by dt [s] and return the foot's reference."""
        x, y, yaw = self._axes
        remaining = self._duration - self._time
        x.advance(target.x, remaining, dt)
        y.advance(target.y, remaining, dt)
        yaw.advance(yaw.position + wrap_angle(target.yaw - yaw.position), remaining, dt)
        self._time += dt
        z, dz, ddz = self._vertical()
        return FootMotion(
            np.array([x.position, y.position, z]),
            np.array([x.velocity, y.velocity, dz]),
            np.array([x.acceleration, y.acceleration, ddz]),
            yaw.position,
            yaw.velocity,
            yaw.acceleration,
        )

    def _vertical(self) -> tuple[float, float, float]:
        late = self._time - self._duration
        if late > 0.0:
            return -self._landing_speed * late, -self._landing_speed, 0.0
        rate = 2.0 * math.pi / self._duration
        angle = rate * self._time
        half = 0.5 * self._height
        return half * (1.0 - math.cos(angle)), half * rate * math.sin(angle), half * rate**2 * math.cos(angle)
