"""A robot on the field with motion control alone, for benches of walking and kicking."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from tulip_description.planar import Pose2D
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_motion.interface import MotionMode, WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.timing import TICK
from tulip_sim.world import World


class Body:
    """World and motion control, with the tick of delay that the graph has. Friction, masses and sensors are random."""

    def __init__(
        self,
        seed: int,
        robot: Pose2D,
        ball: tuple[float, float] = (0.0, -2.5),
        parameters: MotionParameters | None = None,
        world: WorldParameters | None = None,
        true_body: Robot | None = None,
        believed: Robot | None = None,
    ) -> None:
        """Put a robot on the field.

        Args:
            seed: Of everything random.
            robot: Where base_link stands, seen from above.
            ball: Where the ball lies [m].
            parameters: Of motion control.
            world: Physics and sensors.
            true_body: Whose masses, CoMs and inertias the robot really has; None for those of the robot file.
            believed: What motion control takes the robot for; None for what the robot file says.
        """
        scenario = Scenario(robot=robot, ball=ball, poles=False)
        self.world = World(scenario, world or WorldParameters(), seed, true_body=true_body)
        self.motion = Motion(parameters or MotionParameters(), believed or self.world.robot)
        self.greatest_tilt = 0.0  # [rad]
        self.greatest_efforts = np.zeros(14)  # [N m]
        self.greatest_speeds = np.zeros(14)  # [rad/s]
        self.ball_speed = 0.0  # [m/s] greatest so far
        self.ball_direction = 0.0  # [rad] at that speed, in map
        self._pending: JointCommand | None = None

    @property
    def fallen(self) -> bool:
        """Whether motion control has detected a fall."""
        return self.motion.mode is MotionMode.FALLEN

    def tick(self, command: WalkCommand) -> None:
        """Advance by one control tick."""
        self.motion.command(command)
        sensors = self.world.sensors()
        answer = self.motion.tick(sensors)
        if self._pending is not None:
            self.world.apply(self._pending)
        self._pending = answer
        self.world.advance(TICK)
        truth = self.world.truth()
        x, y = float(truth.base_orientation[0]), float(truth.base_orientation[1])
        self.greatest_tilt = max(self.greatest_tilt, math.acos(min(1.0, 1.0 - 2.0 * (x * x + y * y))))
        self.greatest_efforts = np.maximum(self.greatest_efforts, np.abs(sensors.joint_efforts))
        self.greatest_speeds = np.maximum(self.greatest_speeds, np.abs(sensors.joint_velocities))
        speed = math.hypot(float(truth.ball_linear_velocity[0]), float(truth.ball_linear_velocity[1]))
        if speed > self.ball_speed:
            self.ball_speed = speed
            self.ball_direction = math.atan2(float(truth.ball_linear_velocity[1]), float(truth.ball_linear_velocity[0]))

    def stall(self, command: WalkCommand, milliseconds: int, waiting: int) -> None:
        """Let time pass without motion control, which then answers at once the newest readings that wait for it.

        Args:
            command: That it has then.
            milliseconds: How long.
            waiting: How many readings wait; older ones are lost.
        """
        readings: deque[Sensors] = deque(maxlen=waiting)
        for _ in range(milliseconds // TICK):
            readings.append(self.world.sensors())
            self.world.advance(TICK)
        self.motion.command(command)
        for reading in readings:
            self._pending = self.motion.tick(reading)

    def go(self, seconds: float, velocity: tuple[float, float, float] | None = None) -> None:
        """Walk with a velocity, or stand, for a time [s], or until the robot falls."""
        mode = WalkMode.STAND if velocity is None else WalkMode.WALK
        command = WalkCommand(0, mode, velocity or (0.0, 0.0, 0.0))
        for _ in range(round(seconds * 1000 / TICK)):
            if self.fallen:
                return
            self.tick(command)
