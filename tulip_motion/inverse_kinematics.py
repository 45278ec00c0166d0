"""Closed-loop inverse kinematics, eqs. (5)-(11).

Twelve task velocities, the CoM's (3), the torso's (3, angular) and the other foot's (3 linear, 3
angular), all relative to the stance foot, against twelve joint velocities. The body is modelled with a
free flyer whose motion the fixed stance sole determines, so the 12 x 12 Jacobian of eq. (5) is that of
the joints plus that of the base through the stance leg.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs

from tulip_description import frames
from tulip_motion.gait import FootMotion
from tulip_motion.interface import Side

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TaskTarget:
    """Desired task-space state in odom, x_d of the paper.

    Attributes:
        com, com_velocity: (3,) [m], [m/s].
        torso_rotation: (3, 3) from base_link to odom.
        torso_angular_velocity: (3,) [rad/s].
        foot: The foot that is not the stance foot.
    """

    com: Array
    com_velocity: Array
    torso_rotation: Array
    torso_angular_velocity: Array
    foot: FootMotion


def rotation_z(yaw: float) -> Array:
    """Return the (3, 3) rotation about z."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def skew(vector: Array) -> Array:
    """Return S(v) with S(v) w = v x w."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def orientation_error(desired: Array, actual: Array) -> Array:
    """Return e_o = 1/2 (n_e x n_d + s_e x s_d + a_e x a_d), eq. (9), as (3,) in odom axes.

    The sum of the cross products of matching columns is the vee of R_d R_e^T minus its transpose.
    """
    product = desired @ actual.T
    return 0.5 * np.array([product[2, 1] - product[1, 2], product[0, 2] - product[2, 0], product[1, 0] - product[0, 1]])


def error_rate_matrix(desired: Array, actual: Array) -> Array:
    """Return L = -1/2 sum of S(desired column) S(actual column), eq. (11), (3, 3).

    From S(a) S(b) = b a^T - (a . b) I, the sum is 1/2 (trace(R_d^T R_e) I - R_e R_d^T).
    """
    matrix: Array = -0.5 * (actual @ desired.T)
    matrix.flat[::4] += 0.5 * float(np.vdot(desired, actual))
    return matrix


def solve_3(matrix: Array, right: Array) -> Array:
    """Solve a 3 x 3 system by Cramer's rule: a tenth of the time of numpy's general solver."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    x, y, z = right.tolist()
    ei_fh, di_fg, dh_eg = e * i - f * h, d * i - f * g, d * h - e * g
    yi_fz, dz_yg, ez_yh = y * i - f * z, d * z - y * g, e * z - y * h
    scale = 1.0 / (a * ei_fh - b * di_fg + c * dh_eg)
    return np.array(
        [
            scale * (x * ei_fh - b * yi_fz - c * ez_yh),
            scale * (a * yi_fz - x * di_fg + c * dz_yg),
            scale * (a * ez_yh - b * dz_yg + x * dh_eg),
        ]
    )


def inverse_of_base_jacobian(jacobian: Array) -> Array:
    """Return the inverse of the first six columns of a frame's (6, 18) Jacobian in odom axes.

    They are [[R, -S(r) R], [0, R]] with the base's rotation R and the frame's place r from the base, whose inverse
    is [[R^T, R^T S(r)], [0, R^T]].
    """
    turn = jacobian[3:6, 3:6].T
    inverse = np.zeros((6, 6))
    inverse[:3, :3] = inverse[3:, 3:] = turn
    inverse[:3, 3:] = -turn @ jacobian[:3, 3:6] @ turn
    return inverse


