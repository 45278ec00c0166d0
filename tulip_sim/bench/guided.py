"""A robot that walks from place to place and looks round, in lockstep: all but strategy, which is a script."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.interface import HeadCommand, HeadMode, WalkCommand, WalkMode
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.scenario import Scenario

Array = NDArray[np.float64]
ARRIVED = 0.25  # [m] from a place, from where the next one is the goal
SPEED = 0.3  # [m/s]
TURN = 0.6  # [rad/s] at most
TURN_GAIN = 1.5  # [1/s] turning rate by the bearing of the goal
ASIDE = math.radians(50.0)  # a goal further aside is turned to before the robot walks


class GuidedWalk(Lockstep):
    """Walks to places one after the other by its own estimate of where it is, or stands; the head sweeps the field."""

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        places: Sequence[tuple[float, float]],
        settings: Settings | None = None,
        belief: Pose2D | None = None,
    ) -> None:
        """Begin.

        Args:
            scenario: What stands where.
            seed: Of everything random.
            places: Where to go, again and again, x and y in map [m]; none to stand.
            settings: Parameters of all cores.
            belief: Where the robot is told to stand; None for where it stands.
        """
        super().__init__(scenario, seed, settings, belief=belief)
        self._places = list(places)
        self._next = 0

    @property
    def estimate(self) -> tuple[Pose2D, Array]:
        """base_footprint in map as believed now, with its (3, 3) covariance."""
        robot = self.world_model.state(self.stamp).robot
        return robot.pose, robot.covariance

    def error(self) -> Array:
        """Return (3,) believed minus true pose: x, y [m], yaw [rad]."""
        pose, truth = self.estimate[0], self.world.truth().footprint
        return np.array([pose.x - truth.x, pose.y - truth.y, wrap_angle(pose.yaw - truth.yaw)])

    def _decide(self, stamp: int) -> None:
        """Command legs and head by the script."""
        velocity = self._velocity(self.world_model.state(stamp).robot.pose) if self._places else None
        mode = WalkMode.STAND if velocity is None else WalkMode.WALK
        self.motion.command(WalkCommand(stamp, mode, velocity or (0.0, 0.0, 0.0)))
        self._head_command = HeadCommand(stamp, HeadMode.SEARCH)

    def _velocity(self, pose: Pose2D) -> tuple[float, float, float]:
        x, y = self._places[self._next]
        if math.hypot(x - pose.x, y - pose.y) < ARRIVED:
            self._next = (self._next + 1) % len(self._places)
            x, y = self._places[self._next]
        bearing = wrap_angle(math.atan2(y - pose.y, x - pose.x) - pose.yaw)
        forward = SPEED * math.cos(bearing) if abs(bearing) < ASIDE else 0.0
        return forward, 0.0, max(-TURN, min(TURN, TURN_GAIN * bearing))
