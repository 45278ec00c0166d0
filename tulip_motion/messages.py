"""Messages of the body and of motion control, from and to domain objects."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry as OdometryMessage
from numpy.typing import NDArray
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from tulip_description import frames
from tulip_description.planar import Pose2D
from tulip_description.robot import JOINTS
from tulip_description.robot_io import JointCommand, Sensors
from tulip_description.short_numbers import fixed_point
from tulip_motion.identification.progress import Progress
from tulip_motion.interface import (
    HeadCommand,
    HeadMode,
    MotionMode,
    MotionState,
    Odometry,
    Support,
    WalkCommand,
    WalkMode,
)
from tulip_msgs.msg import FootForces
from tulip_msgs.msg import HeadCommand as HeadCommandMessage
from tulip_msgs.msg import JointCommand as JointCommandMessage
from tulip_msgs.msg import MotionState as MotionStateMessage
from tulip_msgs.msg import WalkCommand as WalkCommandMessage
from tulip_ros.time import header, stamp_of

Array = NDArray[np.float64]
JOINT_NAMES = list(JOINTS)
FINE, COARSE = 16, 10
"""Binary digits after the point: of lengths and angles (0.015 mm), of speeds and torques (0.001 rad/s, N m)."""


def sensors_to_messages(sensors: Sensors, cell_positions: Array) -> tuple[JointState, Imu, FootForces]:
    """Return one reading of the body as its three messages.

    Args:
        sensors: The reading.
        cell_positions: (2, 4, 2) force cells in the left and right sole frame [m], for the centres of pressure.
    """
    top = header(sensors.stamp)
    joints = JointState(
        header=top,
        name=JOINT_NAMES,
        position=sensors.joint_positions.tolist(),
        velocity=sensors.joint_velocities.tolist(),
        effort=sensors.joint_efforts.tolist(),
    )
    imu = Imu(header=header(sensors.stamp, frames.IMU))
    turn, rate, force = imu.orientation, imu.angular_velocity, imu.linear_acceleration
    turn.x, turn.y, turn.z, turn.w = sensors.imu_orientation.tolist()
    rate.x, rate.y, rate.z = sensors.imu_angular_velocity.tolist()
    force.x, force.y, force.z = sensors.imu_linear_acceleration.tolist()
    cells = sensors.foot_cells
    left, right = (_centre(cells[side], cell_positions[side]) for side in (0, 1))
    forces = FootForces(header=top, left_cells=cells[0], right_cells=cells[1], left_cop=left, right_cop=right)
    return joints, imu, forces


def _centre(cells: Array, positions: Array) -> Array:
    total = float(cells.sum())
    return fixed_point(cells @ positions / total, FINE) if total > 1.0 else np.full(2, np.nan)


def sensors_from_messages(joints: JointState, imu: Imu, forces: FootForces) -> Sensors:
    """Return one reading of the body.

    Raises:
        ValueError: if the joints are not JOINTS in their order.
    """
    if joints.name != JOINT_NAMES:
        raise ValueError(f"joint_states names {', '.join(joints.name)}; expected {', '.join(JOINTS)}")
    turn, rate, force = imu.orientation, imu.angular_velocity, imu.linear_acceleration
    return Sensors(
        stamp_of(joints),
        np.array(joints.position),
        np.array(joints.velocity),
        np.array(joints.effort),
        np.array([turn.x, turn.y, turn.z, turn.w]),
        np.array([rate.x, rate.y, rate.z]),
        np.array([force.x, force.y, force.z]),
        np.array([forces.left_cells, forces.right_cells]),
    )


def joint_command_to_message(command: JointCommand) -> JointCommandMessage:
    """Return a joint command as a message."""
    return JointCommandMessage(
        header=header(command.stamp),
        sequence=command.sequence,
        names=list(command.names),
        position=fixed_point(command.position, FINE).tolist(),
        velocity=fixed_point(command.velocity, COARSE).tolist(),
        effort=fixed_point(command.effort, COARSE).tolist(),
        stiffness=command.stiffness.tolist(),
        damping=command.damping.tolist(),
    )


def joint_command_from_message(message: JointCommandMessage) -> JointCommand:
    """Return the joint command of a message; the driver checks its values."""
    return JointCommand(
        message.sequence,
        stamp_of(message),
        tuple(message.names),
        np.array(message.position),
        np.array(message.velocity),
        np.array(message.effort),
        np.array(message.stiffness),
        np.array(message.damping),
    )


def walk_command_to_message(command: WalkCommand) -> WalkCommandMessage:
    """Return a walk command as a message."""
    return WalkCommandMessage(
        header=header(command.stamp, frames.BASE_FOOTPRINT),
        mode=int(command.mode),
        velocity=list(command.velocity),
        goal=[command.goal.x, command.goal.y, command.goal.yaw],
    )


def walk_command_from_message(message: WalkCommandMessage) -> WalkCommand:
    """Return the walk command of a message.

    Raises:
        ValueError: if the mode is unknown.
    """
    forward, left, turn = (float(value) for value in message.velocity)
    return WalkCommand(stamp_of(message), WalkMode(message.mode), (forward, left, turn), Pose2D(*_point(message.goal)))


def head_command_to_message(command: HeadCommand) -> HeadCommandMessage:
    """Return a head command as a message."""
    glance = command.glance
    return HeadCommandMessage(
        header=header(command.stamp, frames.BASE_FOOTPRINT),
        mode=int(command.mode),
        target=list(command.target),
        has_glance=glance is not None,
        glance=list(glance) if glance is not None else [0.0, 0.0, 0.0],
    )


def head_command_from_message(message: HeadCommandMessage) -> HeadCommand:
    """Return the head command of a message.

    Raises:
        ValueError: if the mode is unknown.
    """
    glance = _point(message.glance) if message.has_glance else None
    return HeadCommand(stamp_of(message), HeadMode(message.mode), _point(message.target), glance)


def _point(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def odometry_to_message(odometry: Odometry) -> OdometryMessage:
    """Return dead reckoning as a message: base_link in odom; the twist in the axes that nav_msgs asks for."""
    message = OdometryMessage(header=header(odometry.stamp, frames.ODOM), child_frame_id=frames.BASE_LINK)
    pose, twist = message.pose.pose, message.twist.twist
    pose.position.x, pose.position.y, pose.position.z = odometry.position.tolist()
    turn = pose.orientation
    turn.x, turn.y, turn.z, turn.w = odometry.orientation.tolist()
    twist.linear.x, twist.linear.y, twist.linear.z = odometry.linear_velocity.tolist()
    twist.angular.x, twist.angular.y, twist.angular.z = odometry.angular_velocity.tolist()
    message.pose.covariance = odometry.covariance.ravel()
    message.twist.covariance = odometry.twist_covariance.ravel()
    return message


def odometry_from_message(message: OdometryMessage) -> Odometry:
    """Return the dead reckoning of a message; the distance walked does not travel in it and is zero."""
    pose, twist = message.pose.pose, message.twist.twist
    turn = pose.orientation
    return Odometry(
        stamp_of(message),
        np.array([pose.position.x, pose.position.y, pose.position.z]),
        np.array([turn.x, turn.y, turn.z, turn.w]),
        np.array([twist.linear.x, twist.linear.y, twist.linear.z]),
        np.array([twist.angular.x, twist.angular.y, twist.angular.z]),
        0.0,
        np.array(message.pose.covariance).reshape(6, 6),
        np.array(message.twist.covariance).reshape(6, 6),
    )


def body_transforms(odometry: Odometry) -> TFMessage:
    """Return odom -> base_footprint -> base_link for /tf."""
    x, y, z = odometry.position
    qx, qy, qz, qw = odometry.orientation
    half_yaw = 0.5 * np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    c, s = np.cos(half_yaw), np.sin(half_yaw)
    # The tilt is the orientation without its yaw: (-yaw about z) * orientation.
    tilt = (c * qx + s * qy, c * qy - s * qx, c * qz - s * qw, c * qw + s * qz)
    return TFMessage(
        transforms=[
            _transform(odometry.stamp, frames.ODOM, frames.BASE_FOOTPRINT, (x, y, 0.0), (0.0, 0.0, s, c)),
            _transform(odometry.stamp, frames.BASE_FOOTPRINT, frames.BASE_LINK, (0.0, 0.0, z), tilt),
        ]
    )


def _transform(
    stamp: int, parent: str, child: str, translation: Sequence[float], rotation: Sequence[float]
) -> TransformStamped:
    message = TransformStamped(header=header(stamp, parent), child_frame_id=child)
    to, turn = message.transform.translation, message.transform.rotation
    to.x, to.y, to.z = (float(value) for value in translation)
    turn.x, turn.y, turn.z, turn.w = (float(value) for value in rotation)
    return message


_STATE_ARRAYS = {
    **dict.fromkeys(("com", "com_desired", "com_velocity", "com_velocity_desired"), FINE),
    **dict.fromkeys(("dcm", "dcm_desired", "zmp", "zmp_desired", "joint_positions", "joint_positions_desired"), FINE),
    **dict.fromkeys(("joint_velocities", "joint_velocities_desired"), COARSE),
    **dict.fromkeys(("torque_feedback", "torque_feedforward", "torque_learned"), COARSE),
}
"""How many binary digits of each go into a message."""


def motion_state_to_message(state: MotionState, distance: float) -> MotionStateMessage:
    """Return the state of the legs, and the distance walked [m], as a message."""
    return MotionStateMessage(
        header=header(state.stamp, frames.ODOM),
        mode=int(state.mode),
        support=int(state.support),
        phase=state.phase,
        step_count=state.step_count,
        left_sole=fixed_point(state.soles[0].ravel(), FINE),
        right_sole=fixed_point(state.soles[1].ravel(), FINE),
        distance=distance,
        reason=state.reason,
        notes=list(state.notes),
        **{name: fixed_point(getattr(state, name), digits) for name, digits in _STATE_ARRAYS.items()},
    )


def motion_state_from_message(message: MotionStateMessage) -> MotionState:
    """Return the state of the legs of a message.

    Raises:
        ValueError: if mode or support is unknown.
    """
    return MotionState(
        stamp=stamp_of(message),
        mode=MotionMode(message.mode),
        support=Support(message.support),
        phase=message.phase,
        step_count=message.step_count,
        soles=np.stack([message.left_sole, message.right_sole]).reshape(2, 4, 4),
        reason=message.reason,
        notes=tuple(message.notes),
        **{name: np.array(getattr(message, name)) for name in _STATE_ARRAYS},
    )


def progress_to_message(progress: Progress) -> String:
    """Return how far the experiment has come, as JSON."""
    return String(data=json.dumps(progress.as_dict()))


def progress_from_message(message: String) -> Progress:
    """Return how far the experiment has come.

    Raises:
        ValueError: if the message is no such progress.
    """
    values = json.loads(message.data)  # its error is a ValueError
    if not isinstance(values, dict):
        raise ValueError(f"progress of the experiment is {message.data!r}; expected a JSON object")
    return Progress.from_dict(values)
