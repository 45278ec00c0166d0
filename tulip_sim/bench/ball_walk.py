"""A robot that watches a ball in lockstep while it stands or walks to and fro, and what the ball truly does."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import load_robot
from tulip_motion.interface import WalkCommand, WalkMode
from tulip_sim.bench.strategy_gaze import StrategyGaze
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.perception import Perception, PerceptionParameters
from tulip_sim.scenario import Scenario
from tulip_sim.timing import CAMERA_TICKS
from tulip_sim.truth import Truth
from tulip_strategy.behaviour.gaze import look_at_ball, track_ball
from tulip_vision.features import FeatureClass
from tulip_vision.lens import head_camera_lens
from tulip_worldmodel.world_state import ObjectEstimate, WorldState

Array = NDArray[np.float64]
REMEMBERED = 12  # ticks of truth: the world state is that of the newest odometry
PERIOD = 6.0  # [s] in which a walking robot goes forward, and back again
FORWARD, TURN, TURN_GAIN = 0.2, 0.3, 0.8  # [m/s], [rad/s] at most, [1/s] by the bearing of the ball


@dataclass(frozen=True)
class Comparison:
    """The ball as it is and as it is believed to be at one moment, in base_footprint.

    Attributes:
        time: Since the start [s].
        position, velocity: (2,) truly [m], [m/s] over the ground.
        believed: The estimate, or None while the ball is not known.
        state: The whole world state.
        visible: Whether the last picture showed the ball, found or not.
    """

    time: float
    position: Array
    velocity: Array
    believed: ObjectEstimate | None
    state: WorldState
    visible: bool

    @property
    def distance(self) -> float:
        """Range of the ball [m]."""
        return float(np.hypot(*self.position))


class BallWalk(Lockstep):
    """Stands, or walks forward and back and turns to the ball; the head tracks the ball as strategy does."""

    def __init__(self, scenario: Scenario, seed: int, settings: Settings, walks: bool, glances: bool = True) -> None:
        """Begin.

        Args:
            scenario: What stands where.
            seed: Of everything random.
            settings: Parameters of all cores.
            walks: Whether the robot walks.
            glances: Whether the head looks at landmarks now and then.
        """
        super().__init__(scenario, seed, settings)
        self._walks = walks
        self._look = track_ball if glances else look_at_ball
        self._gaze = StrategyGaze(settings.strategy, load_field())
        self._judge = Perception(
            PerceptionParameters.ideal(), load_field(), load_robot(), head_camera_lens(), settings.camera
        )
        self._truths: deque[Truth] = deque(maxlen=REMEMBERED)
        self.ball_visible = False

    def step(self) -> None:
        """Advance by one control tick."""
        truth = self.world.truth()
        self._truths.append(truth)
        if self._tick % CAMERA_TICKS == 0:
            self.ball_visible = any(each.kind is FeatureClass.BALL for each in self._judge.in_view(truth))
        super().step()

    def go(self, until: float) -> None:
        """Advance to a time [s]."""
        while self.stamp < until * 1e9:
            self.step()

    def compare(self) -> Comparison:
        """Return the ball as it is and as the world model has it."""
        state = self.world_model.state(self.stamp)
        truth = min(self._truths, key=lambda each: abs(each.stamp - state.stamp))
        robot = truth.footprint
        position = np.array(robot.inverse().transform(truth.ball_position[:2]))
        velocity = robot.rotation().T @ truth.ball_linear_velocity[:2]
        return Comparison(state.stamp * 1e-9, position, velocity, state.ball, state, self.ball_visible)

    def _decide(self, stamp: int) -> None:
        """Command the legs by the script, and the head."""
        world = self.world_model.state(stamp)
        self._head_command = self._gaze.command(stamp, world, self._look)
        if not self._walks:
            self.motion.command(WalkCommand(stamp, WalkMode.STAND))
            return
        bearing = 0.0 if world.ball is None else math.atan2(*world.ball.position[1::-1])
        forward = FORWARD if (stamp * 1e-9) % PERIOD < PERIOD / 2.0 else -FORWARD
        turn = max(-TURN, min(TURN, TURN_GAIN * wrap_angle(bearing)))
        self.motion.command(WalkCommand(stamp, WalkMode.WALK, (forward, 0.0, turn)))


def before_robot(robot: Pose2D, distance: float, bearing: float) -> tuple[float, float]:
    """Return the place (x, y) in map at a distance [m] and bearing [rad] from a robot."""
    return robot.transform((distance * math.cos(bearing), distance * math.sin(bearing)))
