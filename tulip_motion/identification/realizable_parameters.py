"""The nearest bodies that can be, to parameters that linear equations gave.

A body of positive mass everywhere has a positive definite pseudo-inertia J (see `tulip_description.pseudo_inertia`).
Each such J has one factor J = U U^T with U upper triangular and a positive diagonal; ten numbers theta, four of them
logarithms, give U, so that whatever theta is, the body can be (Rucker and Wensing, "Smooth parameterization of
rigid-body inertia", 2022). The most probable bodies that can be are those of

    theta = argmin (pi(theta) - pi)^T C^-1 (pi(theta) - pi) + w^2 |theta - theta_0|^2                      (D9)

with pi and covariance C of the identification: parameters that are well known stay, those that are not give way. The
second term, small, keeps bodies from becoming infinitely thin, where logarithms have no end.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tulip_motion.identification.zmp_regressor import PER_BODY

Array = NDArray[np.float64]

# w of (D9): a body that shrinks to e^-3 of its width along one axis, 20 times, costs as much as 0.3 standard deviations
PULL = 0.1


def pseudo_inertia_of(body: Array) -> Array:
    """Return the (4, 4) pseudo-inertia of a body's standard parameters (10,)."""
    matrix: Array = pin.PseudoInertia.FromDynamicParameters(body).toMatrix()
    return matrix


def can_be(body: Array) -> bool:
    """Return whether there is a body with standard parameters (10,)."""
    return bool(np.linalg.eigvalsh(pseudo_inertia_of(body))[0] > 0.0)


def log_cholesky(body: Array) -> Array:
    """Return (10,) theta of a body that can be, in Pinocchio's order.

    Raises:
        ValueError: if it cannot be.
    """
    if not can_be(body):
        raise ValueError(f"no body has the parameters {body}; expected a positive definite pseudo-inertia")
    flip = np.eye(4)[::-1]
    U = flip @ np.linalg.cholesky(flip @ pseudo_inertia_of(body) @ flip) @ flip
    size = U[3, 3]
    U = U / size
    diagonal = np.log(np.diag(U)[:3])
    return np.array([np.log(size), *diagonal, U[0, 1], U[1, 2], U[0, 2], U[0, 3], U[1, 3], U[2, 3]])


def most_probable_bodies(parameters: Array, covariance: Array, start: Array) -> Array:
    """Return (10 b,) the standard parameters of bodies that can be, eq. (D9).

    Args:
        parameters: (10 b,) as identified.
        covariance: (10 b, 10 b) of them.
        start: (10 b,) of bodies that can be, to begin from: those of the robot file.

    Raises:
        ValueError: if a body of `start` cannot be.
    """
    if all(can_be(body) for body in parameters.reshape(-1, PER_BODY)):
        return parameters
    root = np.linalg.cholesky(covariance)
    theta = np.concatenate([log_cholesky(body) for body in start.reshape(-1, PER_BODY)])

    def bodies(values: Array) -> list[pin.LogCholeskyParameters]:
        return [pin.LogCholeskyParameters(own) for own in values.reshape(-1, PER_BODY)]

    def residual(values: Array) -> Array:
        made = np.concatenate([body.toDynamicParameters() for body in bodies(values)])
        difference: Array = scipy.linalg.solve_triangular(root, made - parameters, lower=True)
        return np.concatenate([difference, PULL * (values - theta)])

    def jacobian(values: Array) -> Array:
        blocks = scipy.linalg.block_diag(*(body.calculateJacobian() for body in bodies(values)))
        slope = scipy.linalg.solve_triangular(root, blocks, lower=True)
        return np.concatenate([slope, PULL * np.eye(len(values))])

    found = least_squares(residual, theta, jacobian, x_scale="jac", max_nfev=300).x
    return np.concatenate([body.toDynamicParameters() for body in bodies(found)])
