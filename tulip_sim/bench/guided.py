"""A robot that walks from place to place, in lockstep: legs by a script, head as strategy moves it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.interface import MotionMode, WalkCommand, WalkMode
from tulip_sim.bench.strategy_gaze import StrategyGaze
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.scenario import Scenario

Array = NDArray[np.float64]
ARRIVED = 0.25  # [m] from a place, from where the next one is the goal
SPEED = 0.3  # [m/s]
TURN = 0.6  # [rad/s] at most
TURN_GAIN = 1.5  # [1/s] turning rate by the bearing of the goal
LIMP_TICKS = 8  # of legs without stiffness before they are lifted: commands come at 50 Hz
ASIDE = math.radians(50.0)  # a goal further aside is turned to before the robot walks


class GuidedWalk(Lockstep):
    """Walks to places one after the other by its own estimate of where it is, or stands.

    The head follows the ball and glances at landmarks where the gaze planner wants to.
    """

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
        settings = settings or Settings()
        super().__init__(scenario, seed, settings, belief=belief)
        self._gaze = StrategyGaze(settings.strategy, load_field())
        self._places = list(places)
        self._next = 0
        self._limp = False

    def compare(self) -> tuple[Pose2D, Pose2D, Array]:
        """Return base_footprint in map as it is and as it is believed to be, and the (3, 3) covariance of the belief.

        The truth is that of the belief's stamp: what the body moved since then is taken off.
        """
        world, truth = self.world_model.state(self.stamp), self.world.truth()
        late = (truth.stamp - world.stamp) * 1e-9
        there = truth.footprint
        vx, vy = truth.base_linear_velocity[:2].tolist()
        yaw = there.yaw - late * float(truth.base_angular_velocity[2])
        return Pose2D(there.x - late * vx, there.y - late * vy, yaw), world.robot.pose, world.robot.covariance

    def carry(self, target: Pose2D) -> None:
        """Let a person carry the robot elsewhere: legs limp, set down upright; nobody tells the robot."""
        self._limp = True
        for _ in range(LIMP_TICKS):
            self.step()
        self.world.set_upright(target)
        self._limp = False

    @property
    def fallen(self) -> bool:
        """Whether motion control has detected a fall."""
        return self.motion.mode is MotionMode.FALLEN

    def _decide(self, stamp: int) -> None:
        """Command the legs by the script, and the head."""
        world = self.world_model.state(stamp)
        self._head_command = self._gaze.command(stamp, world)
        if self._limp:
            self.motion.command(WalkCommand(stamp, WalkMode.LIMP))
            return
        velocity = self._velocity(world.robot.pose) if self._places else None
        mode = WalkMode.STAND if velocity is None else WalkMode.WALK
        self.motion.command(WalkCommand(stamp, mode, velocity or (0.0, 0.0, 0.0)))

    def _velocity(self, pose: Pose2D) -> tuple[float, float, float]:
        x, y = self._places[self._next]
        if math.hypot(x - pose.x, y - pose.y) < ARRIVED:
            self._next = (self._next + 1) % len(self._places)
            x, y = self._places[self._next]
        bearing = wrap_angle(math.atan2(y - pose.y, x - pose.x) - pose.yaw)
        forward = SPEED * math.cos(bearing) if abs(bearing) < ASIDE else 0.0
        return forward, 0.0, max(-TURN, min(TURN, TURN_GAIN * bearing))