class InverseKinematics:
    """Integrates desired joint angles that follow a task target without drift, eqs. (7) and (10)."""

    def __init__(
        self, model: Any, gain_position: float, gain_orientation: float, damping: float, joint_limits: Array
    ) -> None:
        """Make a solver.

        Args:
            model: Pinocchio model of the legs with a free flyer at base_link.
            gain_position: K_p of eq. (10) [1/s].
            gain_orientation: K_o of eq. (10) [1/s].
            damping: Added to the diagonal of J^T J, so that singular postures stay finite.
            joint_limits: (2, 12) lowest and highest joint angles [rad].
        """
        self.model = model
        self.data = model.createData()
        self.sole_frames = (model.getFrameId(frames.LEFT_SOLE), model.getFrameId(frames.RIGHT_SOLE))
        self._gain_position = gain_position
        self._gain_orientation = gain_orientation
        self._damping = damping * np.eye(12)
        self._joint_limits = joint_limits
        self.configuration = pin.neutral(model)
        """(19,) desired base pose and joint angles q_d."""
        self.velocity = np.zeros(model.nv)
        """(18,) desired base and joint velocities."""
        self.sole_jacobians: tuple[Array, Array] = (np.zeros((6, 18)), np.zeros((6, 18)))
        """(6, 18) each, odom axes, at `configuration`."""
        self.jacobian = np.zeros((12, 12))
        """J of eq. (5) at `configuration`."""
        self._task_of_base = np.zeros((12, 6))
        self._base_of_joints = np.zeros((6, 12))
        self._base_of_wrench = np.eye(6)
        self._factor = np.eye(12)
        self._stance = Side.LEFT

    def reset(self, base_rotation: Array, base_position: Array, joint_positions: Array) -> None:
        """Set the posture that the integration goes on from."""
        self.configuration[:3] = base_position
        self.configuration[3:7] = pin.Quaternion(base_rotation).coeffs()
        self.configuration[7:] = joint_positions
        self.velocity[:] = 0.0

    @property
    def sole_positions(self) -> tuple[Array, Array]:
        """(3,) left and right sole in odom [m], for the posture that `update_jacobian` saw."""
        left, right = self.sole_frames
        return self.data.oMf[left].translation, self.data.oMf[right].translation

    @property
    def joint_positions(self) -> Array:
        """(12,) q_d [rad]."""
        positions: Array = self.configuration[7:]
        return positions

    @property
    def joint_velocities(self) -> Array:
        """(12,) dq_d/dt [rad/s]."""
        return self.velocity[6:]

    def update_jacobian(self, stance: Side) -> None:
        """Compute the kinematics of the present posture and J for a stance foot."""
        model, data, q = self.model, self.data, self.configuration
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        left, right = self.sole_frames
        self.sole_jacobians = (
            pin.getFrameJacobian(model, data, left, pin.LOCAL_WORLD_ALIGNED),
            pin.getFrameJacobian(model, data, right, pin.LOCAL_WORLD_ALIGNED),
        )
        task = np.empty((12, 18))
        task[:3] = pin.jacobianCenterOfMass(model, data, q, False)
        # The base's angular velocity is given in its own axes: rotate it to odom.
        task[3:6] = 0.0
        task[3:6, 3:6] = data.oMi[1].rotation
        task[6:] = self.sole_jacobians[stance.other]
        fixed = self.sole_jacobians[stance]
        self._base_of_wrench = inverse_of_base_jacobian(fixed)
        self._base_of_joints = -self._base_of_wrench @ fixed[:, 6:]
        self._task_of_base = task[:, :6]
        self.jacobian = task[:, 6:] + self._task_of_base @ self._base_of_joints
        # The damped normal matrix is positive definite: one Cholesky factor serves velocities and accelerations.
        # Called without scipy's checks, which cost more than the factorization.
        self._factor, _ = dpotrf(self.jacobian.T @ self.jacobian + self._damping)
        self._stance = stance

    def solve_velocity(self, target: TaskTarget) -> None:
        """Set the joint velocities of eq. (10) for the posture that `update_jacobian` saw."""
        data = self.data
        rate = np.empty(12)
        rate[:3] = target.com_velocity + self._gain_position * (target.com - data.com[0])
        rate[3:6] = self._angular_rate(target.torso_rotation, data.oMi[1].rotation, target.torso_angular_velocity)
        sole = data.oMf[self.sole_frames[self._stance.other]]
        foot = target.foot
        rate[6:9] = foot.velocity + self._gain_position * (foot.position - sole.translation)
        rate[9:12] = self._angular_rate(rotation_z(foot.yaw), sole.rotation, np.array([0.0, 0.0, foot.yaw_rate]))
        joints = self._damped_solve(rate)
        self.velocity[6:] = joints
        self.velocity[:6] = self._base_of_joints @ joints

    def solve_acceleration(self, task_acceleration: Array) -> Array:
        """Return the (18,) generalized acceleration that gives a (12,) task acceleration, odom axes.

        The derivative of eq. (5), x'' = J q'' + J' q', with the stance sole at rest.
        """
        model, data, q, v = self.model, self.data, self.configuration, self.velocity
        zero = np.zeros(model.nv)
        pin.forwardKinematics(model, data, q, v, zero)
        pin.centerOfMass(model, data, q, v, zero, False)
        drift = np.zeros(12)
        drift[:3] = data.acom[0]
        drift[6:] = pin.getFrameClassicalAcceleration(
            model, data, self.sole_frames[self._stance.other], pin.LOCAL_WORLD_ALIGNED
        ).vector
        stance_drift = pin.getFrameClassicalAcceleration(
            model, data, self.sole_frames[self._stance], pin.LOCAL_WORLD_ALIGNED
        ).vector
        base = -self._base_of_wrench @ stance_drift
        joints = self._damped_solve(task_acceleration - drift - self._task_of_base @ base)
        return np.concatenate([base + self._base_of_joints @ joints, joints])

    def integrate(self, dt: float, stance_position: Array, stance_yaw: float) -> None:
        """Advance q_d by dt [s], eq. (7), and put the stance sole back where it stands.

        The sole drifts by the integration's second-order error only, a micrometre a tick, which one
        correction of the base removes.
        """
        q = self.configuration
        sole = self.data.oMf[self.sole_frames[self._stance]]
        anchored = pin.SE3(rotation_z(stance_yaw), stance_position)
        base = (anchored * sole.inverse()) * self.data.oMi[1]
        q[:3] = base.translation
        q[3:7] = pin.Quaternion(base.rotation).coeffs()
        self.configuration = pin.integrate(self.model, q, self.velocity * dt)
        np.clip(self.configuration[7:], self._joint_limits[0], self._joint_limits[1], out=self.configuration[7:])

    def _angular_rate(self, desired: Array, actual: Array, angular_velocity: Array) -> Array:
        """Return L^-1 (L^T w_d + K_o e_o), the orientation rows of eq. (10)."""
        matrix = error_rate_matrix(desired, actual)
        error = orientation_error(desired, actual)
        return solve_3(matrix, matrix.T @ angular_velocity + self._gain_orientation * error)

    def _damped_solve(self, rate: Array) -> Array:
        solution: Array = dpotrs(self._factor, self.jacobian.T @ rate)[0]
        return solution
