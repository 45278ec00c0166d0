"""Whether a body can be: its pseudo-inertia."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Vector

Array = NDArray[np.float64]


def pseudo_inertia(mass: float, com: Vector, inertia: Vector) -> Array:
    """Return (4, 4) J = integral of (x, 1)(x, 1)^T dm in the link's frame.

    J = [[S, m c], [m c^T, m]] with the second moments S = 1/2 tr(I) 1 - I of the inertia I about the link's origin. It
    is positive definite exactly if some spread of positive mass has this mass, CoM and inertia (Wensing, Kim and
    Slotine, "Linear matrix inequalities for physically consistent inertial parameter identification", 2018).

    Args:
        mass: [kg].
        com: In the link's frame [m].
        inertia: Principal moments about the CoM, along the link's axes [kg m^2].
    """
    c = np.array(com)
    about_com = 0.5 * sum(inertia) * np.eye(3) - np.diag(inertia)
    J = np.empty((4, 4))
    J[:3, :3] = about_com + mass * np.outer(c, c)
    J[:3, 3] = J[3, :3] = mass * c
    J[3, 3] = mass
    return J


def why_impossible(mass: float, com: Vector, inertia: Vector) -> str:
    """Return "" if a body can have this mass, CoM and inertia, else the reason why none can, in words."""
    if not all(math.isfinite(value) for value in (mass, *com, *inertia)):
        return f"its mass is {mass} kg, its CoM {com} m, its inertia {inertia} kg m^2; expected finite numbers"
    if mass <= 0.0:
        return f"its mass is {mass:.6g} kg; expected > 0"
    if min(inertia) <= 0.0:
        return f"its inertia is {inertia} kg m^2; expected moments > 0"
    if np.linalg.eigvalsh(pseudo_inertia(1.0, (0.0, 0.0, 0.0), inertia))[0] > 0.0:
        return ""  # J is S about the CoM and m, moved; moving keeps its definiteness
    largest = max(inertia)
    rest = sum(inertia) - largest
    return (
        f"its pseudo-inertia is not positive definite: the moment {largest:.6g} kg m^2 is not less than the sum of the"
        f" other two, {rest:.6g} kg m^2"
    )
