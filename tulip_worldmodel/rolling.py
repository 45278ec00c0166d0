"""How a ball rolls: rolling friction takes the same speed from it each second, until it rests.

    v' = -a v / |v|  while |v| > 0

so that a ball of speed s stops after s / a, and s^2 / (2 a) further on. The derivative of this jumps where the ball
stops, and a ball whose velocity is known only roughly may roll, stop, or rest. So the law is not linearized at the
estimate but over the whole Gaussian of the velocity (statistical linearization, A. Gelb, "Applied Optimal
Estimation", MIT Press 1974, ch. 6), with its moments taken from four points at distances of sqrt(2) standard deviations
(I. Arasaratnam and S. Haykin, "Cubature Kalman filters", IEEE Trans. Automatic Control 54, 2009).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_worldmodel.positive_part import positive_part

Array = NDArray[np.float64]

DECELERATION = 0.35  # [m/s^2] of a ball on carpet; let one roll 2 m and stop the time to measure it
ROLLING_SHARE = 0.6
"""Of a kicked ball's speed that is left when it has ceased to slide: 1 / (1 + I / m r^2), with 2/3 for a thin shell."""
LEAST_VARIANCE = 1e-12  # [m^2/s^2] keeps the inverse of a velocity's covariance finite
LEAST = LEAST_VARIANCE * np.eye(2)


@dataclass(frozen=True)
class Slowing:
    """What friction makes of a velocity: keep v + drop, and a little noise for what is not linear.

    Attributes:
        keep: (2, 2).
        drop: (2,) [m/s].
        noise: (2, 2) covariance [m^2/s^2].
    """

    keep: Array
    drop: Array
    noise: Array


def slowed(velocities: Array, deceleration: float, duration: float) -> Array:
    """Return (n, 2) velocities [m/s] after a time [s] of rolling; a ball that stops stays where it is."""
    speeds = np.maximum(np.hypot(velocities[:, 0], velocities[:, 1]), 1e-9)
    return np.asarray(velocities * np.maximum(0.0, 1.0 - deceleration * duration / speeds)[:, None])


def slowing(velocity: Array, covariance: Array, deceleration: float, duration: float) -> Slowing:
    """Return what friction makes of an uncertain velocity.

    Args:
        velocity: (2,) [m/s].
        covariance: (2, 2) [m^2/s^2].
        deceleration: a [m/s^2].
        duration: [s].
    """
    spread = covariance + LEAST
    root = math.sqrt(2.0) * np.linalg.cholesky(spread).T
    before = velocity + np.concatenate((root, -root))
    after = slowed(before, deceleration, duration)
    mean = after.sum(axis=0) / len(after)
    off = after - mean
    crossed = (before - velocity).T @ off / len(before)
    keep = np.linalg.solve(spread, crossed).T
    noise = off.T @ off / len(before) - keep @ spread @ keep.T
    return Slowing(keep, mean - keep @ velocity, positive_part(noise))


def rest(position: Array, velocity: Array, deceleration: float) -> tuple[Array, float]:
    """Return where a ball will stop (2,) [m], and after what time [s].

    Args:
        position: (2,) [m].
        velocity: (2,) [m/s].
        deceleration: a [m/s^2].
    """
    speed = math.hypot(float(velocity[0]), float(velocity[1]))
    return position + velocity * speed / (2.0 * deceleration), speed / deceleration
