"""From the gait's reference to joint angles and torques: eqs. (10) and (12)-(18) put together."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_motion.feedforward import distance_share, feedforward, inverse_dynamics
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import Reference
from tulip_motion.hip_strategy import turn_for_balance
from tulip_motion.inverse_kinematics import InverseKinematics, TaskTarget, rotation_z, turn_from_yaw
from tulip_motion.joint_control import JointGains, feedback
from tulip_motion.learning_file import LearningFile
from tulip_motion.lipm import time_constant
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import Velocity
from tulip_motion.stabilizer import Balance
from tulip_motion.state_estimator import Estimate
from tulip_motion.step_learning import StepLearner

Array = NDArray[np.float64]
Point = tuple[float, float]

HEIGHT_RATE = 0.1  # [m/s] the CoM is brought to its walking height without a jerk
TOUCH = 0.25  # share of the contact force at which a swing foot touches something


class StepInProgress(NamedTuple):
    """What learning over steps has to know of a walk.

    Attributes:
        steps: Begun in this walk.
        velocity: Of the step [m/s], [rad/s], or None if it is none of a steady walk.
    """

    steps: int
    velocity: Velocity | None


class Order(NamedTuple):
    """What the legs' joints shall do until the next tick; (12,) each.

    Attributes:
        position, velocity: Desired [rad], [rad/s].
        effort: Feedforward and learned torque, within the motors' limits [N m].
        gains: Stiffness [N m/rad] and damping [N m s/rad].
    """

    position: Array
    velocity: Array
    effort: Array
    gains: tuple[Array, Array]


class Tracking:
    """Follows a reference with the whole body."""

    def __init__(self, parameters: MotionParameters, model: Any, robot: Robot) -> None:
        """Begin.

        Args:
            parameters: Of motion control.
            model: Pinocchio model of the legs with a free flyer at base_link.
            robot: Its limits.
        """
        p = self._parameters = parameters
        self._model = model
        self._kinematics = InverseKinematics(
            model, p.clik_gain_position, p.clik_gain_orientation, robot.position_limits[:, :12]
        )
        self._gains = JointGains(p)
        self._effort_limits = (-robot.effort_limits[:12], robot.effort_limits[:12])
        self._omega = 1.0 / time_constant(p.com_height)
        self._lead_share = 1.0 - math.exp(-self._omega * p.control_period)  # of the way to the DCM, in one tick
        self._height = 0.0
        self._standing_on: Footstep | None = None
        self._planned: Point = (0.0, 0.0)
        self._planned_velocity: Point = (0.0, 0.0)
        self._learner: StepLearner | None = None
        if p.learning != "none":
            self._learner = StepLearner(p, robot.effort_limits[:12])
            self._learning_file = LearningFile(p, robot, self._learner)
        self.com_acceleration = np.zeros(3)
        """(3,) asked for by the last order, odom axes [m/s^2]."""
        self.torques = np.zeros((3, 12))
        """(3, 12) feedback, feedforward and learned part of eq. (12) [N m]."""

    @property
    def com_planned(self) -> Array:
        """(3,) CoM that belongs to the plan, in odom [m]."""
        return np.array((*self._planned, self._height))

    @property
    def com_velocity_planned(self) -> Array:
        """(3,) its velocity [m/s]."""
        return np.array((*self._planned_velocity, 0.0))

    @property
    def joint_positions(self) -> Array:
        """(12,) desired [rad]."""
        return self._kinematics.joint_positions.copy()

    @property
    def joint_velocities(self) -> Array:
        """(12,) desired [rad/s]."""
        return self._kinematics.joint_velocities.copy()

    @property
    def notes(self) -> tuple[str, ...]:
        """What somebody should know, in words: targets out of reach, learning that ended."""
        learning = () if self._learner is None else (self._learner.note, self._learning_file.note)
        return (*self._kinematics.notes, *(note for note in learning if note))

    def reset(self, estimate: Estimate) -> None:
        """Begin from the posture that the robot has."""
        self._kinematics.reset(estimate.base_rotation, estimate.base_position, estimate.joint_positions)
        self._height = float(estimate.com[2])
        self._planned = (float(estimate.com[0]), float(estimate.com[1]))
        self.com_acceleration = np.zeros(3)

    def save_learning(self) -> None:
        """Write what was learned since the last time to `learning_file`, if there is one."""
        if self._learner is not None:
            self._learning_file.save()

    def limp(self, estimate: Estimate) -> Order:
        """Return the order that lets the robot sink."""
        self.torques[:] = 0.0
        if self._learner is not None:
            self._learner.rest()
        self.com_acceleration = np.zeros(3)
        return Order(estimate.joint_positions, np.zeros(12), np.zeros(12), self._gains.limp)

    def advance(self, estimate: Estimate, reference: Reference, balance: Balance, step: StepInProgress | None) -> Order:
        """Return the order of one tick.

        Args:
            estimate: The body.
            reference: What the gait wants.
            balance: Where ZMP and CMP shall be.
            step: The step in progress if the robot walks in the default gait.
        """
        p, kinematics = self._parameters, self._kinematics
        if self._learner is not None:
            self._learn(self._learner, estimate, reference, step)  # before the desired angles move on
        self._plan_com(reference)
        dt = p.control_period
        climb = min(max(p.com_height - self._height, -HEIGHT_RATE * dt), HEIGHT_RATE * dt)
        self._height += climb
        rate = climb / dt
        if reference.com is None:
            (x, y, _), (vx, vy, _) = estimate.com.tolist(), estimate.com_velocity.tolist()
            self._standing_on = None
        else:
            (x, y), (vx, vy) = reference.com.position.tolist(), reference.com.velocity.tolist()
            self._stand_on(reference.stance)
        if self._torso_may_lean(reference):
            # Accelerations lead the torso. Joints that held it upright as well would hold it against the hip strategy,
            # and against the ground when a sole tilts.
            torso, torso_rate = estimate.base_rotation, estimate.angular_velocity.tolist()
        else:
            torso, torso_rate = rotation_z(reference.torso_yaw), (0.0, 0.0, reference.torso_yaw_rate)
        com, com_rate = (x, y, self._height), (vx, vy, rate)
        kinematics.update_jacobian(reference.stance.side)
        kinematics.solve_velocity(TaskTarget(com, com_rate, torso, torso_rate, reference.other))

        acceleration = self._task_acceleration(estimate, reference, balance, rate)
        self.com_acceleration = acceleration[:3]  # balance adds to the torso's alone
        self.torques[1] = self._feedforward(acceleration, estimate, reference, balance)
        kinematics.integrate(dt, reference.stance.pose)
        gains = self._gains.of(reference.support, reference.com is not None)
        position, velocity = self.joint_positions, self.joint_velocities
        self.torques[0] = feedback(*gains, position - estimate.joint_positions, velocity - estimate.joint_velocities)
        # Two ufuncs: numpy's clip takes four times as long.
        low, high = self._effort_limits
        effort = np.minimum(np.maximum(self.torques[1] + self.torques[2], low), high)
        return Order(position, velocity, effort, gains)

    def _plan_com(self, reference: Reference) -> None:
        """Keep the CoM that belongs to the plan: given, or the one that its DCM leads, c' = (xi - c) / Tc."""
        if reference.com is not None:
            x, y = reference.com.position.tolist()
            vx, vy = reference.com.velocity.tolist()
            self._planned, self._planned_velocity = (x, y), (vx, vy)
            return
        share = self._lead_share
        (x, y), (dcm_x, dcm_y) = self._planned, reference.dcm
        x, y = x + share * (dcm_x - x), y + share * (dcm_y - y)
        self._planned, self._planned_velocity = (x, y), (self._omega * (dcm_x - x), self._omega * (dcm_y - y))

    def _stand_on(self, stance: Footstep) -> None:
        """Move the desired posture as a whole to a new stance foot, so that its joints take no notice of the change."""
        if stance == self._standing_on:
            return
        self._standing_on = stance
        kinematics = self._kinematics
        q, data = kinematics.configuration, kinematics.data
        pin.framesForwardKinematics(self._model, data, q)
        sole = data.oMf[kinematics.sole_frames[stance.side]]
        anchored = pin.SE3(rotation_z(stance.pose.yaw), np.array([stance.pose.x, stance.pose.y, 0.0]))
        base = anchored * sole.inverse() * data.oMi[1]
        q[:7] = pin.SE3ToXYZQUAT(base)

    def _torso_may_lean(self, reference: Reference) -> bool:
        """Return whether accelerations lead the torso, upright or where balance wants it; else the joints hold it."""
        return reference.com is None and not reference.torso_held and self._parameters.feedforward == "full"

    def _task_acceleration(
        self, estimate: Estimate, reference: Reference, balance: Balance, height_rate: float
    ) -> Array:
        """Return (12,) of the CoM, the torso and the other foot: planned, or led by what is measured."""
        p, foot, com = self._parameters, reference.other, reference.com
        swing = (*foot.acceleration, 0.0, 0.0, foot.yaw_acceleration)
        if com is not None:
            return np.array((*com.acceleration.tolist(), 0.0, 0.0, 0.0, 0.5 * foot.yaw_acceleration, *swing))
        x, y, z = estimate.com.tolist()
        away_x, away_y = balance.cmp if self._torso_may_lean(reference) else balance.zmp
        return np.array(
            (
                self._omega**2 * (x - away_x),
                self._omega**2 * (y - away_y),
                p.height_stiffness * (self._height - z)
                - p.height_damping * (float(estimate.com_velocity[2]) - height_rate),
                *self._torso_acceleration(estimate, reference),
                *swing,
            )
        )

    def _torso_acceleration(self, estimate: Estimate, reference: Reference) -> tuple[float, float, float]:
        """Return the (3,) angular acceleration [rad/s^2], odom axes, that brings the torso upright and to its yaw."""
        p = self._parameters
        (_, xy, xz), (yx, _, yz), (zx, zy, _) = turn_from_yaw(reference.torso_yaw, estimate.base_rotation)
        ex, ey, ez = 0.5 * (yz - zy), 0.5 * (zx - xz), 0.5 * (xy - yx)  # eq. (9)
        wx, wy, wz = estimate.angular_velocity.tolist()
        stiffness, damping = p.torso_stiffness, p.torso_damping
        turning = reference.torso_yaw_acceleration + damping * (reference.torso_yaw_rate - wz)
        return stiffness * ex - damping * wx, stiffness * ey - damping * wy, stiffness * ez + turning

    def _feedforward(self, acceleration: Array, estimate: Estimate, reference: Reference, balance: Balance) -> Array:
        """Return (12,) tau_ff: eq. (14) in full, its term of gravity alone, or none."""
        kinematics, kind = self._kinematics, self._parameters.feedforward
        if kind == "none":
            return np.zeros(12)
        sharing = self._sharing(estimate, reference, balance)
        if kind == "gravity":
            return feedforward(kinematics, inverse_dynamics(kinematics, np.zeros(18), np.zeros(18)), *sharing)
        dynamics = inverse_dynamics(kinematics, kinematics.velocity, kinematics.solve_acceleration(acceleration))
        if self._torso_may_lean(reference):
            about_x, about_y = turn_for_balance(dynamics.wrench, balance.area)
            if about_x or about_y:
                acceleration[3:5] += about_x, about_y
                generalized = kinematics.solve_acceleration(acceleration)
                dynamics = inverse_dynamics(kinematics, kinematics.velocity, generalized)
        return feedforward(kinematics, dynamics, *sharing)

    def _sharing(
        self, estimate: Estimate, reference: Reference, balance: Balance
    ) -> tuple[float, tuple[Array, Array] | None]:
        """Return alpha, and the aim points of the ZMP on the left and right foot in odom [m] or None, eq. (15)."""
        p = self._parameters
        if p.weight_sharing == "distance":
            com = estimate.com if reference.com is None else reference.com.position
            return distance_share(com, *self._kinematics.sole_positions), None
        if balance.right_share in (0.0, 1.0):
            return balance.right_share, None  # one foot takes all of it, wherever it does
        left, right = balance.area.aims
        return balance.right_share, (np.array((*left, 0.0)), np.array((*right, 0.0)))

    def _learn(
        self, learner: StepLearner, estimate: Estimate, reference: Reference, step: StepInProgress | None
    ) -> None:
        """Set tau_ILC of eq. (12) from the errors of the desired angles that are in force now."""
        p, kinematics = self._parameters, self._kinematics
        if step is None:
            learner.rest()
            self.torques[2] = 0.0
            return
        error = kinematics.joint_positions - estimate.joint_positions - p.learning_delay * estimate.joint_velocities
        self.torques[2] = learner.tick(
            reference.stance.side,
            reference.support,
            reference.phase,
            step.steps,
            step.velocity,
            estimate.loads[reference.stance.side.other] > TOUCH * p.contact_force,
            error,
            kinematics.joint_velocities - estimate.joint_velocities,
        )
