"""The way of two joints to a goal that may move: limited in position, speed and acceleration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class HeadTrajectory:
    """Where the head's joints shall be, and how fast they shall move there.

    Attributes:
        position: (2,) [rad].
        velocity: (2,) [rad/s].
    """

    def __init__(self, lower: Array, upper: Array, acceleration: float) -> None:
        """Begin at rest at zero.

        Args:
            lower: (2,) limits of the joints [rad].
            upper: Likewise.
            acceleration: Largest [rad/s^2].
        """
        self._lower, self._upper = lower, upper
        self._acceleration = acceleration
        self.position = np.clip(np.zeros(2), lower, upper)
        self.velocity = np.zeros(2)

    def begin(self, position: Array) -> None:
        """Begin anew at rest at a position (2,) [rad], brought into the limits."""
        self.position = np.clip(np.asarray(position, dtype=np.float64), self._lower, self._upper)
        self.velocity = np.zeros(2)

    def stopping_place(self) -> Array:
        """Return (2,) where the joints come to rest if they brake now [rad]."""
        place: Array = self.position + self.velocity * np.abs(self.velocity) / (2.0 * self._acceleration)
        return place

    def advance(self, goal: Array, goal_velocity: Array, speed: Array, duration: float) -> None:
        """Move for a while: as fast as allowed, and always able to stop at the goal and inside the limits.

        The speed v from which a joint can still stop on a distance d after a step of dt satisfies
        v dt + v^2 / (2 a) = d. Seen from a goal that moves with w, the joint brakes the difference of both speeds.

        Args:
            goal: (2,) where the joints shall be now [rad].
            goal_velocity: (2,) at which the goal moves on [rad/s].
            speed: (2,) largest of the joints [rad/s].
            duration: [s]; nothing happens if it is not positive.
        """
        if duration <= 0.0:
            return
        a = self._acceleration
        inside = np.clip(goal, self._lower, self._upper)
        follow = np.where(inside == goal, goal_velocity, 0.0)
        distance = inside - follow * duration - self.position  # to where it was: both move on by the step
        wanted = follow + np.sign(distance) * self._stoppable(np.abs(distance), duration)
        wanted = np.clip(wanted, -speed, speed)
        wanted = np.clip(
            wanted,
            -self._stoppable(self.position - self._lower, duration),
            self._stoppable(self._upper - self.position, duration),
        )
        change = np.clip(wanted - self.velocity, -a * duration, a * duration)
        self.velocity = self.velocity + change
        self.position = np.clip(self.position + self.velocity * duration, self._lower, self._upper)

    def _stoppable(self, distance: Array, duration: float) -> Array:
        a = self._acceleration
        speed: Array = np.sqrt((a * duration) ** 2 + 2.0 * a * np.maximum(distance, 0.0)) - a * duration
        return speed


def travel_time(distance: Array, speed: float, acceleration: float) -> Array:
    """Return the time from rest to rest over distances (any shape) [rad] with limited speed and acceleration [s]."""
    whole = np.abs(distance)
    ramp = speed**2 / acceleration  # [rad] of speeding up and braking together
    long = whole / speed + speed / acceleration
    short = 2.0 * np.sqrt(whole / acceleration)
    time: Array = np.where(whole >= ramp, long, short)
    return time
