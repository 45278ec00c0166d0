"""Motions that excite what identification looks for: squats, sways, leans, and a leg that swings.

Each is a sum of sines in task space, faded in and out, between two rests. The project's own inverse kinematics turns it
into joint angles, which the joints hold in open loop: the robot's balance then does not depend on a model that may be
wrong, as long as its CoM stays above the feet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_motion.feedforward import feedforward, inverse_dynamics
from tulip_motion.gait import FootMotion, support_on
from tulip_motion.head import HeadParameters
from tulip_motion.identification.motion_log import LEAST_LOAD
from tulip_motion.interface import Side, Support
from tulip_motion.inverse_kinematics import LEG_COLUMNS, InverseKinematics, TaskTarget
from tulip_motion.joint_control import JointGains
from tulip_motion.motion import with_fixed_head
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]

REST = 1.5  # [s] before and after: the IMU's biases are found there
SHIFT_TIME = 2.5  # [s] of the CoM to its place, and back: slow against its time constant of 0.27 s
LIFT_TIME = 1.2  # [s] of the foot
FADE_TIME = 1.0  # [s] of the sines
# [N m s/rad] of the ankles' torque against the trunk's turning: stiff joints alone let 23 kg on two ankles rock at
# 1.4 Hz for many seconds, and the CoP reach the edges of the soles
BALANCE_DAMPING = (40.0, 30.0)  # pitch, roll
# [N m/rad] of standing legs. The body's weight takes m g h = 160 off that of the ankles it stands on: with 300 about
# the roll axis, as in walking, a CoM that is 2 cm off goes to 4 cm, and robots fell
STANCE_STIFFNESS = (300.0, 1000.0, 1000.0, 1000.0, 800.0, 500.0)
# [1/s] at which the CoM is taken back to where it shall be, by the measured CoP; with 0.4 robots that sway fell
CORRECTION_RATE = 0.2
LEAST_FORCE = 100.0  # [N] on both feet: with less there is no CoP to go by
LARGEST_CORRECTION = 0.05  # [m] on each axis
HALF_STEP = 1e-3  # [s] for velocities by central differences; the sines are a thousand times slower


class Sines(NamedTuple):
    """One coordinate as a sum of sines.

    Attributes:
        amplitudes: [m] or [rad].
        frequencies: [Hz], as many; incommensurable, so that coordinates meet in ever new combinations.
    """

    amplitudes: tuple[float, ...] = ()
    frequencies: tuple[float, ...] = ()

    def at(self, t: float) -> float:
        """Return the value at a time [s]; it begins at 0."""
        pairs = zip(self.amplitudes, self.frequencies, strict=True)
        return sum(a * math.sin(2.0 * math.pi * f * t) for a, f in pairs)


STILL = Sines()
Axes = tuple[Sines, Sines, Sines]


@dataclass(frozen=True)
class Excitation:
    """What moves how, about a posture.

    Attributes:
        duration: Of the sines, between the rests [s].
        com: Forward, left, up [m].
        torso: Rotation vector, about forward, left, up [rad].
        drop: What the CoM is lowered by first, to have room upwards [m].
        stance: The foot to stand on, if the other swings.
        foot: Of the foot that swings: forward, left, up [m].
        foot_place: About which it swings, from where it stood: forward, left, up [m].
        foot_yaw: Its turn [rad].
        head: Pan and tilt [rad].
        com_ahead: CoM ahead of the stance ankle while the other foot swings [m]: the middle of the sole.
    """

    duration: float
    com: Axes = (STILL, STILL, STILL)
    torso: Axes = (STILL, STILL, STILL)
    drop: float = 0.0
    stance: Side | None = None
    foot: Axes = (STILL, STILL, STILL)
    foot_place: tuple[float, float, float] = (0.0, 0.0, 0.06)
    foot_yaw: Sines = STILL
    head: tuple[Sines, Sines] = (STILL, STILL)
    com_ahead: float = 0.04

    @property
    def total_time(self) -> float:
        """From rest to rest, both included [s]."""
        lifting = 0.0 if self.stance is None else 2.0 * LIFT_TIME
        return 2.0 * (REST + SHIFT_TIME) + lifting + self.duration


LOOKING_ROUND = (Sines((0.9, 0.3), (0.17, 0.43)), Sines((0.5, 0.15), (0.13, 0.49)))
SQUATS = Excitation(20.0, com=(STILL, STILL, Sines((0.035, 0.02), (0.31, 0.53))), drop=0.06, head=LOOKING_ROUND)
SWAYS = Excitation(
    24.0,
    com=(Sines((0.020, 0.010), (0.23, 0.61)), Sines((0.035, 0.015), (0.29, 0.47)), STILL),
    drop=0.02,
    head=LOOKING_ROUND,
)
LEANS = Excitation(
    24.0,
    com=(Sines((0.010,), (0.37,)), Sines((0.015,), (0.41,)), Sines((0.015,), (0.59,))),
    torso=(
        Sines((0.10, 0.04), (0.26, 0.67)),
        Sines((0.20, 0.06), (0.33, 0.73)),
        Sines((0.15, 0.05), (0.19, 0.57)),
    ),
    drop=0.04,
    head=LOOKING_ROUND,
)


def leg_swing(stance: Side, duration: float = 20.0) -> Excitation:
    """Return the swing of one leg while the robot stands on the other.

    Fast enough to tell Coulomb from viscous friction, and slowly through as much of the leg's range as balance allows,
    since its weight shows where it hangs far out.
    """
    outwards = 1.0 if stance is Side.RIGHT else -1.0
    return Excitation(
        duration,
        torso=(Sines((0.09, 0.03), (0.31, 0.67)), Sines((0.15, 0.03), (0.21, 0.59)), STILL),
        drop=0.03,
        stance=stance,
        foot=(
            Sines((0.14, 0.07, 0.02), (0.11, 0.71, 1.13)),
            Sines((0.05 * outwards, 0.04, 0.02), (0.17, 0.53, 1.03)),
            Sines((0.03,), (0.83,)),
        ),
        foot_place=(0.0, 0.03 * outwards, 0.12),
        foot_yaw=Sines((0.35, 0.1), (0.61, 1.07)),
        head=LOOKING_ROUND,
    )


class ExcitingMotion:
    """Commands legs and head through one excitation, from a posture with both feet flat, and back to it."""

    def __init__(self, excitation: Excitation, robot: Robot) -> None:
        """Make the motion for a robot as it is believed to be."""
        self._excitation = excitation
        self._parameters = p = MotionParameters(open_stance_stiffness=STANCE_STIFFNESS)
        model = floating_model(with_fixed_head(robot))
        limits = robot.position_limits[:, :12]
        self._kinematics = InverseKinematics(model, p.clik_gain_position, p.clik_gain_orientation, limits)
        self._gains = JointGains(p)
        self._head_parameters = HeadParameters()
        self._names = robot.joint_names
        self._cells = [foot.cells for foot in robot.feet]
        self._sequence = 0
        self._start: int | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """What keeps a target from being reached, in words."""
        return self._kinematics.notes

    def finished(self, stamp: int) -> bool:
        """Return whether the motion is over at a time [ns]."""
        return self._start is not None and (stamp - self._start) * 1e-9 >= self._excitation.total_time

    def tick(self, sensors: Sensors) -> JointCommand:
        """Return the command for all joints that answers one reading of the sensors; the first begins the motion."""
        if self._start is None:
            self._start = sensors.stamp
            self._begin(sensors.joint_positions[:12])
            self._head_start = sensors.joint_positions[12:].copy()
        t = (sensors.stamp - self._start) * 1e-9
        self._correct(sensors.foot_cells, t)
        kinematics, stance = self._kinematics, self._stance
        kinematics.update_jacobian(stance)
        kinematics.solve_velocity(self._target(t))
        share = self._right_share(t)
        dynamics = inverse_dynamics(kinematics, np.zeros(18), np.zeros(18))
        effort = feedforward(kinematics, dynamics, share, self._aims)
        self._damp(effort, sensors.imu_angular_velocity, share)
        kinematics.integrate(self._parameters.control_period, self._feet[stance])
        gains = self._gains.of(support_on(stance) if self._lifted(t) > 0.0 else Support.DOUBLE, open_loop=True)
        head, head_rate = self._head(t)
        none = np.zeros(len(head))
        self._sequence += 1
        return JointCommand(
            self._sequence,
            sensors.stamp,
            self._names,
            np.concatenate([kinematics.joint_positions, head]),
            np.concatenate([kinematics.joint_velocities, head_rate]),
            np.concatenate([effort, none]),
            np.concatenate([gains[0], none + self._head_parameters.stiffness]),
            np.concatenate([gains[1], none + self._head_parameters.damping]),
        )

    def _begin(self, joint_positions: Array) -> None:
        """Take the posture that the robot has, its left sole level at the origin, as the one to return to."""
        kinematics, stance = self._kinematics, self._excitation.stance
        self._stance = Side.LEFT if stance is None else stance
        kinematics.reset(np.eye(3), np.zeros(3), joint_positions)
        kinematics.update_jacobian(self._stance)
        data = kinematics.data
        left, right = (data.oMf[frame] for frame in kinematics.sole_frames)
        base = left.inverse()
        kinematics.reset(base.rotation, base.translation, joint_positions)
        place = (base * right).translation
        yaw = pin.log3((base * right).rotation)[2]
        self._feet = (Pose2D(), Pose2D(float(place[0]), float(place[1]), float(yaw)))
        self._torso = base.rotation.copy()
        self._correction = np.zeros(3)
        kinematics.update_jacobian(self._stance)
        self._com = data.com[0].copy()
        aims = (foot.transform((self._excitation.com_ahead, 0.0)) for foot in self._feet)
        left_aim, right_aim = (np.array((*aim, 0.0)) for aim in aims)
        self._aims = (left_aim, right_aim)

    def _target(self, t: float) -> TaskTarget:
        com, torso, foot, yaw = self._places(t)
        (com_0, torso_0, foot_0, yaw_0), (com_1, torso_1, foot_1, yaw_1) = (
            self._places(t + dt) for dt in (-HALF_STEP, HALF_STEP)
        )
        per_time = 0.5 / HALF_STEP
        x, y, z = foot.tolist()
        vx, vy, vz = (per_time * (foot_1 - foot_0)).tolist()
        still = (0.0, 0.0, 0.0)
        return TaskTarget(
            com.tolist(),
            (per_time * (com_1 - com_0)).tolist(),
            torso,
            (per_time * pin.log3(torso_1 @ torso_0.T)).tolist(),
            FootMotion((x, y, z), (vx, vy, vz), still, yaw, per_time * (yaw_1 - yaw_0)),
        )

    def _correct(self, foot_cells: Array, t: float) -> None:
        """Take the CoM a little towards where the CoP shows that it is not."""
        if foot_cells.sum() < LEAST_FORCE:
            return
        places = np.array(
            [[foot.transform(cell) for cell in cells] for foot, cells in zip(self._feet, self._cells, strict=True)]
        )
        loads = np.where(foot_cells.sum(axis=1, keepdims=True) > LEAST_LOAD, foot_cells, 0.0)
        cop = np.einsum("sc,sci->i", loads, places) / loads.sum()
        planned = self._places(t)[0][:2] - self._correction[:2]
        change = self._parameters.control_period * CORRECTION_RATE * (planned - cop)
        self._correction[:2] = np.clip(self._correction[:2] + change, -LARGEST_CORRECTION, LARGEST_CORRECTION)

    def _damp(self, effort: Array, angular_velocity: Array, right_share: float) -> None:
        """Add to the ankles' torques what slows the trunk; a foot bears by its share of the weight."""
        about_x, about_y, _ = angular_velocity.tolist()
        pitch, roll = BALANCE_DAMPING
        for side, share in ((Side.LEFT, 1.0 - right_share), (Side.RIGHT, right_share)):
            effort[LEG_COLUMNS[side]][4:6] += share * pitch * about_y, share * roll * about_x

    def _head(self, t: float) -> tuple[Array, Array]:
        """Return the angles and rates of the head's joints, if there are any, at a time [s]."""

        def angles(at: float) -> Array:
            since = at - self._excited_from
            sines = self._excitation.head[: len(self._head_start)]
            return self._head_start + self._fade(since) * np.array([sine.at(since) for sine in sines])

        return angles(t), (angles(t + HALF_STEP) - angles(t - HALF_STEP)) / (2.0 * HALF_STEP)

    def _fade(self, since: float) -> float:
        """Return the share of the sines, 0 to 1, at a time since they began [s]."""
        return _rise(since / FADE_TIME) * _rise((self._excitation.duration - since) / FADE_TIME)

    def _places(self, t: float) -> tuple[Array, Array, Array, float]:
        """Return CoM (3,) [m], torso (3, 3), the foot that may swing (3,) [m] and its yaw [rad] at a time [s]."""
        e = self._excitation
        since = t - self._excited_from
        fade = self._fade(since)
        com = self._com + self._correction + fade * np.array([axis.at(since) for axis in e.com])
        com += self._shifted(t) * (self._com_shift - np.array([0.0, 0.0, e.drop]))
        torso = pin.exp3(fade * np.array([axis.at(since) for axis in e.torso])) @ self._torso
        resting = self._feet[self._stance.other]
        foot = np.array([resting.x, resting.y, 0.0]) + fade * np.array([axis.at(since) for axis in e.foot])
        foot += self._lifted(t) * np.array(e.foot_place)
        return com, torso, foot, resting.yaw + fade * e.foot_yaw.at(since)

    @property
    def _com_shift(self) -> Array:
        """(3,) of the CoM to above the stance foot [m]; none on both feet."""
        if self._excitation.stance is None:
            return np.zeros(3)
        shift: Array = self._aims[self._stance] - self._com
        return np.array([shift[0], shift[1], 0.0])

    @property
    def _excited_from(self) -> float:
        return REST + SHIFT_TIME + (0.0 if self._excitation.stance is None else LIFT_TIME)

    def _shifted(self, t: float) -> float:
        """Return the share of the way of the CoM to its place, 0 to 1."""
        total = self._excitation.total_time
        return _rise((t - REST) / SHIFT_TIME) * _rise((total - REST - t) / SHIFT_TIME)

    def _lifted(self, t: float) -> float:
        """Return the share of the way of the foot up from the ground, 0 to 1."""
        if self._excitation.stance is None:
            return 0.0
        begin, end = REST + SHIFT_TIME, self._excitation.total_time - REST - SHIFT_TIME
        return _rise((t - begin) / LIFT_TIME) * _rise((end - t) / LIFT_TIME)

    def _right_share(self, t: float) -> float:
        """Return alpha of eq. (15): where the CoM shall be between the feet."""
        com, _, _, _ = self._places(t)
        left, right = self._aims
        way = right - left
        share = float((com - left)[:2] @ way[:2] / (way[:2] @ way[:2]))
        return min(max(share, 0.0), 1.0)


def _rise(share: float) -> float:
    """Return a smooth way from 0 at 0 to 1 at 1, at rest at both ends."""
    s = min(max(share, 0.0), 1.0)
    return s * s * s * (10.0 - s * (15.0 - 6.0 * s))
