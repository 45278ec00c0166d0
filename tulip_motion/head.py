"""Head movement: search, look at a point, track with glances.

Each mode chooses where the two joints shall be; one trajectory with limited speed and acceleration leads there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tulip_description.posture import standing_posture
from tulip_description.robot import HEAD_JOINTS, Robot
from tulip_description.robot_io import JointCommand
from tulip_motion.interface import HeadCommand, HeadMode

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HeadParameters:
    """Parameters of head movement."""

    speed: float = 4.0  # [rad/s] of both joints when looking at a point
    search_speed: float = 1.5  # [rad/s] 6 deg from picture to picture at 15 Hz: ten pictures of each place
    acceleration: float = 30.0  # [rad/s^2] 0.1 N m for a head of 0.003 kg m^2: the trunk does not feel it
    limit_margin: float = 0.02  # [rad] kept from the joints' stops
    search_pan: float = 2.4  # [rad] to both sides, within the joint's range
    search_tilt_far: float = 0.38  # [rad] down: a picture 59 deg high reaches from 1 m to the horizon
    search_tilt_near: float = 0.95  # [rad] down: from the own feet to 2.4 m
    near_distance: float = 1.2  # [m] a target lost nearer than this is searched near first
    arrived: float = 0.03  # [rad] from the end of a sweep, where the next one begins
    glance_period: float = 3.0  # [s] from the end of a glance to the next
    glance_length: float = 0.7  # [s] way there included: a turn of 1 rad takes 0.4 s
    stiffness: float = 30.0  # [N m/rad] gravity (0.12 N m at most) bends it by 0.2 deg
    damping: float = 0.6  # [N m s/rad] critical for a head of 0.003 kg m^2
    longest_step: float = 0.1  # [s] after a longer pause the trajectory begins anew where the joints are

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{entry.name} is {value}; expected a finite value > 0")
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
        if robot.camera is None:
            raise ValueError(f"variant {robot.variant!r} has no head; expected the playing variant")
        self._parameters = parameters
        joints = [robot.joint(name) for name in HEAD_JOINTS]
        self._lower = np.array([joint.lower for joint in joints]) + parameters.limit_margin
        self._upper = np.array([joint.upper for joint in joints]) - parameters.limit_margin
        self._fastest = np.array([joint.velocity for joint in joints])
        pan, tilt = joints
        self._neck = np.array([pan.origin[0], pan.origin[1], pan.origin[2] + standing_posture(robot).base_height])
        self._tilt_axis = np.array(tilt.origin)  # in the neck's frame; it crosses the pan axis (y = 0)
        self._camera = np.array(robot.camera.origin)  # in the head
        self._stamp: int | None = None
        self._sequence = 0
        self._position = np.zeros(2)
        self._velocity = np.zeros(2)
        self._mode: HeadMode | None = None
        self._last_target: tuple[float, float, float] | None = None
        self._sweep: list[Array] = []  # ends of the sweeps; the first is the one under way
        self._glance_begin = 0  # stamps [ns]
        self._glance_end = 0

    def update(self, stamp: int, command: HeadCommand, head_positions: Array) -> JointCommand:
        """Advance to a moment.

        Args:
            stamp: Of the joint positions [ns].
            command: What to look at; it holds until another one comes.
            head_positions: (2,) measured pan and tilt [rad].

        Returns:
            The command for HEAD_JOINTS.
        """
        duration = 0.0 if self._stamp is None else (stamp - self._stamp) * 1e-9
        if self._stamp is None or not 0.0 <= duration <= self._parameters.longest_step:
            self._position = np.clip(np.asarray(head_positions, dtype=np.float64), self._lower, self._upper)
            self._velocity = np.zeros(2)
            duration = 0.0
        self._stamp = stamp
        if command.mode is not self._mode:
            self._begin(stamp, command)
        goal, speed = self._goal(stamp, command)
        self._move(goal, np.minimum(speed, self._fastest), duration)
        self._sequence += 1
        p = self._parameters
        return JointCommand(
            sequence=self._sequence,
            stamp=stamp,
            names=HEAD_JOINTS,
            position=self._position.copy(),
            velocity=self._velocity.copy(),
            effort=np.zeros(2),
            stiffness=np.full(2, p.stiffness),
            damping=np.full(2, p.damping),
        )

    def angles_towards(self, target: tuple[float, float, float]) -> Array:
        """Return (2,) pan and tilt [rad] that bring a point of base_footprint [m] into the middle of the picture.

        A point out of reach gives the nearest angles inside the joints' limits. With the point at (r, z) in
        the vertical plane of the tilt axis, and the optical axis a height h above that axis, the tilt t follows from
        r sin t + z cos t = h.
        """
        offset = np.asarray(target, dtype=np.float64) - self._neck
        pan = math.atan2(offset[1], offset[0])
        ahead = math.hypot(offset[0], offset[1]) - self._tilt_axis[0]
        above = offset[2] - self._tilt_axis[2]
        distance = max(math.hypot(ahead, above), abs(float(self._camera[2])), 1e-6)
        tilt = math.asin(float(self._camera[2]) / distance) - math.atan2(above, ahead)
        angles: Array = np.clip(np.array([pan, tilt]), self._lower, self._upper)
        return angles

    def _begin(self, stamp: int, command: HeadCommand) -> None:
        """Begin a mode."""
        self._mode = command.mode
        self._glance_begin = self._glance_end = stamp
        if command.mode is HeadMode.SEARCH:
            self._sweep = self._plan_search(self._last_target or command.target)

    def _plan_search(self, target: tuple[float, float, float]) -> list[Array]:
        """Return the ends of the sweeps of one round, first to the side and the distance of a lost target."""
        p = self._parameters
        side = 1.0 if target[1] >= 0.0 else -1.0
        first, second = p.search_tilt_far, p.search_tilt_near
        if math.hypot(target[0], target[1]) < p.near_distance:
            first, second = second, first
        corners = [(side, first), (-side, first), (-side, second), (side, second)]
        return [np.clip([sign * p.search_pan, tilt], self._lower, self._upper) for sign, tilt in corners]

    def _goal(self, stamp: int, command: HeadCommand) -> tuple[Array, float]:
        """Return where the joints shall go and how fast."""
        p = self._parameters
        if command.mode is HeadMode.HOLD:
            return self._position + self._velocity * np.abs(self._velocity) / (2.0 * p.acceleration), p.speed
        if command.mode is HeadMode.SEARCH:
            if np.max(np.abs(self._sweep[0] - self._position)) < p.arrived:
                self._sweep = [*self._sweep[1:], self._sweep[0]]
            return self._sweep[0], p.search_speed
        self._last_target = command.target
        if command.mode is HeadMode.TRACK and command.glance is not None and self._glances(stamp):
            return self.angles_towards(command.glance), p.speed
        return self.angles_towards(command.target), p.speed

    def _glances(self, stamp: int) -> bool:
        """Tell whether it is time for a glance."""
        p = self._parameters
        if self._glance_begin > self._glance_end:
            if (stamp - self._glance_begin) * 1e-9 < p.glance_length:
                return True
            self._glance_end = stamp
            return False
        if (stamp - self._glance_end) * 1e-9 >= p.glance_period:
            self._glance_begin = stamp
            return True
        return False

    def _move(self, goal: Array, speed: Array, duration: float) -> None:
        """Advance the trajectory: as fast as allowed, and always able to stop at the goal.

        The speed v from which the joint can still stop after this step satisfies v dt + v^2 / (2 a) = |distance|.
        """
        if duration <= 0.0:
            return
        a = self._parameters.acceleration
        distance = np.clip(goal, self._lower, self._upper) - self._position
        braking = np.sqrt((a * duration) ** 2 + 2.0 * a * np.abs(distance)) - a * duration
        wanted = np.sign(distance) * np.minimum(braking, speed)
        change = np.clip(wanted - self._velocity, -a * duration, a * duration)
        self._velocity = self._velocity + change
        self._position = np.clip(self._position + self._velocity * duration, self._lower, self._upper)
