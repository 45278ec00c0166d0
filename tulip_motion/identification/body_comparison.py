"""Two bodies of one robot beside each other: their base parameters, and the CoM in postures that nobody held."""

from __future__ import annotations

from typing import get_args

import numpy as np
from numpy.typing import NDArray

from tulip_description.model import Side
from tulip_description.robot import Robot
from tulip_motion.identification.base_parameters import base_parameters
from tulip_motion.identification.com_regressor import regressor_of, standard_parameters

Array = NDArray[np.float64]


def base_values(robot: Robot) -> Array:
    """Return (r,) theta_b of eq. (2) that a robot's masses and CoMs amount to, by the whole mass [m]."""
    return np.asarray(base_parameters(robot).combinations @ standard_parameters(robot))


def com_rows(robot: Robot, count: int, rng: np.random.Generator) -> Array:
    """Return (count, 2, r) R_b of eq. (2), x and y, for postures anywhere inside the joints' ranges.

    Their product with base parameters is the CoM in the sole frame of the left and the right foot in turn [m].

    Args:
        robot: Gives kinematics and ranges.
        count: Of postures.
        rng: Which ones.
    """
    base, (low, high) = base_parameters(robot), robot.position_limits
    feet = get_args(Side)
    postures = rng.uniform(low, high, (count, len(low)))
    rows = [base.rows(regressor_of(robot, feet[index % 2]).com(joints))[:2] for index, joints in enumerate(postures)]
    return np.array(rows)


def rms(differences: Array) -> Array:
    """Return (2,) the root of the mean square of (n, 2) differences, x and y."""
    return np.asarray(np.sqrt(np.mean(np.square(differences), axis=0)))
