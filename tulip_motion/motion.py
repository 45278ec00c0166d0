"""Motion control: from sensors and commands to joint commands, one tick at a time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.robot import HEAD_JOINTS, LEG_JOINTS, Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_motion.feedforward import distance_share, feedforward
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import FootMotion, Reference, sole_point
from tulip_motion.interface import (
    KickGoal,
    KickKind,
    KickProgress,
    MotionMode,
    MotionState,
    Odometry,
    Side,
    Support,
    WalkCommand,
    WalkMode,
)
from tulip_motion.inverse_kinematics import InverseKinematics, TaskTarget, orientation_error, rotation_z
from tulip_motion.joint_control import JointGains, feedback
from tulip_motion.kick import Kick, moved
from tulip_motion.kick_plan import plan_kick, refused_numbers
from tulip_motion.lipm import time_constant
from tulip_motion.parameters import MotionParameters
from tulip_motion.stabilizer import Balance, stabilize
from tulip_motion.state_estimator import Estimate, StateEstimator, planar_pose
from tulip_motion.walking import Walking
from tulip_motion.walking_kick import WalkingKick

Array = NDArray[np.float64]

HEIGHT_RATE = 0.1  # [m/s] the CoM is brought to its walking height without a jerk


def with_fixed_head(robot: Robot) -> Robot:
    """Return the robot with its head joints fixed at zero, so that its model moves in the legs alone."""
    fixed = (0.0, 0.0, 0.0)
    joints = (replace(joint, axis=fixed) if joint.name in HEAD_JOINTS else joint for joint in robot.joints)
    return replace(robot, joints=tuple(joints))


class Motion:
    """Stands, walks, kicks, and goes limp when the robot falls."""

    def __init__(self, parameters: MotionParameters, robot: Robot) -> None:
        """Make motion control for a robot. It stands when the first sensors come in."""
        p = self._parameters = parameters
        # The head is light and near its axes: the legs are controlled as if it looked straight ahead.
        self._model = floating_model(with_fixed_head(robot))
        self._estimator = StateEstimator(p, self._model, np.array([foot.cells for foot in robot.feet]), np.eye(3))
        self._kinematics = InverseKinematics(
            self._model, p.clik_gain_position, p.clik_gain_orientation, p.clik_damping, robot.position_limits[:, :12]
        )
        self._gains = JointGains(p)
        self._soles = robot.feet
        self._effort_limits = robot.effort_limits[:12]
        self._omega = 1.0 / time_constant(p.com_height)
        self._command = WalkCommand(0, WalkMode.STAND)
        self._mode = MotionMode.STAND
        self._reason = ""
        self._gait: Walking | Kick | None = None
        self._kick: Kick | WalkingKick | None = None
        self._steps_before = 0
        self._started = False
        self._sequence = 0
        self._stamp = 0
        self._acceleration = np.zeros(3)
        self._height = 0.0
        self._left_weight = 0.5
        self._distance = 0.0
        self._torques = np.zeros((2, 12))

    @property
    def mode(self) -> MotionMode:
        """What the legs do at present."""
        return self._mode

    def command(self, command: WalkCommand) -> None:
        """Take a new command; it holds until the next.

        Raises:
            ValueError: if a velocity is not finite.
        """
        if not all(math.isfinite(value) for value in command.velocity):
            raise ValueError(f"walk velocity is {command.velocity}; expected finite numbers")
        self._command = command

    def start_kick(self, goal: KickGoal) -> str:
        """Begin a kick; return "" or the reason why not."""
        if self._kick is not None and not self._kick.finished:
            return "another kick is under way"
        if goal.kind is KickKind.WALKING:
            return self._start_walking_kick(goal)
        if self._mode is not MotionMode.STAND or not self._started:
            return f"motion is in mode {self._mode.name}; a {goal.kind.name.lower()} kick starts from STAND"
        p, feet = self._parameters, self._feet()
        base = self._base_footprint()
        left, right = (base.inverse() @ foot.pose for foot in feet)
        plan = plan_kick(p, goal, (left, right), self._soles)
        if isinstance(plan, str):
            return plan
        self._gait = self._kick = Kick(p, [moved(move, base) for move in plan], feet, feet[goal.side], self._middle())
        self._mode = MotionMode.KICK
        return ""

    def cancel_kick(self) -> str:
        """Give the running kick up as its phase allows; return "" or the reason why not."""
        if self._kick is None or self._kick.finished:
            return "no kick is under way"
        self._kick.cancel("cancelled on request")
        return ""

    @property
    def kick_progress(self) -> KickProgress | None:
        """How far the last kick that was started has come; None before the first."""
        kick = self._kick
        return None if kick is None else KickProgress(not kick.finished, kick.phase, kick.reason)

    def _start_walking_kick(self, goal: KickGoal) -> str:
        p = self._parameters
        if self._mode is not MotionMode.WALK or not isinstance(self._gait, Walking):
            return f"motion is in mode {self._mode.name}; a walking kick starts from WALK"
        if goal.ball is None:
            return "no place of the ball is given; a walking kick needs it to find the step that reaches it"
        refusal = refused_numbers(goal, p.max_walking_kick_speed, 0.0, p.max_walking_kick_direction)
        if refusal:
            return refusal
        base = self._base_footprint()
        ball, direction = base.transform(goal.ball), base.yaw + goal.direction
        kick = WalkingKick(p, goal.side, ball, direction, goal.speed, self._soles)
        refusal = self._gait.kick_next(kick)
        if not refusal:
            self._kick = kick
        return refusal

    def tick(self, sensors: Sensors) -> JointCommand:
        """Return the command for the legs that answers one reading of the sensors."""
        self._stamp = sensors.stamp
        estimate = self._estimate = self._estimator.update(sensors, self._left_weight, self._acceleration)
        if not self._started:
            self._start(estimate)
        self._change_mode(estimate)
        if self._mode in (MotionMode.LIMP, MotionMode.FALLEN):
            if self._kick is not None:
                self._kick.abandon(self._reason)
            return self._limp(estimate)
        reference = self._reference = self._advance_gait(estimate)
        balance = self._balance = self._stabilize(estimate, reference)
        self._left_weight = 1.0 - balance.right_share
        return self._track(estimate, reference, balance)

    def odometry(self) -> Odometry:
        """Return dead reckoning as of the last tick."""
        estimate = self._estimate
        yaw = math.atan2(estimate.base_rotation[1, 0], estimate.base_rotation[0, 0])
        return Odometry(
            self._stamp,
            estimate.base_position.copy(),
            pin.Quaternion(estimate.base_rotation).coeffs(),
            rotation_z(-yaw) @ estimate.base_velocity,
            estimate.base_rotation.T @ estimate.angular_velocity,
            self._distance,
        )

    def state(self) -> MotionState:
        """Return the state of the legs as of the last tick."""
        estimate, kinematics = self._estimate, self._kinematics
        dcm = estimate.com[:2] + estimate.com_velocity[:2] / self._omega
        walking = self._mode not in (MotionMode.LIMP, MotionMode.FALLEN)
        reference = self._reference if walking else None
        planned = np.array(reference.dcm) if reference else np.full(2, np.nan)
        return MotionState(
            self._stamp,
            self._mode,
            reference.support if reference else Support.NONE,
            reference.phase if reference else 0.0,
            self._steps_before + (self._gait.step_count if isinstance(self._gait, Walking) else 0),
            estimate.com,
            np.array([*estimate.com[:2], self._height]),
            estimate.com_velocity,
            np.array([*((planned - estimate.com[:2]) * self._omega), 0.0]),
            dcm,
            planned,
            estimate.zmp,
            np.array(self._balance.zmp) if reference else np.full(2, np.nan),
            estimate.soles,
            estimate.joint_positions,
            kinematics.joint_positions.copy(),
            estimate.joint_velocities,
            kinematics.joint_velocities.copy(),
            self._torques[0],
            self._torques[1],
            reason=self._reason,
        )

    def _base_footprint(self) -> Pose2D:
        """Return where base_footprint is in odom."""
        position, rotation = self._estimate.base_position, self._estimate.base_rotation
        return Pose2D(float(position[0]), float(position[1]), math.atan2(rotation[1, 0], rotation[0, 0]))

    def _feet(self) -> tuple[Footstep, Footstep]:
        left, right = self._estimator.anchors
        return Footstep(Side.LEFT, left), Footstep(Side.RIGHT, right)

    def _middle(self) -> tuple[float, float]:
        p = self._parameters
        left, right = (sole_point(foot, p.zmp_forward, p.zmp_inward) for foot in self._feet())
        return (left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0

    def _start(self, estimate: Estimate) -> None:
        """Begin to stand where the robot is."""
        self._kinematics.reset(estimate.base_rotation, estimate.base_position, estimate.joint_positions)
        self._height = float(estimate.com[2])
        self._acceleration = np.zeros(3)
        self._left_weight = 0.5
        self._started = True

    def _change_mode(self, estimate: Estimate) -> None:
        p, wanted = self._parameters, self._command.mode
        upright = estimate.tilt < p.upright_tilt
        if self._mode is MotionMode.FALLEN or self._mode is MotionMode.LIMP:
            if upright and wanted is not WalkMode.LIMP and min(estimate.loads) > p.contact_force:
                self._estimator.restart()
                self._mode, self._reason, self._gait, self._started = MotionMode.STAND, "", None, False
        elif estimate.tilt > p.fall_tilt:
            self._mode = MotionMode.FALLEN
            self._reason = f"fell: the torso leans {math.degrees(estimate.tilt):.0f} deg"
        elif wanted is WalkMode.LIMP:
            self._mode, self._reason = MotionMode.LIMP, "limp on request"
        elif self._gait is not None and self._gait.finished:
            if isinstance(self._gait, Walking):
                self._steps_before += self._gait.step_count
                if self._gait.kick is not None:
                    self._gait.kick.abandon("the walk has ended")
            self._gait = None
            self._mode = MotionMode.STAND
        elif self._mode is MotionMode.STAND and wanted is WalkMode.WALK:
            self._gait = Walking(p, self._feet(), self._middle())
            self._mode = MotionMode.WALK

    def _advance_gait(self, estimate: Estimate) -> Reference:
        dt = self._parameters.control_period
        dcm = estimate.com[:2] + estimate.com_velocity[:2] / self._omega
        if isinstance(self._gait, Walking):
            velocity = self._command.velocity if self._command.mode is WalkMode.WALK else None
            landed = [planar_pose(sole) for sole in estimate.soles]
            reference = self._gait.tick(dt, velocity, (dcm[0], dcm[1]), landed, estimate.loads)
            self._anchor(self._gait.feet)
            return reference
        if isinstance(self._gait, Kick):
            landed = [planar_pose(sole) for sole in estimate.soles]
            reference = self._gait.tick(dt, landed, estimate.loads)
            self._anchor(self._gait.feet)
            return reference
        left, right = self._feet()
        middle = self._middle()
        return Reference(
            Support.DOUBLE,
            left,
            FootMotion.resting(right.pose),
            middle,
            middle,
            left.pose.yaw + 0.5 * math.remainder(right.pose.yaw - left.pose.yaw, 2.0 * math.pi),
            0.0,
            0.0,
        )

    def _anchor(self, feet: tuple[Footstep, Footstep]) -> None:
        """Tell the estimator where the feet stand, and count the way."""
        before = self._estimator.anchors
        if (feet[0].pose, feet[1].pose) != tuple(before):
            for foot, old in zip(feet, list(before), strict=True):
                # The body moves half as far as a foot does.
                self._distance += 0.5 * math.hypot(foot.pose.x - old.x, foot.pose.y - old.y)
                self._estimator.anchor(foot)

    def _stabilize(self, estimate: Estimate, reference: Reference) -> Balance:
        dcm = estimate.com[:2] + estimate.com_velocity[:2] / self._omega
        other = None
        if reference.support is Support.DOUBLE:
            foot = reference.other
            other = Footstep(
                reference.stance.side.other, Pose2D(float(foot.position[0]), float(foot.position[1]), foot.yaw)
            )
        return stabilize(
            self._parameters, reference.zmp, reference.dcm, (float(dcm[0]), float(dcm[1])), reference.stance, other
        )

    def _track(self, estimate: Estimate, reference: Reference, balance: Balance) -> JointCommand:
        """Turn the reference into joint angles, eq. (10), and torques, eqs. (12)-(15)."""
        p, kinematics = self._parameters, self._kinematics
        step = HEIGHT_RATE * p.control_period
        climb = min(max(p.com_height - self._height, -step), step)
        self._height += climb
        com_target = np.array([estimate.com[0], estimate.com[1], self._height])
        com_rate = np.array([estimate.com_velocity[0], estimate.com_velocity[1], climb / p.control_period])
        torso = rotation_z(reference.torso_yaw)
        torso_rate = np.array([0.0, 0.0, reference.torso_yaw_rate])
        kinematics.update_jacobian(reference.stance.side)
        kinematics.solve_velocity(TaskTarget(com_target, com_rate, torso, torso_rate, reference.other))

        acceleration = np.empty(12)
        acceleration[:2] = self._omega**2 * (estimate.com[:2] - balance.zmp)
        acceleration[2] = p.height_stiffness * (self._height - estimate.com[2]) - p.height_damping * (
            estimate.com_velocity[2] - com_rate[2]
        )
        acceleration[3:6] = p.torso_stiffness * orientation_error(torso, estimate.base_rotation) + p.torso_damping * (
            torso_rate - estimate.angular_velocity
        )
        acceleration[5] += reference.torso_yaw_acceleration
        acceleration[6:9] = reference.other.acceleration
        acceleration[9:] = (0.0, 0.0, reference.other.yaw_acceleration)
        self._acceleration = acceleration[:3].copy()
        generalized = kinematics.solve_acceleration(acceleration)
        torques = feedforward(
            self._model,
            kinematics.data,
            kinematics.configuration,
            kinematics.velocity,
            generalized,
            kinematics.sole_positions,
            kinematics.sole_jacobians,
            *self._sharing(reference, balance),
        )
        stance = reference.stance.pose
        kinematics.integrate(p.control_period, np.array([stance.x, stance.y, 0.0]), stance.yaw)
        stiffness, damping = self._gains.of(reference.support)
        self._torques[0] = feedback(
            stiffness,
            damping,
            kinematics.joint_positions - estimate.joint_positions,
            kinematics.joint_velocities - estimate.joint_velocities,
        )
        self._torques[1] = torques
        return self._send(
            kinematics.joint_positions.copy(), kinematics.joint_velocities.copy(), torques, stiffness, damping
        )

    def _sharing(self, reference: Reference, balance: Balance) -> tuple[float, tuple[Array, Array] | None]:
        """Return alpha, and the aim points of the ZMP on the left and right foot in odom [m] or None, eq. (15)."""
        p = self._parameters
        if p.weight_sharing == "distance":
            return distance_share(self._estimate.com, *self._kinematics.sole_positions), None
        foot = reference.other
        other = Footstep(
            reference.stance.side.other, Pose2D(float(foot.position[0]), float(foot.position[1]), foot.yaw)
        )
        points = [np.array([*sole_point(step, p.zmp_forward, p.zmp_inward), 0.0]) for step in (reference.stance, other)]
        left, right = points if reference.stance.side is Side.LEFT else points[::-1]
        return balance.right_share, (left, right)

    def _limp(self, estimate: Estimate) -> JointCommand:
        stiffness, damping = self._gains.limp
        self._torques[:] = 0.0
        self._acceleration = np.zeros(3)
        return self._send(estimate.joint_positions, np.zeros(12), np.zeros(12), stiffness, damping)

    def _send(self, position: Array, velocity: Array, effort: Array, stiffness: Array, damping: Array) -> JointCommand:
        self._sequence += 1
        effort = np.clip(effort, -self._effort_limits, self._effort_limits)
        return JointCommand(self._sequence, self._stamp, LEG_JOINTS, position, velocity, effort, stiffness, damping)
