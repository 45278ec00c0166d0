"""Feedforward torques by inverse dynamics, eqs. (14)-(15)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_motion.inverse_kinematics import inverse_of_base_jacobian, skew

Array = NDArray[np.float64]


def distance_share(com: Array, left: Array, right: Array) -> float:
    """Return alpha of eq. (15) from the CoM's horizontal distances to the feet: 1 over the right, 0 over the left.

    Args:
        com: (3,) CoM [m].
        left: (3,) left sole, same frame [m].
        right: (3,) right sole [m].
    """
    to_left = float(np.hypot(com[0] - left[0], com[1] - left[1]))
    to_right = float(np.hypot(com[0] - right[0], com[1] - right[1]))
    return to_left / (to_left + to_right)


def feedforward(
    model: Any,
    data: Any,
    configuration: Array,
    velocity: Array,
    acceleration: Array,
    soles: tuple[Array, Array],
    sole_jacobians: tuple[Array, Array],
    right_share: float,
    aims: tuple[Array, Array] | None = None,
) -> Array:
    """Return the (12,) joint torques tau_ff = alpha tau_R + (1 - alpha) tau_L [N m], eqs. (14)-(15).

    tau_s is the inverse dynamics of the robot rooted in foot s. The free-flyer model gives both at once: its inverse
    dynamics leaves a base wrench that in truth the ground supplies through foot s, so that wrench, mapped to the
    sole and from there to the joints, is taken off.

    As printed, each foot gets its share of the wrench with the moment that it has about this foot: right on one foot,
    but on both the two moments, large and opposed, tilt the feet. With `aims`, each foot takes its share of the
    wrench as it acts about the common centre of pressure, moved to the foot's own aim point: the sum is the same
    and each foot's centre of pressure lies inside its sole.

    Args:
        model: Pinocchio model of the legs with a free flyer at base_link.
        data: Its data.
        configuration: (19,) q_d.
        velocity: (18,) its velocity.
        acceleration: (18,) its acceleration; zero leaves gravity and Coriolis terms.
        soles: (3,) position of the left and right sole, odom axes [m].
        sole_jacobians: (6, 18) of the left and right sole, odom axes, at the configuration.
        right_share: alpha, 1 with all weight on the right foot.
        aims: (3,) aim point of the ZMP on the left and right foot, odom axes [m]; None for eq. (15) as printed.
    """
    generalized = pin.rnea(model, data, configuration, velocity, acceleration)
    torques: Array = generalized[6:].copy()
    shares = (1.0 - right_share, right_share)
    wrench = inverse_of_base_jacobian(sole_jacobians[0]).T @ generalized[:6]  # about the left sole
    force, moment = wrench[:3], wrench[3:]
    turn = skew(force)  # r x f = -S(f) r
    for side in (0, 1):
        if shares[side] > 0.0:
            lever = soles[0] - soles[side]
            if aims is not None:
                lever = lever + aims[side] - shares[0] * aims[0] - shares[1] * aims[1]
            at_sole = np.concatenate([force, moment - turn @ lever])
            torques -= shares[side] * (sole_jacobians[side][:, 6:].T @ at_sole)
    return torques
