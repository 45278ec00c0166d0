"""From two feet onto one and back: the roads between standing and the postures on one foot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import Side as SideName
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot
from tulip_motion.gait import FootMotion
from tulip_motion.identification.posture_roads import Road
from tulip_motion.identification.static_postures import aim_point
from tulip_motion.interface import Side
from tulip_motion.inverse_kinematics import InverseKinematics, TaskTarget
from tulip_motion.motion import with_fixed_head

Array = NDArray[np.float64]
POINTS = 25  # of a road
NEWTON_STEPS = 6  # a point; eq. (10) with gain 1 and a step of 1 s is Newton's method
LIFT = 0.08  # [m] of the other foot
TOLERANCE = 1e-6  # [m], [rad] left at the last point


class WeightShift(NamedTuple):
    """Roads of one stance foot.

    Attributes:
        shift: From standing on both feet until the CoM is over the stance foot.
        lift: From there until the other foot is in the air.
    """

    shift: Road
    lift: Road


def weight_shift(robot: Robot, side: SideName) -> WeightShift:
    """Return how the robot comes to stand on one foot: the trunk upright, at the height at which it stands.

    Args:
        robot: As it is believed to be.
        side: The stance foot.

    Raises:
        ValueError: if the legs cannot reach that.
    """
    model = floating_model(with_fixed_head(robot))
    stance = Side.LEFT if side == "left" else Side.RIGHT
    start = standing_posture(robot).joint_positions
    kinematics = InverseKinematics(model, 1.0, 1.0, robot.position_limits[:, :12])
    kinematics.reset(np.eye(3), np.zeros(3), start[:12])
    kinematics.update_jacobian(stance)
    sole, other = (kinematics.sole_positions[which].copy() for which in (stance, stance.other))
    kinematics.reset(np.eye(3), -sole, start[:12])
    kinematics.update_jacobian(stance)
    foot, com = other - sole, kinematics.data.com[0].copy()
    end = np.array([*aim_point(robot, side), com[2]])

    def along(com_from: Array, com_to: Array, lift: float) -> Road:
        points = []
        for share in np.linspace(0.0, 1.0, POINTS):
            at = FootMotion.resting(Pose2D(float(foot[0]), float(foot[1]), 0.0))
            at = at._replace(position=(float(foot[0]), float(foot[1]), share * lift))
            target = TaskTarget((com_from + share * (com_to - com_from)).tolist(), (0, 0, 0), np.eye(3), (0, 0, 0), at)
            for _ in range(NEWTON_STEPS):
                kinematics.solve_velocity(target)
                kinematics.integrate(1.0, HERE)
                kinematics.update_jacobian(stance)
            points.append(np.array([*kinematics.joint_positions, *start[12:]]))
        error = np.abs(pin.centerOfMass(model, kinematics.data, kinematics.configuration) - com_to).max()
        if error > TOLERANCE or kinematics.notes:
            why = "; ".join(kinematics.notes) or f"the CoM stays {error:.3g} m away"
            raise ValueError(f"the robot cannot come to stand on its {side} foot: {why}")
        return Road(np.array(points))

    return WeightShift(along(com, end, 0.0), along(end, end, LIFT))


HERE = Pose2D()
"""The stance sole in its own frame."""
