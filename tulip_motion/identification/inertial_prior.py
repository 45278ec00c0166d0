"""What is known of the robot's inertial parameters before it has moved: drawings, and how far they may be wrong."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.robot import Robot
from tulip_motion.identification.correlated_fit import Prior
from tulip_motion.identification.zmp_regressor import PER_BODY, parameters_of

Array = NDArray[np.float64]

MASS_SHARE = 0.12  # standard deviation of a link's mass: that of an even spread over +-20 %
COM_DISTANCE = 0.012  # [m] of its CoM along each axis: that of an even spread over +-2 cm
INERTIA_SHARE = 0.12  # of its moments of inertia, by the mean moment, beyond what its mass explains


def inertial_prior(
    robot: Robot,
    mass_share: float = MASS_SHARE,
    com_distance: float = COM_DISTANCE,
    inertia_share: float = INERTIA_SHARE,
) -> Prior:
    """Return the standard parameters of a robot with their covariance.

    Each link errs independently of the others; links that are fixed to one another add up. To first order

        d(m, m c, I) = (1, c, I/m) dm + (0, m dc, d(m S(c)^T S(c))) + (0, 0, dI)

    Args:
        robot: As it is believed to be.
        mass_share: Standard deviation of each link's mass, by its mass.
        com_distance: Of each link's CoM along each axis [m].
        inertia_share: Of each of the six entries of its inertia about its CoM, by their mean moment.

    Raises:
        ValueError: if one of them is not positive.
    """
    for name, value in (("mass_share", mass_share), ("com_distance", com_distance), ("inertia_share", inertia_share)):
        if not value > 0.0:
            raise ValueError(f"{name} is {value}; expected > 0")
    model = floating_model(robot)
    mean = parameters_of(model)
    covariance = np.zeros((len(mean), len(mean)))
    for link in robot.links:
        frame = model.frames[model.getFrameId(link.name)]
        com, inertia = frame.placement.translation + np.array(link.com), np.diag(link.inertia)
        columns = [mass_share * pin.Inertia(link.mass, com, inertia).toDynamicParameters()]
        for shift in com_distance * np.eye(3):
            # A central difference: the square of the shift drops out.
            ahead, back = (pin.Inertia(link.mass, com + way, inertia) for way in (shift, -shift))
            columns.append(0.5 * (ahead.toDynamicParameters() - back.toDynamicParameters()))
        # What first order leaves out of a shift, its square, counts where a link is light and small.
        size = inertia_share * float(np.trace(inertia)) / 3.0 + link.mass * com_distance**2
        columns += [size * np.concatenate([np.zeros(4), unit]) for unit in np.eye(6)]
        spread = np.stack(columns, axis=1)
        start = PER_BODY * (frame.parentJoint - 1)
        block = slice(start, start + PER_BODY)
        covariance[block, block] += spread @ spread.T
    return Prior(mean, covariance)
