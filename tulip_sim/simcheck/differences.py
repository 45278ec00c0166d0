"""By how much two engines part in the same experiment."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tulip_description.quaternion import quaternion_product
from tulip_sim.simcheck.balance import Balance
from tulip_sim.simcheck.engine import Recording, centre_of_pressure

Array = NDArray[np.float64]

ASKED = {
    "joint angles": 5.0,  # [mrad] about the joint error of a walking robot: less does not matter to motion control
    "attitude": 5.0,  # [mrad] as the IMU's error of mounting, with its noise
    "CoM": 5.0,  # [mm] what the estimator of a walking robot is off by
    "CoP": 10.0,  # [mm] what noise of 1 N on the cells of lightly loaded soles makes
    "impulse": 3.0,  # [%]
}
"""What the simulator may be off by at its step of 1 ms, so that nobody who uses it notices."""
SMOOTHING = 20  # [ms] over which the centre of pressure is averaged


class Difference(NamedTuple):
    """A figure of two engines, and what they may differ by at the simulator's step (None: told only)."""

    what: str
    unit: str
    value: float
    asked: float | None


def angles(run: Recording, other: Recording) -> Difference:
    """Return the greatest difference of a joint angle."""
    return Difference(
        "joint angles", "mrad", 1e3 * float(np.abs(run.joints - other.joints).max()), ASKED["joint angles"]
    )


def attitude(run: Recording, other: Recording) -> Difference:
    """Return the greatest angle between the trunks."""
    greatest = 0.0
    for (x, y, z, w), theirs in zip(run.q[:, 3:7].tolist(), other.q[:, 3:7].tolist(), strict=True):
        turn = quaternion_product((-x, -y, -z, w), theirs)
        greatest = max(greatest, 2.0 * math.asin(min(1.0, math.hypot(*turn[:3]))))
    return Difference("attitude", "mrad", 1e3 * greatest, ASKED["attitude"])


def com(b: Balance, other: Balance) -> Difference:
    """Return the greatest distance between the centres of mass."""
    return Difference("CoM", "mm", 1e3 * float(np.linalg.norm(b.com - other.com, axis=1).max()), ASKED["CoM"])


def cop(run: Recording, other: Recording) -> Difference:
    """Return the greatest distance between the centres of pressure, averaged over `SMOOTHING`."""
    apart = np.linalg.norm(smooth_cop(run) - smooth_cop(other), axis=1)
    return Difference("CoP", "mm", 1e3 * float(np.nanmax(apart)), ASKED["CoP"])


def smooth_cop(run: Recording) -> Array:
    """Return (T // SMOOTHING, 2) means of the centre of pressure in map [m], weighted by the load."""
    blocks = run.contact[: len(run.contact) // SMOOTHING * SMOOTHING].reshape(-1, SMOOTHING, 6).sum(axis=1)
    return centre_of_pressure(blocks)


def impulse(run: Recording, other: Recording, milliseconds: int | None = None) -> Difference:
    """Return by how much the ground's vertical impulse differs, of the first milliseconds or of the whole run."""
    own, their = (float(each.contact[:milliseconds, 2].sum()) for each in (run, other))
    name = "impulse" if milliseconds is None else f"impulse until {milliseconds} ms"
    return Difference(name, "%", 100.0 * abs(own / their - 1.0), ASKED["impulse"])


def velocities(run: Recording, other: Recording, milliseconds: int) -> Difference:
    """Return the greatest difference of a joint velocity after so many milliseconds."""
    apart = np.abs(run.v[milliseconds, 6:] - other.v[milliseconds, 6:])
    return Difference(f"joint velocities after {milliseconds} ms", "rad/s", float(apart.max()), None)
