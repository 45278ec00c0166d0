"""What a referee sees by itself, in a trial and in a match alike: goals, balls that are out, robots that lie."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field, Goal
from tulip_strategy.interface import GamePhase

Array = NDArray[np.float64]
SECOND = 10**9  # [ns]


@dataclass(frozen=True)
class Verdict:
    """What a referee says about one robot at one instant.

    Attributes:
        outcome: How the trial ended, "" while it runs.
        score: Goals of the robot's own team and of the other.
        lying: Whether the robot lies on the ground.
        falls: How often it fell since the trial's start.
        played: Time since the beginning of play [s].
    """

    outcome: str
    score: tuple[int, int]
    lying: bool
    falls: int
    played: float


def phase_after(elapsed: float, initial: float, ready: float, set_up: float) -> GamePhase:
    """Return the phase of a trial that has not ended, by the time since its beginning and the lengths of phases [s]."""
    for phase, duration in ((GamePhase.INITIAL, initial), (GamePhase.READY, ready), (GamePhase.SET, set_up)):
        if elapsed < duration:
            return phase
        elapsed -= duration
    return GamePhase.PLAYING


def in_goal(ball: Array, goal: Goal, field: Field) -> bool:
    """Tell whether a ball is wholly over the goal line, between the posts and under the bar.

    Args:
        ball: (3,) its centre in map [m].
        goal: One of the field's.
        field: Played on.
    """
    x, y, z = (float(value) for value in ball)
    over = goal.outward * (x - goal.x) - field.ball_radius > 0.5 * field.line_width
    return over and goal.outward * x < goal.outward * goal.back and abs(y) < 0.5 * goal.width and z < goal.height


class OutWatch:
    """Notices when the ball goes wholly over an outer line, each time once.

    Attributes:
        count: How often it did.
    """

    def __init__(self, field: Field) -> None:
        self._field = field
        self._was_out = False
        self.count = 0

    def leaves(self, ball: Array) -> bool:
        """Tell whether the ball, whose centre is (3,) in map [m], has just gone out."""
        edge = self._field.ball_radius + 0.5 * self._field.line_width
        x, y = abs(float(ball[0])), abs(float(ball[1]))
        out = x > 0.5 * self._field.length + edge or y > 0.5 * self._field.width + edge
        leaves = out and not self._was_out
        self._was_out = out
        self.count += leaves
        return leaves


class FallWatch:
    """Knows since when a robot lies, and how often it fell.

    Attributes:
        since: Stamp from which on it has lain [ns], or None while it is up.
        falls: How often it went from upright to lying.
    """

    def __init__(self, lying_tilt: float) -> None:
        """Take a robot for lying whose trunk leans more than lying_tilt [rad]."""
        self._lying_tilt = lying_tilt
        self.since: int | None = None
        self.falls = 0

    def see(self, base_orientation: Array | Sequence[float], stamp: int) -> None:
        """Take the orientation (4,) x, y, z, w of base_link in map at a stamp [ns]."""
        x, y, _, _ = base_orientation
        upright = 1.0 - 2.0 * float(x * x + y * y)  # vertical part of the trunk's own z axis
        if math.acos(max(-1.0, min(1.0, upright))) <= self._lying_tilt:
            self.since = None
        elif self.since is None:
            self.since = stamp
            self.falls += 1

    def lift(self) -> None:
        """Somebody holds the robot: it does not lie, and does not fall."""
        self.since = None

    def lying_for(self, now: int) -> float:
        """Return for how long it has lain [s], 0 while it is up."""
        return 0.0 if self.since is None else (now - self.since) / SECOND
