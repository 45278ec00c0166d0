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
ROOT_2, ROOT_8 = math.sqrt(2.0), math.sqrt(8.0)


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


def slowed(x: float, y: float, loss: float) -> tuple[float, float]:
    """Return a velocity [m/s] that lost some speed [m/s]; a ball that stops stays where it is."""
    speed = math.hypot(x, y)
    left = max(0.0, 1.0 - loss / speed) if speed > 0.0 else 0.0
    return left * x, left * y


def slowing(velocity: Array, covariance: Array, deceleration: float, duration: float) -> Slowing:
    """Return what friction makes of an uncertain velocity, written out in numbers: numpy takes ten times as long.

    Args:
        velocity: (2,) [m/s].
        covariance: (2, 2) [m^2/s^2].
        deceleration: a [m/s^2].
        duration: [s].
    """
    (a, b), (_, d) = covariance.tolist()
    x, y = velocity.tolist()
    loss = deceleration * duration
    # The covariance is L L'; two points lie at v +- sqrt(2) times each column of L.
    l11 = math.sqrt(a + LEAST_VARIANCE)
    l21 = b / l11
    l22 = math.sqrt(max(d + LEAST_VARIANCE - l21**2, LEAST_VARIANCE))
    step_x, step_y, step = ROOT_2 * l11, ROOT_2 * l21, ROOT_2 * l22
    ahead, behind = slowed(x + step_x, y + step_y, loss), slowed(x - step_x, y - step_y, loss)
    above, below = slowed(x, y + step, loss), slowed(x, y - step, loss)
    points = (ahead, behind, above, below)
    mean_x, mean_y = sum(point[0] for point in points) / 4.0, sum(point[1] for point in points) / 4.0
    # keep = E[after before'] / E[before before'], of deviations: (differences of opposite points) L^-1 / sqrt(8).
    first_x, first_y = ahead[0] - behind[0], ahead[1] - behind[1]
    second_x, second_y = above[0] - below[0], above[1] - below[1]
    kxy, kyy = second_x / (ROOT_8 * l22), second_y / (ROOT_8 * l22)
    kxx, kyx = first_x / (ROOT_8 * l11) - kxy * l21 / l11, first_y / (ROOT_8 * l11) - kyy * l21 / l11
    # What it leaves unexplained: the points' covariance less that of their linear part.
    off = [(point[0] - mean_x, point[1] - mean_y) for point in points]
    nxx = sum(u * u for u, _ in off) / 4.0 - (first_x**2 + second_x**2) / 8.0
    nxy = sum(u * v for u, v in off) / 4.0 - (first_x * first_y + second_x * second_y) / 8.0
    nyy = sum(v * v for _, v in off) / 4.0 - (first_y**2 + second_y**2) / 8.0
    return Slowing(
        np.array([[kxx, kxy], [kyx, kyy]]),
        np.array([mean_x - kxx * x - kxy * y, mean_y - kyx * x - kyy * y]),
        positive_part(np.array([[nxx, nxy], [nxy, nyy]])),
    )


def rest(position: Array, velocity: Array, deceleration: float) -> tuple[Array, float]:
    """Return where a ball will stop (2,) [m], and after what time [s].

    Args:
        position: (2,) [m].
        velocity: (2,) [m/s].
        deceleration: a [m/s^2].
    """
    speed = math.hypot(float(velocity[0]), float(velocity[1]))
    return position + velocity * speed / (2.0 * deceleration), speed / deceleration
