"""What a gait asks of the body at one instant, and the swing foot's path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import Side, Support

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
"""A point or its derivative in plain numbers, since much is reckoned from it."""


class FootMotion(NamedTuple):
    """Pose of a sole in odom with its derivatives; the sole stays level.

    Attributes:
        position, velocity, acceleration: (x, y, z) [m], [m/s], [m/s^2].
        yaw, yaw_rate, yaw_acceleration: [rad], [rad/s], [rad/s^2].
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    yaw: float
    yaw_rate: float = 0.0
    yaw_acceleration: float = 0.0

    @staticmethod
    def resting(pose: Pose2D) -> FootMotion:
        """Return a foot that stands on the ground."""
        return FootMotion((pose.x, pose.y, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), pose.yaw)


class ComMotion(NamedTuple):
    """Planned horizontal motion of the CoM in odom.

    Attributes:
        position, velocity, acceleration: (2,) [m], [m/s], [m/s^2].
    """

    position: Array
    velocity: Array
    acceleration: Array


class Reference(NamedTuple):
    """What the gait wants now, in odom.

    Attributes:
        support: Which feet carry.
        stance: The foot that all tasks are relative to.
        other: The other foot: swinging, or standing as well.
        zmp, dcm: (2,) planned [m].
        torso_yaw, torso_yaw_rate: [rad], [rad/s].
        phase: Progress of the step or kick, 0 to 1.
        com: What the CoM follows in open loop; without it, it is led by the feedback of the ZMP.
        torso_yaw_acceleration: [rad/s^2].
        torso_held: The joints hold the torso upright, against a leg that kicks; else it may lean for balance.
    """

    support: Support
    stance: Footstep
    other: FootMotion
    zmp: tuple[float, float]
    dcm: tuple[float, float]
    torso_yaw: float
    torso_yaw_rate: float
    phase: float
    com: ComMotion | None = None
    torso_yaw_acceleration: float = 0.0
    torso_held: bool = False

    @property
    def other_standing(self) -> Footstep | None:
        """The other foot as it stands, or None while it swings."""
        if self.support is not Support.DOUBLE:
            return None
        x, y, _ = self.other.position
        return Footstep(self.stance.side.other, Pose2D(x, y, self.other.yaw))


def support_on(side: Side) -> Support:
    """Return single support on a foot."""
    return Support.LEFT if side is Side.LEFT else Support.RIGHT


def sole_point(foot: Footstep, forward: float, inward: float) -> tuple[float, float]:
    """Return a point of a sole in odom [m]; `inward` points to the other foot."""
    return foot.pose.transform((forward, -inward if foot.side is Side.LEFT else inward))


