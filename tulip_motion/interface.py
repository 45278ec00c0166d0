"""What motion control takes and gives: commands, odometry and the state of the legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D

Array = NDArray[np.float64]


class WalkMode(IntEnum):
    """What the legs shall do."""

    LIMP = 0
    """No stiffness, a little damping."""
    STAND = 1
    """Stop walking and stand."""
    WALK = 2
    """Walk with the commanded velocity; zero velocity steps in place."""
    GO = 3
    """Walk to the goal, put the feet side by side there, and stand."""


@dataclass(frozen=True)
class WalkCommand:
    """What the legs shall do, by velocity or by where the feet shall stand.

    Attributes:
        stamp: Stamp of the newest input used [ns].
        mode: See `WalkMode`.
        velocity: (3,) forward [m/s], left [m/s] and turning rate [rad/s], of base_footprint in itself, for WALK.
        goal: Where the middle between the ankles shall be, in odom [m], [rad], for GO.
    """

    stamp: int
    mode: WalkMode
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    goal: Pose2D = field(default_factory=Pose2D)


class Side(IntEnum):
    """A leg; also the row of that foot in arrays."""

    LEFT = 0
    RIGHT = 1

    @property
    def other(self) -> Side:
        """The other leg."""
        return Side.RIGHT if self is Side.LEFT else Side.LEFT


class KickKind(IntEnum):
    """How the foot meets the ball."""

    FORWARD = 0
    """With the toe, from standing."""
    SIDE = 1
    """With the outer side of the foot, from standing: the left foot kicks to the left."""
    WALKING = 2
    """With the toe, by one step of a walk that goes on: for dribbling."""


@dataclass(frozen=True)
class KickGoal:
    """Goal of the Kick action.

    Attributes:
        side: The foot that kicks.
        direction: Where the ball shall go, in base_footprint [rad], 0 forward.
        speed: Wanted speed of the ball [m/s].
        kind: See `KickKind`.
        ball: (x, y) of the ball's centre in base_footprint [m], or None if it lies where this kick expects it.
    """

    side: Side
    direction: float = 0.0
    speed: float = 3.0
    kind: KickKind = KickKind.FORWARD
    ball: tuple[float, float] | None = None


@dataclass(frozen=True)
class KickProgress:
    """How far a kick has come.

    Attributes:
        running: Whether it is under way still.
        phase: Progress, 0 to 1.
        reason: Why it was not or will not be carried out, or "".
    """

    running: bool
    phase: float
    reason: str


class MotionMode(IntEnum):
    """What motion control does at present."""

    LIMP = 0
    STAND = 1
    WALK = 2
    KICK = 3
    FALLEN = 4
    """A fall was detected: the legs are limp until the robot is upright and told to stand."""


class Support(IntEnum):
    """Which feet carry the robot."""

    DOUBLE = 0
    LEFT = 1
    RIGHT = 2
    NONE = 3


@dataclass(frozen=True)
class Odometry:
    """Dead reckoning from legs and IMU.

    Attributes:
        stamp: [ns].
        position: (3,) of base_link in odom [m]; z is the height above the ground.
        orientation: (4,) quaternion x, y, z, w of base_link in odom.
        linear_velocity: (3,) of base_link, in base_footprint axes [m/s].
        angular_velocity: (3,) of base_link, in base_link axes [rad/s].
        distance: Path length walked since the start [m].
        covariance: (6, 6) of the pose in odom: position [m^2], then rotation about fixed axes [rad^2].
        twist_covariance: (6, 6) of linear and angular velocity, in the axes of each [(m/s)^2], [(rad/s)^2].
    """

    stamp: int
    position: Array
    orientation: Array
    linear_velocity: Array
    angular_velocity: Array
    distance: float
    covariance: Array = field(default_factory=lambda: np.zeros((6, 6)))
    twist_covariance: Array = field(default_factory=lambda: np.zeros((6, 6)))


class Whereabouts(NamedTuple):
    """What motion control that is started anew has to know to go on in the same odom.

    Attributes:
        stamp: [ns].
        base: (x, y) of base_link in odom [m].
        heading_offset: Heading of base_link in odom less that of the IMU [rad].
        distance: Path length walked since the start [m].
        uncertainty: 16 numbers by rows, covariance of x, y [m], yaw [rad] and its drift [rad/s].
        sequence: Number of the last command to the legs.
    """

    stamp: int
    base: Sequence[float]
    heading_offset: float
    distance: float
    uncertainty: Sequence[float]
    sequence: int


@dataclass(frozen=True)
class MotionState:
    """Everything about the legs that others may want to see. Arrays of 12 follow LEG_JOINTS.

    Attributes:
        stamp: [ns].
        mode: See `MotionMode`.
        support: Planned support.
        phase: Progress of the present step or kick, 0 to 1.
        step_count: Steps begun since the start.
        com, com_desired: (3,) CoM in odom [m].
        com_velocity, com_velocity_desired: (3,) [m/s] in odom.
        dcm, dcm_desired: (2,) divergent component of motion in odom [m].
        zmp, zmp_desired: (2,) measured CoP and commanded ZMP in odom [m]; measured is NaN without contact.
        soles: (2, 4, 4) transforms of l_sole and r_sole in odom.
        joint_positions, joint_positions_desired: (12,) [rad].
        joint_velocities, joint_velocities_desired: (12,) [rad/s].
        torque_feedback, torque_feedforward, torque_learned: (12,) parts of eq. (12) [N m].
        reason: Why the mode is what it is, in words (a fall, limp on request), or "".
        notes: What somebody should know besides, in words: a command that was clipped, learning switched off.
    """

    stamp: int
    mode: MotionMode
    support: Support
    phase: float
    step_count: int
    com: Array
    com_desired: Array
    com_velocity: Array
    com_velocity_desired: Array
    dcm: Array
    dcm_desired: Array
    zmp: Array
    zmp_desired: Array
    soles: Array
    joint_positions: Array
    joint_positions_desired: Array
    joint_velocities: Array
    joint_velocities_desired: Array
    torque_feedback: Array
    torque_feedforward: Array
    torque_learned: Array = field(default_factory=lambda: np.zeros(12))
    reason: str = ""
    notes: tuple[str, ...] = ()


class HeadMode(IntEnum):
    """What the head shall do."""

    HOLD = 0
    """Keep the present angles."""
    SEARCH = 1
    """Sweep over the whole field round the robot."""
    LOOK_AT = 2
    """Look at `target` and stay on it."""
    TRACK = 3
    """Look at `glance` while there is one, else at `target`."""


@dataclass(frozen=True)
class HeadCommand:
    """What the head shall look at.

    Attributes:
        stamp: Stamp of the newest input used [ns].
        mode: See `HeadMode`.
        target: (3,) point in base_footprint [m] for LOOK_AT and TRACK.
        glance: (3,) point in base_footprint [m] to look at now under TRACK, or None to look at `target`.
    """

    stamp: int
    mode: HeadMode
    target: tuple[float, float, float] = (1.0, 0.0, 0.0)
    glance: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class GazeInput:
    """What the world model says, as far as it tells where to look.

    Attributes:
        stamp: [ns].
        pose: base_footprint in map.
        covariance: (3, 3) of x [m], y [m], yaw [rad] in map.
        ball: (2,) in base_footprint [m].
        ball_velocity: (2,) over the ground, in base_footprint axes [m/s].
        ball_covariance: (4, 4) of the two, relative to the robot.
        ball_age: Time since it was last seen [s].
    """

    stamp: int
    pose: Pose2D
    covariance: Array
    ball: Array
    ball_velocity: Array
    ball_covariance: Array
    ball_age: float
