"""What is believed of the bodies before anything was measured: the robot file, and how far it may be wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_motion.identification.com_regressor import PER_BODY, standard_parameters
from tulip_motion.identification.identification_error import IdentificationError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Spread:
    """How far each body's mass and CoM may be from the robot file: standard deviations.

    Attributes:
        mass: Share of the body's mass.
        com: On each axis [m].
        unlisted: Mass that each body may carry and the file does not know of [kg].
    """

    mass: float = 0.2
    com: float = 0.02
    unlisted: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if a spread is not finite, mass or com not positive, or unlisted negative.
        """
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0.0) or (value == 0.0 and name != "unlisted"):
                raise ValueError(f"{name} is {value}; expected {'>= 0' if name == 'unlisted' else '> 0'}")


@dataclass(frozen=True)
class BodyPrior:
    """A Gaussian of the standard parameters theta = mean + factor z, z of independent unit normals.

    z_0 of each body is the error of its mass, z_1 to z_3 the shift of its CoM, each by its standard deviation:

        m = m_0 + s_m z_0,    m c = m_0 c_0 + c_0 s_m z_0 + (m_0 + unlisted) s_c (z_1, z_2, z_3)              (2e)

    to first order in the errors. That the masses add up to what the cells weigh is not part of it.

    Attributes:
        mean: (p,) theta of the robot file, by the weighed mass.
        factor: (p, p) lower triangular, by blocks of one body.
    """

    mean: Array
    factor: Array

    @property
    def covariance(self) -> Array:
        """(p, p) of theta."""
        covariance: Array = self.factor @ self.factor.T
        return covariance


def body_prior(robot: Robot, spread: Spread, total_mass: float) -> BodyPrior:
    """Return the prior of a robot that weighs total_mass [kg]."""
    factor = np.zeros((PER_BODY * len(robot.links),) * 2)
    for body, link in enumerate(robot.links):
        block = slice(PER_BODY * body, PER_BODY * (body + 1))
        sigma = math.hypot(spread.mass * link.mass, spread.unlisted)
        part = np.eye(PER_BODY) * (link.mass + spread.unlisted) * spread.com
        part[:, 0] = sigma * np.array([1.0, *link.com])
        factor[block, block] = part / total_mass
    return BodyPrior(standard_parameters(robot, total_mass), factor)


def greatest_mass_error(robot: Robot, spread: Spread) -> float:
    """Return by how much the whole robot's mass may differ from the file [kg]: all bodies err to one side."""
    return spread.mass * robot.mass + spread.unlisted * len(robot.links)


def check_weight(robot: Robot, mass: float, spread: Spread) -> None:
    """Check that what the cells weigh can be a robot.

    Args:
        robot: As it is believed to be.
        mass: As the cells weigh it [kg].
        spread: Of its bodies about the robot file.

    Raises:
        IdentificationError: if it cannot.
    """
    allowed = greatest_mass_error(robot, spread)
    if abs(mass - robot.mass) > allowed:
        raise IdentificationError(
            f"the cells weigh {mass:.2f} kg, the robot {robot.variant} has {robot.mass:.2f} kg, and masses are taken to"
            f" be known to {allowed:.2f} kg in all: the log belongs to another robot, or the cells' scale is wrong; if"
            " it is this robot, state a larger spread of masses"
        )
