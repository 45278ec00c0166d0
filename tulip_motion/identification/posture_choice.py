"""Which postures to hold: the D-optimal choice from many candidates.

Each posture gives two rows W of eq. (2), CoM = W theta. With equal errors of all CoPs, the covariance of theta is
proportional to (sum W^T W)^-1; its determinant, the volume of the ellipsoid of uncertainty, is smallest for the set
that maximizes log det sum W^T W. Exchanging one posture at a time finds a set that no exchange improves (Fedorov, Theory
of Optimal Experiments, 1972).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Choice = tuple[int, ...]

RANK_TOLERANCE = 1e-9  # of the largest singular value; below it a combination of parameters moves no CoM
GAIN = 1e-6  # of log det, below which an exchange is none
ROUNDS = 50


def independent(rows: Array) -> Array:
    """Return the rows in as many columns as are independent.

    Args:
        rows: (m, 2, n) W of m postures; columns may depend on each other, as those of single links do.

    Returns:
        (m, 2, r) the same rows in an orthonormal basis of the combinations that matter.
    """
    _, sizes, basis = np.linalg.svd(rows.reshape(-1, rows.shape[2]), full_matrices=False)
    reduced: Array = rows @ basis[sizes > RANK_TOLERANCE * sizes[0]].T
    return reduced


def information(rows: Array, choice: Choice) -> float:
    """Return log det of the information of some of the postures; minus infinity if they leave something open.

    Args:
        rows: (m, 2, r) W of all postures, columns independent.
        choice: Which count.
    """
    chosen = rows[list(choice)].reshape(-1, rows.shape[2])
    return float(np.linalg.slogdet(chosen.T @ chosen)[1])


def choose(rows: Array, number: int, rng: np.random.Generator) -> Choice:
    """Return the indices of a D-optimal set of postures.

    Args:
        rows: (m, 2, n) W of the candidates.
        number: How many to choose.
        rng: Chooses what to begin with.

    Raises:
        ValueError: if so few postures cannot tell all parameters, or there are fewer candidates.
    """
    rows = independent(rows)
    candidates, _, parameters = rows.shape
    if not parameters <= 2 * number <= 2 * candidates:
        raise ValueError(
            f"{number} postures are to be chosen from {candidates} for {parameters} parameters;"
            f" expected {-(-parameters // 2)} to {candidates}"
        )
    chosen = [int(index) for index in rng.permutation(candidates)[:number]]
    for _ in range(ROUNDS):
        if not _exchange_each(rows, chosen):
            break
    return tuple(sorted(chosen))


def _exchange_each(rows: Array, chosen: list[int]) -> bool:
    """Exchange each of the chosen for the best candidate; return whether that changed anything."""
    changed = False
    ridge = 1e-12 * np.eye(rows.shape[2])  # lets a first set that leaves parameters open be improved
    for place, old in enumerate(chosen):
        rest = rows[[index for index in chosen if index != old]].reshape(-1, rows.shape[2])
        spread = np.linalg.inv(rest.T @ rest + ridge)
        # det(A + W^T W) = det(A) det(I + W A^-1 W^T): all candidates at once.
        gains = np.linalg.slogdet(np.eye(2) + rows @ spread @ rows.transpose(0, 2, 1))[1]
        present = gains[old]
        gains[[index for index in chosen if index != old]] = -np.inf
        best = int(np.argmax(gains))
        if gains[best] > present + GAIN:
            chosen[place] = best
            changed = True
    return changed
