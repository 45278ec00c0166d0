"""Pinocchio models of the robot, rooted in the trunk (free) or in a sole (fixed to the ground).

All models use the same joint names, angles and signs (REP 103, see robot.yaml), so a joint configuration means the
same in each; only the order of the joints differs, and `joint_indices` translates it.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.robot import Joint, Link, Mount, Robot

Side = Literal["left", "right"]

OPTICAL_ROTATION = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""camera_optical_frame (z forward, x right, y down) in camera_link (x forward, y left, z up)."""


def floating_model(robot: Robot) -> pin.Model:
    """Return the model with a free-flyer at base_link.

    q is (7 + n,): position of base_link [m], its quaternion x, y, z, w, and the joints in the order of
    `robot.joint_names`; v is (6 + n,): linear and angular velocity of base_link in its own axes, and the joint speeds.
    The frames base_link, l_sole, r_sole, imu_link, camera_link and camera_optical_frame and all link names exist.
    """
    model = pin.Model()
    model.name = f"tulip_{robot.variant}"
    root = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint")
    _grow(model, robot, robot.links[0], root, np.zeros(3), came_from=None)
    _check_order(model, robot)
    return model


def sole_model(robot: Robot, side: str) -> pin.Model:
    """Return the model whose sole is fixed to the ground: the universe frame is l_sole or r_sole.

    It is the model of eq. (1) for one base foot. q and v are (n,), ordered from that sole up to the trunk, down the
    other leg, and then the head; see `joint_indices`. Angles keep their sign: those of the stance leg still turn the
    child (foot side) against the parent (trunk side).

    Raises:
        ValueError: if side is neither "left" nor "right".
    """
    if side not in ("left", "right"):
        raise ValueError(f"side is {side!r}; expected left or right")
    sole = robot.soles[0 if side == "left" else 1]
    model = pin.Model()
    model.name = f"tulip_{robot.variant}_{side}_sole"
    _grow(model, robot, robot.link(sole.link), 0, -np.array(sole.origin), came_from=None)
    return model


def joint_indices(model: pin.Model, robot: Robot) -> NDArray[np.int64]:
    """Return (n,) the index into the model's v of each joint of `robot.joint_names`."""
    return np.array([model.joints[model.getJointId(name)].idx_v for name in robot.joint_names])


def _grow(
    model: pin.Model, robot: Robot, link: Link, joint_id: int, origin: NDArray[np.float64], came_from: Joint | None
) -> None:
    """Add a link, whose frame lies at `origin` of a joint that exists already, and all that hangs on it."""
    placement = pin.SE3(np.eye(3), origin)
    body = pin.Inertia(link.mass, np.array(link.com), np.diag(link.inertia))
    model.appendBodyToJoint(joint_id, body, placement)
    model.addBodyFrame(link.name, joint_id, placement, 0)
    for name, mount in _mounts(robot):
        if mount.link == link.name:
            at = pin.SE3(np.eye(3), origin + np.array(mount.origin))
            model.addFrame(pin.Frame(name, joint_id, 0, at, pin.FrameType.OP_FRAME))
            if name == frames.CAMERA:
                optical = at * pin.SE3(OPTICAL_ROTATION, np.zeros(3))
                model.addFrame(pin.Frame(frames.CAMERA_OPTICAL, joint_id, 0, optical, pin.FrameType.OP_FRAME))
    neighbours = [
        joint for joint in robot.joints if link.name in (joint.parent, joint.child) and joint is not came_from
    ]
    for joint in neighbours:
        downwards = joint.parent == link.name
        # The joint lies in the child's frame, whichever of the two links the tree reaches first.
        location = origin + np.array(joint.origin) if downwards else origin
        other = robot.link(joint.child if downwards else joint.parent)
        other_origin = np.zeros(3) if downwards else -np.array(joint.origin)
        if joint.fixed:
            _grow(model, robot, other, joint_id, location + other_origin, joint)
        else:
            axis = np.array(joint.axis) if downwards else -np.array(joint.axis)
            limits = (
                np.array([joint.effort]),
                np.array([joint.velocity]),
                np.array([joint.lower]),
                np.array([joint.upper]),
            )
            next_id = model.addJoint(joint_id, _revolute(axis), pin.SE3(np.eye(3), location), joint.name, *limits)
            _grow(model, robot, other, next_id, other_origin, joint)


def _revolute(axis: NDArray[np.float64]) -> pin.JointModel:
    if axis.max() > 0.0:  # the aligned joints are faster than the general one
        return (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)[int(axis.argmax())]()
    return pin.JointModelRevoluteUnaligned(axis)


def _mounts(robot: Robot) -> list[tuple[str, Mount]]:
    mounts = [(frames.LEFT_SOLE, robot.soles[0]), (frames.RIGHT_SOLE, robot.soles[1]), (frames.IMU, robot.imu)]
    if robot.camera is not None:
        mounts.append((frames.CAMERA, robot.camera))
    return mounts


def _check_order(model: pin.Model, robot: Robot) -> None:
    """Guard what floating_model promises: the joints' order in v."""
    if tuple(model.names)[2:] != robot.joint_names:
        raise ValueError(f"the model's joints are {tuple(model.names)[2:]}; expected {robot.joint_names}")
