"""Paths of a foot through the air, made of pieces: the moves of a kick, and smooth ways from any state."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tulip_motion.gait import FootMotion

Array = NDArray[np.float64]
"""(4,) here: x, y, z of the sole in odom [m] and its yaw [rad]."""


def cosine_profile(time: float, duration: float) -> tuple[float, float, float]:
    """Return progress, rate and acceleration of a move whose speed follows 1 - cos(2 pi t / T).

    Progress goes from 0 to 1; speed and acceleration are zero at both ends; the peak speed is 2 / T.
    """
    t = min(max(time, 0.0), duration)
    w = 2.0 * math.pi / duration
    return (t - math.sin(w * t) / w) / duration, (1.0 - math.cos(w * t)) / duration, w * math.sin(w * t) / duration


class Profile(Enum):
    """Which part of the cosine profile a move follows."""

    WHOLE = "from rest to rest"
    FIRST_HALF = "from rest to full speed"
    SECOND_HALF = "from full speed to rest"


class Piece(Protocol):
    """A piece of a path."""

    @property
    def duration(self) -> float:
        """[s]."""

    def evaluate(self, time: float) -> FootMotion:
        """Return the foot's reference at a time from 0 to the duration [s]."""


@dataclass(frozen=True)
class Move:
    """A straight way with a cosine velocity profile.

    Attributes:
        start, end: (4,) x, y, z, yaw [m], [rad].
        duration: [s]. With half a profile the greatest speed is 2 |end - start| / duration.
        profile: See `Profile`.
    """

    start: Array
    end: Array
    duration: float
    profile: Profile = Profile.WHOLE

    def evaluate(self, time: float) -> FootMotion:
        """Return the foot's reference at a time from 0 to the duration [s]."""
        if self.profile is Profile.WHOLE:
            progress, rate, acceleration = cosine_profile(time, self.duration)
        else:
            late = self.profile is Profile.SECOND_HALF
            half = cosine_profile(time + (self.duration if late else 0.0), 2.0 * self.duration)
            progress, rate, acceleration = 2.0 * half[0] - (1.0 if late else 0.0), 2.0 * half[1], 2.0 * half[2]
        way = self.end - self.start
        return foot_motion(self.start + progress * way, rate * way, acceleration * way)


class Quintic:
    """The smoothest way (least jerk) from a foot's state to a place and speed there, in a given time."""

    def __init__(self, foot: FootMotion, end: Array, end_velocity: Array, duration: float) -> None:
        """Lay the way.

        Args:
            foot: Where it begins, in motion or not.
            end: (4,) x, y, z, yaw [m], [rad].
            end_velocity: (4,) [m/s], [rad/s]; the acceleration there is zero.
            duration: [s].
        """
        self.duration = t = duration
        self.end = end
        position, velocity, acceleration = (_four(foot, order) for order in range(3))
        # What the cubic to quintic terms have to add to place, speed and acceleration at the end, times t^0, t^1, t^2.
        way = end - position - velocity * t - 0.5 * acceleration * t**2
        speed = (end_velocity - velocity - acceleration * t) * t
        bend = -acceleration * t**2
        self._coefficients = (
            position,
            velocity,
            0.5 * acceleration,
            (10.0 * way - 4.0 * speed + 0.5 * bend) / t**3,
            (-15.0 * way + 7.0 * speed - bend) / t**4,
            (6.0 * way - 3.0 * speed + 0.5 * bend) / t**5,
        )

    def evaluate(self, time: float) -> FootMotion:
        """Return the foot's reference at a time from 0 to the duration [s]."""
        t = min(max(time, 0.0), self.duration)
        c = self._coefficients
        return foot_motion(
            sum((c[i] * t**i for i in range(1, 6)), start=c[0]),
            sum((i * c[i] * t ** (i - 1) for i in range(2, 6)), start=c[1]),
            sum((i * (i - 1) * c[i] * t ** (i - 2) for i in range(3, 6)), start=2.0 * c[2]),
        )


def brake(foot: FootMotion, duration: float) -> Quintic:
    """Return the way to rest that is as long as at half the present speed: short when the foot is slow."""
    return Quintic(foot, _four(foot, 0) + 0.5 * duration * _four(foot, 1), np.zeros(4), duration)


class FootPath:
    """Pieces one after the other; past the end the foot goes on down until it meets the ground."""

    def __init__(self, pieces: Sequence[Piece], landing_speed: float) -> None:
        """Join pieces.

        Args:
            pieces: In their order; the last ends on the ground.
            landing_speed: Speed downwards past the end [m/s].
        """
        self._pieces = tuple(pieces)
        self._landing_speed = landing_speed
        self.duration = sum(piece.duration for piece in pieces)

    def evaluate(self, time: float) -> FootMotion:
        """Return the foot's reference at a time since the path's beginning [s]."""
        for piece in self._pieces:
            if time <= piece.duration:
                return piece.evaluate(time)
            time -= piece.duration
        last = self._pieces[-1]
        end = last.evaluate(last.duration)
        x, y, z = end.position
        down = -self._landing_speed
        return FootMotion((x, y, z + time * down), (0.0, 0.0, down), (0.0, 0.0, 0.0), end.yaw)


def foot_motion(position: Array, velocity: Array, acceleration: Array) -> FootMotion:
    """Return a foot's reference from (4,) x, y, z, yaw and their derivatives."""
    (x, y, z, yaw), (vx, vy, vz, rate), (ax, ay, az, bend) = position.tolist(), velocity.tolist(), acceleration.tolist()
    return FootMotion((x, y, z), (vx, vy, vz), (ax, ay, az), yaw, rate, bend)


def _four(foot: FootMotion, order: int) -> Array:
    """Return (4,) x, y, z, yaw of a foot's reference, or their first or second derivative."""
    linear = (foot.position, foot.velocity, foot.acceleration)[order]
    return np.array([*linear, (foot.yaw, foot.yaw_rate, foot.yaw_acceleration)[order]])
