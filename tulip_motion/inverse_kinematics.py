"""Closed-loop inverse kinematics, eqs. (5)-(11).

Twelve task velocities, the CoM's (3), the torso's (3, angular) and the other foot's (3 linear, 3
angular), all relative to the stance foot, against twelve joint velocities. The body is modelled with a
free flyer whose motion the fixed stance sole determines, so the 12 x 12 Jacobian of eq. (5) is that of
the joints plus that of the base through the stance leg.

All of it is written with twists about odom's origin (linear part first): there a rigid body has one twist whichever
of its points is meant, so what the stance sole's rest makes of the base is one subtraction, with no change of frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import eigenpy
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.planar import Pose2D
from tulip_description.quaternion import matrix_quaternion
from tulip_motion.gait import FootMotion
from tulip_motion.interface import Side

Array = NDArray[np.float64]
Rows = Sequence[Sequence[float]]
"""A 3 x 3 matrix by rows, in plain numbers."""

MAX_POSITION_ERROR = 0.1  # [m] feedback acts on no more: a target that jumps is approached, not leapt at
MAX_ORIENTATION_ERROR = 1.0  # [rad] likewise; eq. (11) has no inverse at pi / 2
TWICE_LEAST_COSINE = 2.0 * math.cos(MAX_ORIENTATION_ERROR)
SINGULAR_VALUE = 0.03  # of J, below which damping grows; walking at 0.6 m/s stays above 0.048, a kick above 0.040
LOOK = 4  # [ticks] between looks at the singular value; it was found to fall by 0.0035 meanwhile at most
NEARLY_SINGULAR = 0.037  # below it every tick has a look
REPORTED_POSITION_ERROR = 0.03  # [m] walking stays below 0.005, so more means that the target is out of reach
REPORTED_ORIENTATION_ERROR = 0.15  # [rad]
LEG_COLUMNS = (slice(0, 6), slice(6, 12))
"""Where the left and the right leg's joints stand among the twelve."""


class TaskTarget(NamedTuple):
    """Desired task-space state in odom, x_d of the paper.

    Attributes:
        com, com_velocity: (x, y, z) [m], [m/s].
        torso_rotation: (3, 3) from base_link to odom.
        torso_angular_velocity: (x, y, z) [rad/s].
        foot: The foot that is not the stance foot.
    """

    com: Sequence[float]
    com_velocity: Sequence[float]
    torso_rotation: Array
    torso_angular_velocity: Sequence[float]
    foot: FootMotion


def rotation_z(yaw: float) -> Array:
    """Return the (3, 3) rotation about z."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def skew(vector: Array) -> Array:
    """Return S(v) with S(v) w = v x w."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def orientation_error(desired: Array, actual: Array) -> Array:
    """Return e_o = 1/2 (n_e x n_d + s_e x s_d + a_e x a_d), eq. (9), as (3,) in odom axes.

    The sum of the cross products of matching columns is the vee of R_d R_e^T minus its transpose.
    """
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = desired.dot(actual.T).tolist()
    return np.array((0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy)))


def error_rate_matrix(desired: Array, actual: Array) -> Array:
    """Return L = -1/2 sum of S(desired column) S(actual column), eq. (11), (3, 3).

    From S(a) S(b) = b a^T - (a . b) I, the sum is 1/2 (trace(Q) I - Q) with Q = R_e R_d^T.
    """
    turn = actual @ desired.T
    matrix: Array = 0.5 * (np.trace(turn) * np.eye(3) - turn)
    return matrix


