"""Feedforward torques by inverse dynamics, eqs. (14)-(15)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_motion.inverse_kinematics import inverse_of_base_jacobian, skew

Array = NDArray[np.float64]


def feedforward(
    model: Any,
    data: Any,
    configuration: Array,
    velocity: Array,
    acceleration: Array,
    soles: tuple[Array, Array],
    sole_jacobians: tuple[Array, Array],
    aims: tuple[Array, Array],
    right_share: float,
) -> Array:
    """Return the (12,) joint torques [N m] of eq. (14), the weight shared by both feet in the spirit of eq. (15).

    The free-flyer model's inverse dynamics leaves a base wrench that in truth the ground supplies through
    the feet; mapped to the soles and from there to the joints, it is taken off. Eq. (15) gives each foot its
    share alpha of that whole wrench, with the moment that it has about this foot: correct on one foot, but
    on both the two moments, large and opposed, tilt the feet. Here each foot takes its share of the wrench
    as it acts about the common centre of pressure, moved to the foot's own aim point: the sum is the same
    and each foot's centre of pressure lies inside its sole.

    Args:
        model: Pinocchio model of the legs with a free flyer at base_link.
        data: Its data.
        configuration: (19,) q_d.
        velocity: (18,) its velocity.
        acceleration: (18,) its acceleration; zero leaves gravity and Coriolis terms.
        soles: (3,) position of the left and right sole, odom axes [m].
        sole_jacobians: (6, 18) of the left and right sole, odom axes, at the configuration.
        aims: (3,) aim point of the ZMP on the left and right foot, odom axes [m].
        right_share: alpha, 1 with all weight on the right foot.
    """
    generalized = pin.rnea(model, data, configuration, velocity, acceleration)
    torques: Array = generalized[6:].copy()
    wrench = inverse_of_base_jacobian(sole_jacobians[0]).T @ generalized[:6]
    force = wrench[:3]
    turn = skew(force)  # r x f = -S(f) r
    centre = (1.0 - right_share) * aims[0] + right_share * aims[1]
    moment = wrench[3:] - turn @ (soles[0] - centre)
    for share, sole, jacobian, aim in zip((1.0 - right_share, right_share), soles, sole_jacobians, aims, strict=True):
        if share > 0.0:
            at_sole = np.concatenate([force, moment - turn @ (aim - sole)])
            torques -= share * (jacobian[:, 6:].T @ at_sole)
    return torques
