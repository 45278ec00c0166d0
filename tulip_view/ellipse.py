"""How sure an estimate on the ground is, as an ellipse."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D

Array = NDArray[np.float64]

SIGMAS = 2.0
TURN = np.linspace(0.0, 2.0 * math.pi, 33)
LARGEST = 3.0  # [m] of its half axis; more says no more than "anywhere", and covers the rest


def ellipse(centre: Array, covariance: Array) -> Array | None:
    """Return (33, 2) points of the ellipse of SIGMAS standard deviations, or None for one that is too large or unknown.

    Args:
        centre: (2,) [m].
        covariance: (2, 2) [m^2].
    """
    if not np.isfinite(covariance).all():
        return None
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2.0)
    radii = SIGMAS * np.sqrt(np.maximum(values, 0.0))
    if radii.max() > LARGEST:
        return None
    points: Array = centre + (np.column_stack([np.cos(TURN), np.sin(TURN)]) * radii) @ vectors.T
    return points


def robot_ellipse(world: Any) -> Array | None:
    """Return the ellipse of the robot's place in the map, of a WorldState message; see `ellipse`."""
    covariance = np.asarray(world.robot_covariance).reshape(3, 3)
    return ellipse(np.asarray(world.robot_pose, dtype=float)[:2], covariance[:2, :2])


def ball_ellipse(world: Any) -> Array | None:
    """Return the ellipse of the ball's place in the map, of a WorldState message that knows a ball; see `ellipse`.

    Of the ball as seen from the robot: where the robot itself is not sure, the ball is in the map neither.
    """
    ball = world.ball
    turn = Pose2D(0.0, 0.0, float(world.robot_pose[2])).rotation()
    spread = turn @ np.asarray(ball.covariance).reshape(4, 4)[:2, :2] @ turn.T
    return ellipse(np.asarray(ball.position_in_map, dtype=float), spread)
