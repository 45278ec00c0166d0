"""How the robot stands at present, from the readings of its own sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tulip_description.posture import standing_posture
from tulip_description.quaternion import Quaternion
from tulip_description.robot import LEG_JOINTS, Robot
from tulip_description.robot_io import Sensors

Array = NDArray[np.float64]
MOST_TILT = 0.25  # [rad] of a trunk that is upright, as motion control has it for a limp robot that stands up
MOST_SPEED = 0.5  # [rad/s] of a leg's joint, mean of some readings: more than a robot that sways and balances
BEYOND = 0.02  # [rad] outside of its range that a joint's reading may be, by its zero
LIFTED = 20.0  # [N] on each foot, below which it is told that the feet carry nothing


@dataclass(frozen=True)
class Present:
    """A robot that stands.

    Attributes:
        joint_positions: (n,) [rad], order of `robot.joint_names`.
        tilt: Quaternion x, y, z, w of the trunk without its heading; None: upright.
        note: What somebody should know about it, or "".
    """

    joint_positions: Array
    tilt: Quaternion | None = None
    note: str = ""


def standing(robot: Robot) -> Present:
    """Return the robot as it stands by itself."""
    return Present(standing_posture(robot).joint_positions)


def present_of(robot: Robot, readings: Sequence[Sensors]) -> Present:
    """Return how a robot stands, as the mean of some readings.

    Args:
        robot: What it is like.
        readings: That follow each other, of some tenths of a second.

    Raises:
        ValueError: if there are none, or the robot does not stand still with an upright trunk.
    """
    if not readings:
        raise ValueError("there is no reading of the robot's sensors")
    positions = np.mean([each.joint_positions for each in readings], axis=0)
    turns = np.array([each.imu_orientation for each in readings])
    if not (np.isfinite(positions).all() and np.isfinite(turns).all()):
        raise ValueError("joint positions or the IMU's orientation are not finite")
    if not (np.linalg.norm(turns, axis=1) > 0.5).all():
        raise ValueError("the IMU's orientation is no quaternion of unit length")
    speeds = np.abs(np.mean([each.joint_velocities[: len(LEG_JOINTS)] for each in readings], axis=0))
    fastest = int(np.argmax(speeds))
    if not speeds[fastest] <= MOST_SPEED:
        raise ValueError(
            f"{robot.joint_names[fastest]} turns at {speeds[fastest]:.1f} rad/s; expected a robot that stands still"
        )
    attitude = Rotation.from_quat(turns).mean()
    yaw = math.atan2(*attitude.as_matrix()[[1, 0], 0])
    level = Rotation.from_euler("z", -yaw) * attitude
    lean = math.acos(min(1.0, float(level.as_matrix()[2, 2])))
    if lean > MOST_TILT:
        raise ValueError(
            f"the trunk is tilted by {math.degrees(lean):.0f} deg; expected a robot that stands, tilted by"
            f" {math.degrees(MOST_TILT):.0f} deg at most: set it upright"
        )
    lower, upper = robot.position_limits
    beyond = np.maximum(lower - positions, positions - upper)
    worst = int(np.argmax(beyond))
    if beyond[worst] > BEYOND:
        raise ValueError(
            f"{robot.joint_names[worst]} is at {positions[worst]:.3f} rad; expected {lower[worst]:g} to"
            f" {upper[worst]:g} rad: look at its zero"
        )
    loads = np.mean([each.foot_cells.sum(axis=1) for each in readings], axis=0)
    note = "" if loads.min() > LIFTED else "a foot carries nothing; it is rehearsed as if it stood on both"
    x, y, z, w = level.as_quat(canonical=True).tolist()
    return Present(np.clip(positions, lower, upper), (x, y, z, w), note)
