"""Head movement: search, look at a point, track a ball that rolls, glance where the gaze planner asks for it.

Each mode chooses where the two joints shall be; one trajectory with limited speed and acceleration leads there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.positive import check_positive
from tulip_description.robot import HEAD_JOINTS, Robot
from tulip_description.robot_io import JointCommand
from tulip_motion.head_geometry import HeadGeometry
from tulip_motion.head_trajectory import HeadTrajectory
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_motion.moving_target import MovingTarget
from tulip_motion.search_pattern import SearchPattern

Array = NDArray[np.float64]

LOOK_AHEAD = 5_000_000  # [ns] over which the velocity of the joints that follow a target is taken


@dataclass(frozen=True)
class HeadParameters:
    """Parameters of head movement."""

    speed: float = 4.0  # [rad/s] of both joints when looking at a point
    search_speed: float = 1.5  # [rad/s] 6 deg from picture to picture at 15 Hz: ten pictures of each place
    acceleration: float = 30.0  # [rad/s^2] 0.1 N m for a head of 0.003 kg m^2: the trunk does not feel it
    limit_margin: float = 0.02  # [rad] kept from the joints' stops
    search_pan: float = 2.38  # [rad] to both sides: the joint's range but for limit_margin
    search_tilt_far: float = 0.38  # [rad] down: a picture 59 deg high reaches from 1 m to the horizon
    search_tilt_near: float = 1.15  # [rad] down: from the ball at the toes to 1.3 m, where the other row has begun
    near_distance: float = 1.2  # [m] a target lost nearer than this is searched near first
    arrived: float = 0.03  # [rad] from the end of a sweep, where the next one begins
    lead: float = 0.03  # [s] the joints are behind their commands: a tick of 20 ms, and the driver's
    longest_gap: float = 0.2  # [s] between commands over which a target's velocity holds: ten of them
    greatest_target_speed: float = 8.0  # [m/s] a ball kicked hard, seen from a robot that walks
    stiffness: float = 30.0  # [N m/rad] gravity (0.12 N m at most) bends it by 0.2 deg
    damping: float = 0.6  # [N m s/rad] critical for a head of 0.003 kg m^2
    longest_step: float = 0.1  # [s] after a longer pause the trajectory begins anew where the joints are

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        check_positive(self)
        if self.search_tilt_near <= self.search_tilt_far:
            raise ValueError(
                f"search_tilt_near is {self.search_tilt_near} rad; expected more than search_tilt_far,"
                f" {self.search_tilt_far} rad"
            )


class HeadMovement:
    """Turns head commands into joint commands for HEAD_JOINTS."""

    def __init__(self, parameters: HeadParameters, robot: Robot) -> None:
        """Prepare for a robot.

        Args:
            parameters: See `HeadParameters`.
            robot: A robot with a head; it is taken to stand upright in its standing posture.

        Raises:
            ValueError: if the robot has no head.
        """
        p = self._parameters = parameters
        self._geometry = HeadGeometry(robot, p.limit_margin)
        self._trajectory = HeadTrajectory(self._geometry.lower, self._geometry.upper, p.acceleration)
        self._target = MovingTarget(p.longest_gap, p.greatest_target_speed)
        self._pattern = SearchPattern(
            min(p.search_pan, -float(self._geometry.lower[0]), float(self._geometry.upper[0])),
            (p.search_tilt_far, p.search_tilt_near),
            p.arrived,
        )
        self._stamp: int | None = None
        self._sequence = 0
        self._mode: HeadMode | None = None
        self._last_target: tuple[float, float, float] | None = None

    def update(self, stamp: int, command: HeadCommand, head_positions: Array) -> JointCommand:
        """Advance to a moment.

        Args:
            stamp: Of the joint positions [ns].
            command: What to look at; it holds until another one comes.
            head_positions: (2,) measured pan and tilt [rad].

        Returns:
            The command for HEAD_JOINTS.
        """
        p, trajectory = self._parameters, self._trajectory
        duration = 0.0 if self._stamp is None else (stamp - self._stamp) * 1e-9
        if self._stamp is None or not 0.0 <= duration <= p.longest_step:
            trajectory.begin(head_positions)
            duration = 0.0
        self._stamp = stamp
        if command.mode is not self._mode:
            self._mode = command.mode
            if command.mode is HeadMode.SEARCH:
                self._pattern.begin(self._last_target or command.target, p.near_distance)
        goal, goal_velocity, speed = self._goal(stamp, command)
        trajectory.advance(goal, goal_velocity, np.minimum(speed, self._geometry.fastest), duration)
        self._sequence += 1
        return JointCommand(
            sequence=self._sequence,
            stamp=stamp,
            names=HEAD_JOINTS,
            position=trajectory.position.copy(),
            velocity=trajectory.velocity.copy(),
            effort=np.zeros(2),
            stiffness=np.full(2, p.stiffness),
            damping=np.full(2, p.damping),
        )

    def limp(self, stamp: int, head_positions: Array) -> JointCommand:
        """Return the command that leaves the joints alone; the next `update` begins where they are then.

        Args:
            stamp: Of the joint positions [ns].
            head_positions: (2,) measured pan and tilt [rad].
        """
        self._stamp = None
        self._sequence += 1
        zero = np.zeros(2)
        return JointCommand(self._sequence, stamp, HEAD_JOINTS, head_positions, zero, zero, zero, zero)

    def _goal(self, stamp: int, command: HeadCommand) -> tuple[Array, Array, float]:
        """Return where the joints shall go, how that moves on, and how fast they may go there."""
        p, still = self._parameters, np.zeros(2)
        if command.mode is HeadMode.HOLD:
            return self._trajectory.stopping_place(), still, p.speed
        if command.mode is HeadMode.SEARCH:
            return self._pattern.goal(self._trajectory.position), still, p.search_speed
        self._last_target = command.target
        self._target.see(command.stamp, command.target)
        if command.mode is HeadMode.TRACK and command.glance is not None:
            return self._geometry.angles_towards(command.glance), still, p.speed
        lead = round(p.lead * 1e9)
        goal = self._geometry.angles_towards(self._target.at(stamp + lead))
        soon = self._geometry.angles_towards(self._target.at(stamp + lead + LOOK_AHEAD))
        goal_velocity = np.clip((soon - goal) / (LOOK_AHEAD * 1e-9), -p.speed, p.speed)
        return goal, goal_velocity, p.speed
