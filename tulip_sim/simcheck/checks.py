"""The bounds of the simulator's balances, and why they are what they are.

pybullet solves for velocities once a step (semi-implicit Euler), so all its errors are of the first order of the step
h. The bounds follow from that; docs/simcheck.md has what was measured beside them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tulip_description.materials import GRAVITY
from tulip_sim.simcheck.balance import Balance
from tulip_sim.simcheck.engine import Recording

# Joints move at rates of about 10 / s, so that a first-order error is 10 / s * 1 ms = 1 % of what they bring about.
SPIN_SHARE = 1e-2  # of the greatest spin
MOMENTUM_SHARE = 1e-3  # of the weight's impulse, of which the motion of the legs makes about a tenth
MARGIN = 1.5  # on the energy of a step, of which the first order is bounded
STEPS_TO_FOUR_CORNERS = 3  # as seen: pybullet finds one more corner of a sole that meets a plane with every step
SLOP = 2e-5  # [m] twice the depth at which soles are seen to rest


class Check(NamedTuple):
    """A figure with its bound.

    Attributes:
        what: Name of the figure.
        unit: Of both.
        value: What came out.
        bound: What it may be.
    """

    what: str
    unit: str
    value: float
    bound: float


def in_air(b: Balance, substeps: int) -> list[Check]:
    """Return the checks of energy for a robot that nothing touches.

    Of a robot under its weight alone the step keeps not the energy E, but E + P h / 2 with P the power that the weight
    feeds in: E goes to and fro with P. Torques swallow dv^T D dv / 2 a step; with k steps a millisecond that is 1 / k
    of what `Balance` sums.
    """
    shift = 0.5e-3 / substeps * float(np.ptp(b.fed))
    swallowed = float(b.swallowed[-1]) / substeps
    return [
        Check("energy from nowhere", "J", float(b.energy_error.max()), MARGIN * shift),
        Check("energy lost", "J", -float(b.energy_error.min()), MARGIN * (shift + swallowed)),
    ]


def on_ground(run: Recording, b: Balance, mass: float, speed: float, substeps: int) -> list[Check]:
    """Return the checks of energy and depth for a robot that comes to the ground with a speed [m/s].

    The ground only takes energy, and plastic impacts take dv^T D dv / 2. But a sole sinks in while its corners are
    found, and lifting the robot out of that depth costs its weight times the depth.
    """
    error, depth, h = b.energy_error, max(float(run.depth.max()), 0.0), 1e-3 / substeps
    regained = float((error - np.minimum.accumulate(error)).max())
    fall = STEPS_TO_FOUR_CORNERS * h
    return [
        Check("energy from nowhere", "J", regained, mass * GRAVITY * depth),
        Check("energy lost", "J", -float(error.min()), MARGIN * float(b.swallowed[-1])),
        Check("depth of a sole", "mm", 1e3 * depth, 1e3 * (fall * (speed + GRAVITY * fall) + SLOP)),
    ]


def momenta(run: Recording, b: Balance, mass: float) -> list[Check]:
    """Return the checks of momentum and spin of a robot that is not held.

    The lever arm of a ground force is as uncertain as the way of the CoM in half a millisecond.
    """
    weight, way = mass * GRAVITY, float(np.linalg.norm(np.diff(b.com, axis=0), axis=1).sum())
    loaded = weight if run.contact.any() else 0.0
    return [
        Check(
            "linear momentum",
            "N s",
            float(np.linalg.norm(b.momentum_error, axis=1).max()),
            MOMENTUM_SHARE * weight * 1e-3 * len(run.push),
        ),
        Check(
            "spin about the CoM",
            "N m s",
            float(np.linalg.norm(b.spin_error, axis=1).max()),
            SPIN_SHARE * float(np.linalg.norm(b.spin, axis=1).max()) + loaded * way * 0.5e-3,
        ),
    ]
