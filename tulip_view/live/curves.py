"""Curves of the last seconds: one joint's tracking and torques; the localization's error against the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import HEAD_JOINTS, LEG_JOINTS
from tulip_ros import topics
from tulip_view.columns import attitude
from tulip_view.ellipse import SIGMAS
from tulip_view.live.buffers import Buffers

Array = NDArray[np.float64]
NEAR = 0.05  # [s] from the truth, beyond which an estimate has none


@dataclass(frozen=True)
class JointCurves:
    """One joint over time.

    Attributes:
        times: (n,) stamps [s].
        desired, measured: (n,) angles [rad]; NaN where not known.
        feedback, feedforward, learned: (n,) parts of the torque, of eqs. (12) to (16) [N m]; NaN for the neck.
        sensed: (n,) torque as measured in the joint [N m].
    """

    times: Array
    desired: Array
    measured: Array
    feedback: Array
    feedforward: Array
    learned: Array
    sensed: Array


def joint_curves(buffers: Buffers, joint: str) -> JointCurves:
    """Return the curves of one joint.

    Args:
        buffers: What came.
        joint: Its name, one of JOINTS.
    """
    if joint in HEAD_JOINTS:
        rows = [(s, m, _named(m, joint, "position")) for s, m in buffers.kept(topics.JOINT_STATES)]
        times = np.array([stamp for stamp, _, _ in rows])
        wanted = [(s, _named(m, joint, "position", "names")) for s, m in buffers.kept(topics.HEAD_JOINT_COMMAND)]
        nothing = np.full(len(times), np.nan)
        return JointCurves(
            times,
            _at(times, wanted),
            np.array([value for _, _, value in rows]),
            nothing,
            nothing,
            nothing,
            np.array([_named(message, joint, "effort") for _, message, _ in rows]),
        )
    index = LEG_JOINTS.index(joint)
    states = buffers.kept(topics.MOTION_STATE)
    times = np.array([stamp for stamp, _ in states])

    def column(field: str) -> Array:
        return np.array([getattr(message, field)[index] for _, message in states], dtype=np.float64)

    sensed = [(stamp, _named(message, joint, "effort")) for stamp, message in buffers.kept(topics.JOINT_STATES)]
    return JointCurves(
        times,
        column("joint_positions_desired"),
        column("joint_positions"),
        column("torque_feedback"),
        column("torque_feedforward"),
        column("torque_learned"),
        _at(times, sensed),
    )


def _named(message: Any, joint: str, field: str, names: str = "name") -> float:
    order, values = list(getattr(message, names)), getattr(message, field)
    return float(values[order.index(joint)]) if joint in order and len(values) == len(order) else np.nan


def _at(times: Array, rows: list[tuple[float, float]]) -> Array:
    if not rows or not len(times):
        return np.full(len(times), np.nan)
    stamps, values = np.array(rows).T
    found: Array = np.interp(times, stamps, values)
    return found


@dataclass(frozen=True)
class ErrorCurves:
    """The localization against the truth.

    Attributes:
        times: (n,) stamps [s].
        distance: (n,) between estimated and true place [m].
        claimed: (n,) two standard deviations of the place, in the direction in which it is least sure [m].
        turn: (n,) between estimated and true heading [rad].
    """

    times: Array
    distance: Array
    claimed: Array
    turn: Array


def error_curves(buffers: Buffers) -> ErrorCurves:
    """Return the error of the localization, with nothing in it where there is no truth."""
    truths, worlds = buffers.kept(topics.GROUND_TRUTH), buffers.kept(topics.WORLD_STATE)
    if not truths or not worlds:
        return ErrorCurves(*(np.zeros(0) for _ in range(4)))
    stamps = np.array([stamp for stamp, _ in truths])
    real = np.array(
        [(m.robot.position.x, m.robot.position.y, attitude(m.robot.orientation)[2]) for _, m in truths], dtype=float
    )
    real[:, 2] = np.unwrap(real[:, 2])
    times = np.array([stamp for stamp, _ in worlds])
    believed = np.array([message.robot_pose for _, message in worlds], dtype=float)
    covariances = np.array([message.robot_covariance for _, message in worlds], dtype=float).reshape(-1, 3, 3)
    off = believed - np.column_stack([np.interp(times, stamps, column) for column in real.T])
    turn = (off[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    known = (times >= stamps[0] - NEAR) & (times <= stamps[-1] + NEAR) & np.isfinite(covariances).all(axis=(1, 2))
    widest = np.linalg.eigvalsh(covariances[known, :2, :2])[:, 1]
    claimed = SIGMAS * np.sqrt(np.maximum(widest, 0.0))
    return ErrorCurves(times[known], np.hypot(off[known, 0], off[known, 1]), claimed, turn[known])
