"""From what motion told to a body file: the base parameters of the CoM, eq. (2), that it amounts to.

A moving body is the sum of the links that are fixed to it, theta_bodies = T theta_links, and the CoM depends on the sum
alone. So the combinations K of eq. (2c) are combinations of the bodies', K = K' T with K' = K T^+. Then all goes on as
for static postures: most probable body, body file.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.robot import Robot
from tulip_motion.identification.base_parameters import BaseParameters, base_parameters
from tulip_motion.identification.com_identification import IdentificationSettings
from tulip_motion.identification.com_regressor import PER_BODY as PER_LINK
from tulip_motion.identification.dynamic_identification import DynamicIdentification
from tulip_motion.identification.zmp_regressor import PER_BODY

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MovingCom:
    """The base parameters of the CoM that motion told; see `ComIdentification`, whose names these are.

    Attributes:
        prior: The robot as it was believed to be.
        settings: What was taken for granted.
        base: Which combinations these are.
        values: (r,) theta_b [m], the last 1.
        covariance: (r, r) [m^2].
        mass: Of the whole robot [kg].
        model_error: Standard deviation of the ZMP's error that is left [m].
    """

    prior: Robot
    settings: IdentificationSettings
    base: BaseParameters
    values: Array
    covariance: Array
    mass: float
    model_error: float


def com_of(found: DynamicIdentification) -> MovingCom:
    """Return the base parameters of the CoM that a dynamic identification found."""
    robot, base = found.robot, base_parameters(found.robot)
    count = len(found.parameters)
    chosen = np.flatnonzero(np.arange(count) % PER_BODY < PER_LINK)  # mass and first moments
    combinations = base.combinations @ np.linalg.pinv(_sums(robot))
    bodies, mass = found.parameters[chosen], found.mass[0]
    values = combinations @ bodies / mass
    # By the whole mass: what all masses have in common drops out.
    total = np.arange(len(chosen)) % PER_LINK == 0
    slope = (combinations - np.outer(values, total)) / mass
    covariance = slope @ found.covariance[np.ix_(chosen, chosen)] @ slope.T
    left = float(np.sqrt(np.mean(found.fit.deviations[:2] ** 2)))
    return MovingCom(robot, IdentificationSettings(), base, values, covariance, mass, left)


def _sums(robot: Robot) -> Array:
    """Return T (4 bodies, 4 links), about the bodies' joints."""
    model = floating_model(robot)
    sums = np.zeros((PER_LINK * (model.njoints - 1), PER_LINK * len(robot.links)))
    for number, link in enumerate(robot.links):
        frame = model.frames[model.getFrameId(link.name)]
        part = np.eye(PER_LINK)
        part[1:, 0] = frame.placement.translation
        part[1:, 1:] = frame.placement.rotation
        row, column = PER_LINK * (frame.parentJoint - 1), PER_LINK * number
        sums[row : row + PER_LINK, column : column + PER_LINK] = part
    return sums
