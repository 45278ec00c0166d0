"""Which postures to hold: the D-optimal choice from many candidates.

Each posture gives two rows W, the CoP by the base parameters and by the angles at which the IMU is mounted, eq. (2d).
With equal errors of all CoPs, the covariance of what is sought is proportional to (sum W^T W)^-1; its determinant, the
volume of the ellipsoid of uncertainty, is smallest for the set that maximizes log det sum W^T W. Exchanging one posture
at a time finds a set that no exchange improves (Fedorov, Theory of Optimal Experiments, 1972).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import Robot
from tulip_motion.identification.base_parameters import base_parameters
from tulip_motion.identification.com_regressor import regressor_of, standard_parameters
from tulip_motion.identification.static_postures import StaticPosture

Array = NDArray[np.float64]
Choice = tuple[int, ...]

GAIN = 1e-6  # of log det, below which an exchange is none
ROUNDS = 50
RIDGE = 1e-9  # [m^2] lets a first set that leaves parameters open be improved


def rows_of(robot: Robot, postures: Sequence[StaticPosture]) -> Array:
    """Return (m, 2, r) W of m postures on level ground, as the robot is believed to be.

    The columns are those of the base parameters that are not known, and of the two mounting angles of the IMU.
    """
    base, theta = base_parameters(robot), standard_parameters(robot)
    rows = []
    for posture in postures:
        full = regressor_of(robot, posture.side).cop(posture.joint_positions, -posture.up)
        mount = -float(full.com[2] @ theta) * full.slope_change
        rows.append(np.hstack([base.rows(full.cop)[:, base.unknown], mount]))
    return np.array(rows)


def information(rows: Array, choice: Choice) -> float:
    """Return log det of the information of some of the postures; minus infinity if they leave something open.

    Args:
        rows: (m, 2, r) W of all postures.
        choice: Which count.
    """
    chosen = rows[list(choice)].reshape(-1, rows.shape[2])
    return float(np.linalg.slogdet(chosen.T @ chosen)[1])


def choose(rows: Array, feet: Sequence[str], number: int, rng: np.random.Generator) -> Choice:
    """Return the indices of a D-optimal set of postures with as many on each foot.

    Args:
        rows: (m, 2, r) W of the candidates, columns independent over all of them.
        feet: m stance feet. No foot alone tells everything, so both are chosen for together.
        number: How many to choose on each foot.
        rng: Chooses what to begin with.

    Raises:
        ValueError: if so few postures cannot tell all parameters, or there are fewer candidates on a foot.
    """
    sides, of_side = np.unique(feet, return_inverse=True)
    fewest, parameters = int(np.bincount(of_side).min()), rows.shape[2]
    if not parameters <= 2 * number * len(sides) or number > fewest:
        raise ValueError(
            f"{number} postures a foot are to be chosen from {fewest} for {parameters} parameters;"
            f" expected {-(-parameters // (2 * len(sides)))} to {fewest}"
        )
    orders = [rng.permutation(np.flatnonzero(of_side == side)) for side in range(len(sides))]
    chosen = [int(index) for order in orders for index in order[:number]]
    for _ in range(ROUNDS):
        if not _exchange_each(rows, of_side, chosen):
            break
    return tuple(sorted(chosen))


def _exchange_each(rows: Array, of_side: NDArray[np.intp], chosen: list[int]) -> bool:
    """Exchange each of the chosen for the best candidate on its foot; return whether that changed anything."""
    changed = False
    ridge = RIDGE * np.eye(rows.shape[2])
    for place, old in enumerate(chosen):
        others = [index for index in chosen if index != old]
        rest = rows[others].reshape(-1, rows.shape[2])
        spread = np.linalg.inv(rest.T @ rest + ridge)
        # det(A + W^T W) = det(A) det(I + W A^-1 W^T): all candidates at once.
        gains = np.linalg.slogdet(np.eye(2) + rows @ spread @ rows.transpose(0, 2, 1))[1]
        present = gains[old]
        gains[others] = -np.inf
        gains[of_side != of_side[old]] = -np.inf
        best = int(np.argmax(gains))
        if gains[best] > present + GAIN:
            chosen[place] = best
            changed = True
    return changed