def between_soles(feet: tuple[Footstep, Footstep], forward: float, inward: float) -> tuple[float, float]:
    """Return the middle between the same point of both soles in odom [m]: where a standing robot has its ZMP."""
    left, right = (sole_point(foot, forward, inward) for foot in feet)
    return (left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0


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
        # 60 (target - x) / t^3 - 36 v / t^2 - 9 a / t
        per_t = 1.0 / remaining
        jerk = (
            (60.0 * (target - self.position) * per_t - 36.0 * self.velocity) * per_t - 9.0 * self.acceleration
        ) * per_t
        self.position += dt * (self.velocity + dt * (self.acceleration / 2.0 + dt * jerk / 6.0))
        self.velocity += dt * (self.acceleration + dt * jerk / 2.0)
        self.acceleration += dt * jerk

    def overshoots_zero(self, duration: float) -> bool:
        """Return whether the quintic from here to rest at 0 in a time [s] passes through 0 before it arrives.

        With s = t / T it is (1 - s)^3 (x + (3 x + v T) s + (6 x + 3 v T + a T^2 / 2) s^2).
        """
        x, way = self.position, self.velocity * duration
        linear, square = 3.0 * x + way, 6.0 * x + 3.0 * way + 0.5 * self.acceleration * duration**2
        lowest = min(max(-0.5 * linear / square, 0.0), 1.0) if square > 0.0 else 1.0
        return x + (linear + square * lowest) * lowest < 0.0


SHORTEST_DESCENT = 0.04  # [s] shorter, what is left of a millimetre would ask for endless jerk


class SwingTrack:
    """Where a swing foot is, seen from above, on its way to a landing place that may move."""

    def __init__(self, start: Pose2D) -> None:
        """Begin at rest.

        Args:
            start: Where the foot stands.
        """
        self._axes = (MinimumJerk(start.x), MinimumJerk(start.y), MinimumJerk(start.yaw))

    @property
    def place(self) -> tuple[float, float]:
        """(x, y) of the sole now, in odom [m]."""
        return self._axes[0].position, self._axes[1].position

    def advance(self, target: Pose2D, remaining: float, dt: float) -> None:
        """Advance by dt [s] towards a target that is to be reached in `remaining` [s]; the yaw takes the short way."""
        x, y, yaw = self._axes
        x.advance(target.x, remaining, dt)
        y.advance(target.y, remaining, dt)
        yaw.advance(yaw.position + wrap_angle(target.yaw - yaw.position), remaining, dt)

    def follow(self, foot: FootMotion) -> None:
        """Take the foot to be where another path leads it."""
        for axis, *state in zip(self._axes, foot.position, foot.velocity, foot.acceleration, strict=False):
            axis.position, axis.velocity, axis.acceleration = state
        yaw = self._axes[2]
        yaw.position, yaw.velocity, yaw.acceleration = foot.yaw, foot.yaw_rate, foot.yaw_acceleration

    def at_height(self, z: float, speed: float, acceleration: float) -> FootMotion:
        """Return the foot's reference now, with the sole's height [m], its derivative and the second one."""
        x, y, yaw = self._axes
        return FootMotion(
            (x.position, y.position, z),
            (x.velocity, y.velocity, speed),
            (x.acceleration, y.acceleration, acceleration),
            yaw.position,
            yaw.velocity,
            yaw.acceleration,
        )


class SwingFoot:
    """Path of the swing foot from where it stood to a landing whose place and time may still move."""

    def __init__(self, start: Pose2D, duration: float, height: float, landing_speed: float) -> None:
        """Begin a swing.

        Args:
            start: Where the foot stands.
            duration: Time until it lands, as planned [s].
            height: Greatest height of the sole [m].
            landing_speed: Speed downwards when the ground has not come at the end [m/s].
        """
        self._track = SwingTrack(start)
        self._vertical = MinimumJerk(0.0)
        self._rise_time = 0.5 * duration
        self._rises = True
        self._height = height
        self._landing_speed = landing_speed
        self._time = 0.0

    @property
    def place(self) -> tuple[float, float]:
        """(x, y) of the sole now, in odom [m]."""
        return self._track.place

    def advance(self, target: Pose2D, remaining: float, dt: float) -> FootMotion:
        """Advance by dt [s] towards a target that is to be reached in `remaining` [s], and return the reference."""
        self._track.advance(target, remaining, dt)
        z = self._vertical
        rising = self._rise_time - self._time
        # A landing that was brought forward ends the rise, for good: coming down takes as long as going up.
        self._rises = self._rises and rising > dt and remaining > self._rise_time
        if remaining <= dt:
            z.position -= self._landing_speed * dt
            z.velocity, z.acceleration = -self._landing_speed, 0.0
        elif self._rises:
            z.advance(self._height, rising, dt)
        else:
            # When the landing is put off on the way down, a path that slow would first dip into the ground.
            down = remaining
            while down > SHORTEST_DESCENT and z.overshoots_zero(down):
                down -= dt
            z.advance(0.0, down, dt)
        self._time += dt
        return self._track.at_height(z.position, z.velocity, z.acceleration)