def angular_rate(turn: Rows, angular_velocity: Sequence[float], gain: float) -> tuple[float, float, float]:
    """Return L^-1 (L^T w_d + K_o e_o) [rad/s], the orientation rows of eq. (10), in odom axes.

    No matrix has to be inverted. Q = R_e R_d^T is a rotation by some angle theta, and its characteristic polynomial
    Q^3 - t Q^2 + t Q - I = 0, t = trace(Q), gives L^-1 = 2 (Q^2 + t I) / (t^2 - 1). With that L^-1 L^T = Q, and since
    Q leaves its axis e_o where it is, L^-1 e_o = 2 e_o / (t - 1), which is tan(theta) about that axis.

    Args:
        turn: 3 x 3 Q, by rows.
        angular_velocity: 3 of w_d [rad/s], odom axes.
        gain: K_o [1/s].
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = turn
    wx, wy, wz = angular_velocity
    twice_cosine = xx + yy + zz - 1.0
    if twice_cosine > TWICE_LEAST_COSINE:
        k = gain / twice_cosine
        ex, ey, ez = k * (yz - zy), k * (zx - xz), k * (xy - yx)
    else:
        axis = pin.log3(np.array(turn).T)
        ex, ey, ez = (gain * math.tan(MAX_ORIENTATION_ERROR) / np.linalg.norm(axis) * axis).tolist()
    return (
        ex + xx * wx + xy * wy + xz * wz,
        ey + yx * wx + yy * wy + yz * wz,
        ez + zx * wx + zy * wy + zz * wz,
    )


def turn_from_yaw(yaw: float, actual: Array) -> Rows:
    """Return Q = R_e R_d^T by rows for an R_d that turns about z alone."""
    c, s = math.cos(yaw), math.sin(yaw)
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = actual.tolist()
    return (
        (xx * c - xy * s, xx * s + xy * c, xz),
        (yx * c - yy * s, yx * s + yy * c, yz),
        (zx * c - zy * s, zx * s + zy * c, zz),
    )


def linear_rate(
    desired: Sequence[float], actual: Sequence[float], velocity: Sequence[float], gain: float
) -> tuple[float, float, float]:
    """Return p_d' + K_p e_p [m/s], the position rows of eq. (10), with e_p no longer than `MAX_POSITION_ERROR`."""
    (x, y, z), (to_x, to_y, to_z), (vx, vy, vz) = actual, desired, velocity
    ex, ey, ez = to_x - x, to_y - y, to_z - z
    square = ex * ex + ey * ey + ez * ez
    if square > MAX_POSITION_ERROR**2:
        gain *= MAX_POSITION_ERROR / math.sqrt(square)
    return vx + gain * ex, vy + gain * ey, vz + gain * ez


def _distance(a: Sequence[float], b: Array) -> float:
    return float(np.linalg.norm(np.subtract(a, b)))


def _angle(a: Array, b: Array) -> float:
    return float(np.linalg.norm(pin.log3(a @ b.T)))


def task_of_twists(com: Array, foot: Array) -> Array:
    """Return (12, 12): rows, what unit twists of the stance leg (6) and of the other leg (6) do to the task velocity.

    A point r of a body with twist (v, w) moves with v - S(r) w. The base moves against the stance leg's twist, and
    takes CoM, torso and the other foot along; the other leg's twist moves its foot alone. The CoM's own motion in the
    body comes on top.

    Args:
        com: (3,) CoM in odom [m].
        foot: (3,) sole of the foot that is not the stance foot [m].
    """
    nothing, one = np.zeros((3, 3)), np.eye(3)
    return np.block(
        [
            [-one, nothing, -one, nothing],
            [-skew(com), -one, -skew(foot), -one],
            [nothing, nothing, one, nothing],
            [nothing, nothing, skew(foot), one],
        ]
    )


