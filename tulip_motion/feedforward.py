"""Feedforward torques by inverse dynamics, eqs. (14)-(15)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_motion.inverse_kinematics import LEG_COLUMNS, InverseKinematics

Array = NDArray[np.float64]


def distance_share(com: Array, left: Array, right: Array) -> float:
    """Return alpha of eq. (15) from the CoM's horizontal distances to the feet: 1 over the right, 0 over the left.

    Args:
        com: (3,) CoM [m].
        left: (3,) left sole, same frame [m].
        right: (3,) right sole [m].
    """
    to_left = math.hypot(com[0] - left[0], com[1] - left[1])
    to_right = math.hypot(com[0] - right[0], com[1] - right[1])
    return to_left / (to_left + to_right)


class Dynamics(NamedTuple):
    """What a motion takes.

    Attributes:
        torques: (12,) of the joints, if the base were held [N m].
        wrench: (6,) what would hold the base, which in truth the ground supplies through the feet: force [N] and moment
            about odom's origin [N m], odom axes.
    """

    torques: Array
    wrench: Array


def inverse_dynamics(kinematics: InverseKinematics, velocity: Array, acceleration: Array) -> Dynamics:
    """Return what a motion takes of joints and ground.

    Args:
        kinematics: The posture q_d, as `update_jacobian` saw it.
        velocity: (18,) its velocity.
        acceleration: (18,) its acceleration; zero leaves gravity and Coriolis terms.
    """
    generalized = pin.rnea(kinematics.model, kinematics.data, kinematics.configuration, velocity, acceleration)
    return Dynamics(generalized[6:], kinematics.twist_to_base.T.dot(generalized[:6]))


def feedforward(
    kinematics: InverseKinematics,
    dynamics: Dynamics,
    right_share: float,
    aims: tuple[Array, Array] | None = None,
) -> Array:
    """Return the (12,) joint torques tau_ff = alpha tau_R + (1 - alpha) tau_L [N m], eqs. (14)-(15).

    tau_s is the inverse dynamics of the robot rooted in foot s. The free-flyer model gives both at once: what its
    base wrench does to the joints of leg s is taken off. Written about odom's origin, it is the same wrench whichever
    foot it acts on.

    As printed, each foot gets its share of the wrench as it is: right on one foot, but on both the moments about the
    two soles, large and opposed, tilt the feet. With `aims`, each foot takes its share of the wrench as it acts about
    the common centre of pressure, moved to the foot's own aim point: the sum is the same and each foot's centre of
    pressure lies inside its sole.

    Args:
        kinematics: The posture q_d, as `update_jacobian` saw it.
        dynamics: Of its motion.
        right_share: alpha, 1 with all weight on the right foot.
        aims: (3,) aim point of the ZMP on the left and right foot, odom axes [m]; None for eq. (15) as printed.
    """
    torques, wrench = dynamics
    shares = (1.0 - right_share, right_share)
    for side in (0, 1):
        if shares[side] > 0.0:
            on_foot = wrench
            if aims is not None and shares[side] < 1.0:  # all the weight on one foot acts at its own aim point
                on_foot = wrench.copy()
                on_foot[3:] += _moment_of_shift(shares[1 - side] * (aims[side] - aims[1 - side]), wrench)
            torques[LEG_COLUMNS[side]] -= shares[side] * kinematics.leg_twists[side].T.dot(on_foot)
    return torques


def _moment_of_shift(shift: Array, wrench: Array) -> tuple[float, float, float]:
    """Return what moving a wrench by `shift` [m] adds to its moment: shift x force [N m]."""
    x, y, z = shift.tolist()
    fx, fy, fz = wrench[:3].tolist()
    return y * fz - z * fy, z * fx - x * fz, x * fy - y * fx
