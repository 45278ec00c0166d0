"""What is known of the robot's inertial parameters before it has moved: drawings, and how far they may be wrong."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.robot import Robot
from tulip_motion.identification.body_prior import Spread
from tulip_motion.identification.correlated_fit import Prior
from tulip_motion.identification.zmp_regressor import PER_BODY, parameters_of

Array = NDArray[np.float64]

INERTIA_SHARE = 0.2
"""Standard deviation of a link's moments of inertia by their mean, beyond what its mass explains."""


def inertial_prior(robot: Robot, spread: Spread | None = None, inertia_share: float = INERTIA_SHARE) -> Prior:
    """Return the standard parameters (10 b,) of a robot with their covariance.

    Each link errs independently of the others; links that are fixed to one another add up. To first order

        d(m, m c, I) = (1, c, I/m) dm + (0, m dc, d(m S(c)^T S(c))) + (0, 0, dI)                          (D8)

    Args:
        robot: As it is believed to be.
        spread: Of the links' masses and CoMs.
        inertia_share: Of each of the six entries of a link's inertia about its CoM, by their mean moment.

    Raises:
        ValueError: if inertia_share is not positive.
    """
    spread = spread if spread is not None else Spread()
    if not inertia_share > 0.0:
        raise ValueError(f"inertia_share is {inertia_share}; expected > 0")
    model = floating_model(robot)
    mean = parameters_of(model)
    covariance = np.zeros((len(mean), len(mean)))
    for link in robot.links:
        frame = model.frames[model.getFrameId(link.name)]
        com, inertia = frame.placement.translation + np.array(link.com), np.diag(link.inertia)
        as_is = pin.Inertia(link.mass, com, inertia).toDynamicParameters()
        columns = [math.hypot(spread.mass, spread.unlisted / link.mass) * as_is]
        mass = link.mass + spread.unlisted
        for shift in spread.com * np.eye(3):
            # A central difference: the square of the shift drops out.
            ahead, back = (pin.Inertia(mass, com + way, inertia) for way in (shift, -shift))
            columns.append(0.5 * (ahead.toDynamicParameters() - back.toDynamicParameters()))
        # What first order leaves out of a shift, its square, counts where a link is light and small.
        size = inertia_share * float(np.trace(inertia)) / 3.0 + mass * spread.com**2
        columns += [size * np.concatenate([np.zeros(4), unit]) for unit in np.eye(6)]
        factor = np.stack(columns, axis=1)
        start = PER_BODY * (frame.parentJoint - 1)
        block = slice(start, start + PER_BODY)
        covariance[block, block] += factor @ factor.T
    return Prior(mean, covariance)