class InverseKinematics:
    """Integrates desired joint angles that follow a task target without drift, eqs. (7) and (10).

    Targets that cannot be reached are safe: errors count up to a limit, damping grows as a posture becomes singular,
    joint speeds keep to the robot's limits, and `notes` says what is the matter.
    """

    def __init__(self, model: Any, gain_position: float, gain_orientation: float, joint_limits: Array) -> None:
        """Make a solver.

        Args:
            model: Pinocchio model of the legs with a free flyer at base_link; its speed limits are kept to.
            gain_position: K_p of eq. (10) [1/s].
            gain_orientation: K_o of eq. (10) [1/s].
            joint_limits: (2, 12) lowest and highest joint angles [rad].
        """
        self.model = model
        data = self.data = model.createData()
        self.sole_frames = (model.getFrameId(frames.LEFT_SOLE), model.getFrameId(frames.RIGHT_SOLE))
        self._gain_position = gain_position
        self._gain_orientation = gain_orientation
        self._joint_limits = joint_limits
        self._per_speed_limit = 1.0 / model.velocityLimit[6:]
        self.configuration = pin.neutral(model)
        """(19,) desired base pose and joint angles q_d."""
        self.velocity = np.zeros(model.nv)
        """(18,) desired base and joint velocities."""
        self._base_velocity, self._joint_velocity = self.velocity[:6], self.velocity[6:]
        self._stance = Side.LEFT
        # Views into Pinocchio's data: each is made once, since making one takes longer than most of what is done
        # with it. They show the posture that `update_jacobian` saw.
        self._com, self._com_drift = data.com[0], data.acom[0]
        self._base = data.oMi[1]
        self._base_rotation = self._base.rotation
        self._soles = tuple(data.oMf[frame] for frame in self.sole_frames)
        self.sole_positions: tuple[Array, Array] = tuple(sole.translation for sole in self._soles)
        """(3,) left and right sole in odom [m], for the posture that `update_jacobian` saw."""
        self._sole_rotations = tuple(sole.rotation for sole in self._soles)
        self.leg_twists: tuple[Array, Array] = (data.J[:, 6:12], data.J[:, 12:18])
        """(6, 6) each: what the left and right leg's joint speeds add to the foot's twist about odom's origin."""
        self._com_of_joints = data.Jcom[:, 6:].T
        self._zero = np.zeros(model.nv)
        # `task_of_twists` is linear in (CoM, foot, 1): one product fills it in.
        self._places = np.array((0.0,) * 6 + (1.0,))
        self._place_of_com, self._place_of_foot = self._places[:3], self._places[3:6]
        at_rest = task_of_twists(np.zeros(3), np.zeros(3))
        units = [task_of_twists(unit[:3], unit[3:]) - at_rest for unit in np.eye(6)]
        self._task_of_places = np.stack([*units, at_rest], axis=-1).reshape(144, 7)
        tasks = np.empty((12, 12))
        self._tasks = tasks.reshape(144)
        self._task_of_stance, self._task_of_other = tasks[:6], tasks[6:]
        self._drift = np.zeros(12)  # of the task, without joint accelerations; the torso has none of its own
        self._drift_of_com, self._drift_of_foot = self._drift[:3], self._drift[6:]
        self._jacobian_transposed = np.zeros((12, 12))
        self._jacobian = self._jacobian_transposed.T
        self._leg_rows = (self._jacobian_transposed[:6], self._jacobian_transposed[6:])
        self._com_rows = self._jacobian_transposed[:, :3]
        # Eigen's factorizations, which take less time than those of LAPACK for so few numbers.
        self._lu, self._lu_transposed = eigenpy.PartialPivLU(12), eigenpy.PartialPivLU(12)
        self._damped = eigenpy.LLT(12)
        self.twist_to_base = np.eye(6)
        """(6, 6) from a twist about odom's origin to the base's velocity in its own axes."""
        self._weakest = np.full(12, math.nan)  # not known yet
        self._singular_value = 0.0
        self._rate = np.zeros(12)
        self._target: TaskTarget | None = None
        self._anchor_pose: Pose2D | None = None
        self._anchor = pin.SE3.Identity()
        self._updates = 0

    def reset(self, base_rotation: Array, base_position: Array, joint_positions: Array) -> None:
        """Set the posture that the integration goes on from."""
        self.configuration[:3] = base_position
        self.configuration[3:7] = matrix_quaternion(base_rotation)
        self.configuration[7:] = joint_positions
        self.velocity[:] = 0.0
        self._weakest[:], self._singular_value = math.nan, 0.0

    @property
    def jacobian(self) -> Array:
        """(12, 12) J of eq. (5), for the posture that `update_jacobian` saw."""
        return self._jacobian.copy()

    @property
    def sole_jacobians(self) -> tuple[Array, Array]:
        """(6, 18) of the left and right sole, odom axes, for the posture that `update_jacobian` saw."""
        left, right = (
            pin.getFrameJacobian(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED) for frame in self.sole_frames
        )
        return left, right

    @property
    def joint_positions(self) -> Array:
        """(12,) q_d [rad]."""
        positions: Array = self.configuration[7:]
        return positions

    @property
    def joint_velocities(self) -> Array:
        """(12,) dq_d/dt [rad/s]."""
        return self._joint_velocity

    @property
    def singular_value(self) -> float:
        """Estimate of the smallest singular value of J, which near a singular posture is exact."""
        return self._singular_value

    @property
    def notes(self) -> tuple[str, ...]:
        """What keeps the target from being reached, in words; empty when nothing does."""
        notes = []
        if (target := self._target) is not None:
            side = self._stance.other
            com = _distance(target.com, self._com)
            torso = _angle(target.torso_rotation, self._base_rotation)
            foot = _distance(target.foot.position, self.sole_positions[side])
            turn = _angle(rotation_z(target.foot.yaw), self._sole_rotations[side])
            if com > REPORTED_POSITION_ERROR:
                notes.append(f"CoM target out of reach: {com:.2f} m away")
            if torso > REPORTED_ORIENTATION_ERROR:
                notes.append(f"torso target out of reach: {torso:.2f} rad away")
            if foot > REPORTED_POSITION_ERROR or turn > REPORTED_ORIENTATION_ERROR:
                notes.append(f"target of the {side.name.lower()} foot out of reach: {foot:.2f} m, {turn:.2f} rad away")
        names, positions = self.model.names[2:], self.joint_positions
        if self._singular_value < SINGULAR_VALUE:
            joint = names[int(np.abs(self._weakest).argmax())]
            notes.append(f"near a singular posture: the task hardly moves with {joint}")
        low, high = self._joint_limits
        for index in np.flatnonzero((positions <= low) | (positions >= high)).tolist():
            notes.append(f"{names[index]} is at the end of its range: {positions[index]:.2f} rad")
        return tuple(notes)

    def update_jacobian(self, stance: Side) -> None:
        """Compute the kinematics of the present posture, and J for a stance foot."""
        model, data = self.model, self.data
        if stance is not self._stance:
            self._stance, self._singular_value = stance, 0.0
        # One pass gives placements, CoM, its Jacobian, and the joints' twists about odom's origin (data.J).
        pin.jacobianCenterOfMass(model, data, self.configuration, False)
        for frame in self.sole_frames:
            pin.updateFramePlacement(model, data, frame)
        other, twists, rows = stance.other, self.leg_twists, self._leg_rows
        self._place_of_com[:] = self._com
        self._place_of_foot[:] = self.sole_positions[other]
        np.dot(self._task_of_places, self._places, out=self._tasks)
        np.dot(twists[stance].T, self._task_of_stance, out=rows[stance])
        np.dot(twists[other].T, self._task_of_other, out=rows[other])
        np.add(self._com_rows, self._com_of_joints, out=self._com_rows)
        self.twist_to_base = self._base.toActionMatrixInverse()
        self._factorize()

    def solve_velocity(self, target: TaskTarget) -> None:
        """Set the joint velocities of eq. (10) for the posture that `update_jacobian` saw."""
        self._target = target
        foot, other = target.foot, self._stance.other
        k_p, k_o = self._gain_position, self._gain_orientation
        self._rate[:] = (
            *linear_rate(target.com, self._com.tolist(), target.com_velocity, k_p),
            *angular_rate(
                self._base_rotation.dot(target.torso_rotation.T).tolist(), target.torso_angular_velocity, k_o
            ),
            *linear_rate(foot.position, self.sole_positions[other].tolist(), foot.velocity, k_p),
            *angular_rate(turn_from_yaw(foot.yaw, self._sole_rotations[other]), (0.0, 0.0, foot.yaw_rate), k_o),
        )
        joints = self._solve(self._rate)
        shares = joints * self._per_speed_limit
        if shares.dot(shares) > 1.0:  # else none of them is greater than 1
            joints /= max(1.0, np.abs(shares).max())
        self._set_joint_velocities(joints)

    def solve_acceleration(self, task_acceleration: Array) -> Array:
        """Return the (18,) generalized acceleration that gives a (12,) task acceleration, odom axes.

        The derivative of eq. (5), x'' = J q'' + J' q', with the stance sole at rest.
        """
        model, data, frames_ = self.model, self.data, self.sole_frames
        stance = self._stance
        # With all accelerations zero, what remains is the drift J' q' of the CoM and the feet.
        pin.centerOfMass(model, data, self.configuration, self.velocity, self._zero, False)
        stance_drift = pin.getFrameAcceleration(model, data, frames_[stance], pin.WORLD).vector
        foot_drift = pin.getFrameClassicalAcceleration(model, data, frames_[stance.other], pin.LOCAL_WORLD_ALIGNED)
        # The base makes up for the drift of the stance sole, and takes the task along.
        self._drift_of_com[:] = self._com_drift
        self._drift_of_foot[:] = foot_drift.vector
        wanted = task_acceleration - self._task_of_stance.T.dot(stance_drift) - self._drift
        generalized = np.empty(18)
        joints = generalized[6:] = self._solve(wanted)
        stance_twist = stance_drift + self.leg_twists[stance].dot(joints[LEG_COLUMNS[stance]])
        generalized[:6] = -self.twist_to_base.dot(stance_twist)
        return generalized

    def integrate(self, dt: float, stance: Pose2D) -> None:
        """Advance q_d by dt [s], eq. (7), and put the stance sole back where it stands, in odom.

        The sole drifts by the integration's second-order error only, some micrometres a tick, which one
        correction of the base removes.
        """
        if stance is not self._anchor_pose:  # the same object for a whole step
            self._anchor_pose = stance
            self._anchor = pin.SE3(rotation_z(stance.yaw), np.array((stance.x, stance.y, 0.0)))
        q = self.configuration
        q[:7] = pin.SE3ToXYZQUAT(self._anchor * self._soles[self._stance].actInv(self._base))
        q = self.configuration = pin.integrate(self.model, q, self.velocity * dt)
        joints = q[7:]
        wanted = joints.tolist()
        # Two ufuncs: numpy's clip takes four times as long.
        np.minimum(joints, self._joint_limits[1], out=joints)
        np.maximum(joints, self._joint_limits[0], out=joints)
        if joints.tolist() != wanted:
            # A joint that is at its end rests there.
            self._set_joint_velocities(np.where(joints == wanted, self._joint_velocity, 0.0))

    def _factorize(self) -> None:
        """Factorize J, once for velocities and accelerations, and J^T J + damping where J is nearly singular."""
        self._lu.compute(self._jacobian)
        self._updates += 1
        if self._updates % LOOK == 0 or self._singular_value < NEARLY_SINGULAR:
            self._look_for_singularity()
        if self._singular_value < SINGULAR_VALUE:
            # From nothing at the threshold to SINGULAR_VALUE^2 where the direction is lost.
            damping = SINGULAR_VALUE**2 - self._singular_value**2
            self._damped.compute(self._jacobian_transposed.dot(self._jacobian) + damping * np.eye(12))

    def _look_for_singularity(self) -> None:
        """Update the smallest singular value of J, and the direction of joint space that moves the task least.

        One inverse iteration, begun from the last result, keeps up with both (Maciejewski and Klein, 1988). Without a
        last result, or at a posture that is singular altogether, all singular values are computed.
        """
        self._lu_transposed.compute(self._jacobian_transposed)
        grown = self._lu.solve(self._lu_transposed.solve(self._weakest))
        growth = math.sqrt(grown.dot(grown))
        if math.isfinite(growth):
            np.multiply(grown, 1.0 / growth, out=self._weakest)
            self._singular_value = math.sqrt(1.0 / growth)
        else:
            _, values, directions = np.linalg.svd(self._jacobian)
            self._weakest[:], self._singular_value = directions[-1], float(values[-1])

    def _solve(self, rate: Array) -> Array:
        """Return J^-1 times a (12,) task velocity or acceleration, damped where J is nearly singular."""
        if self._singular_value < SINGULAR_VALUE:
            solution: Array = self._damped.solve(self._jacobian_transposed.dot(rate))
        else:
            solution = self._lu.solve(rate)
        return solution

    def _set_joint_velocities(self, joints: Array) -> None:
        """Set the joints' speeds and the base's that leaves the stance sole at rest."""
        self._joint_velocity[:] = joints
        stance_twist = self.leg_twists[self._stance].dot(joints[LEG_COLUMNS[self._stance]])
        np.negative(self.twist_to_base.dot(stance_twist), out=self._base_velocity)
