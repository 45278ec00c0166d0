"""From base parameters back to a whole robot that can be.

Static postures tell only the base parameters theta_b = K theta (2c), 31 numbers of the playing robot's 71: sums of
moments and masses along the legs. Gait and feedforward need masses, CoMs and inertias of all links. Of all bodies that
fit, the most probable one is taken, by Bayes' rule with the robot file as prior, eq. (2e):

    z = argmin |z|^2 + |theta_b - K (mean + factor z)|^2 by the covariance of theta_b                         (2f)
    such that the masses are those that the cells weigh, in sum, and each at least LIGHTEST of the robot file's

What is identified: the base parameters, which the result reproduces within their covariance. What is prior: how a sum
is shared among links, as between the masses of thigh and trunk; and all inertias: those of the robot file, each scaled
by its link's mass and moved with its CoM. So scaled they stay moments that a body can have, and with positive masses
all pseudo-inertias are positive definite. If no such body reproduces the base parameters, that is refused.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from tulip_description.body_file import Body, BodySource, links_of
from tulip_description.pseudo_inertia import why_impossible
from tulip_description.robot import Link, Robot, realizable_inertia
from tulip_motion.identification.base_parameters import BaseParameters
from tulip_motion.identification.body_prior import body_prior
from tulip_motion.identification.com_identification import IdentificationSettings
from tulip_motion.identification.com_regressor import PER_BODY
from tulip_motion.identification.identification_error import IdentificationError

Array = NDArray[np.float64]
LIGHTEST = 0.1
"""Share of its mass in the robot file that a link keeps at least."""
WEIGHED = 1e-6
"""Share of the whole mass to which the links' masses add up to it."""
FARTHEST = 10.0
"""Spreads of the CoM by which a link's may lie from where the robot file has it: a light link's moves most."""
REMEDY = "else look for a cell or an encoder that is off"
IMPROBABLE = 1e-6
"""Probability of base parameters, given the best body, below which no body is taken to have them."""


class IdentifiedCom(Protocol):
    """What an identification of the CoM found, from postures or from motion; see `ComIdentification`."""

    @property
    def prior(self) -> Robot:
        """The robot as it was believed to be."""

    @property
    def settings(self) -> IdentificationSettings:
        """What was taken for granted."""

    @property
    def base(self) -> BaseParameters:
        """Which combinations of standard parameters were identified."""

    @property
    def values(self) -> Array:
        """(r,) these, by the whole mass [m]."""

    @property
    def covariance(self) -> Array:
        """(r, r) of them [m^2]."""

    @property
    def mass(self) -> float:
        """Of the whole robot [kg]."""

    @property
    def model_error(self) -> float:
        """What is left of each CoP, standard deviation [m]."""


@dataclass(frozen=True)
class WholeBody:
    """The most probable body of a robot.

    Attributes:
        robot: With its masses, CoMs and inertias.
        told: (links, 4) how much of each mass and CoM coordinate the postures told: 0 where it is the prior's, 1 where
            nothing is left of the prior's variance.
        misfit: chi^2 of the base parameters that it has against those identified.
    """

    robot: Robot
    told: Array
    misfit: float


def most_probable_body(found: IdentifiedCom) -> WholeBody:
    """Return the most probable realizable body with the base parameters that were identified.

    Raises:
        IdentificationError: if there is none, or it is no body that can be; the message says why.
    """
    robot, unknown = found.prior, found.base.unknown
    prior = body_prior(robot, found.settings.spread, found.mass)
    combinations = found.base.combinations[unknown]
    whiten = np.linalg.inv(np.linalg.cholesky(found.covariance[unknown, unknown]))
    # Rows of z: the base parameters, the sum of all masses, and the prior.
    data = np.vstack((whiten @ combinations, found.base.combinations[-1] / WEIGHED))
    wanted = np.append(whiten @ found.values[unknown], found.values[-1] / WEIGHED) - data @ prior.mean
    told = data @ prior.factor
    count = len(prior.mean)
    lower = np.full(count, -np.inf)
    sizes = np.diag(prior.factor)[::PER_BODY]
    lower[::PER_BODY] = (LIGHTEST - 1.0) * prior.mean[::PER_BODY] / sizes
    z = lsq_linear(
        np.vstack((told, np.eye(count))), np.append(wanted, np.zeros(count)), bounds=(lower, np.inf), method="bvls"
    ).x
    misfit = float(np.sum((told @ z - wanted)[:-1] ** 2))
    if chi2.sf(misfit, len(combinations)) < IMPROBABLE:
        raise IdentificationError(
            f"no body with positive masses near the robot file's has the base parameters that were identified (chi^2"
            f" {misfit:.0f} for {len(combinations)}): state a larger spread of masses and CoMs if the robot was"
            f" rebuilt, {REMEDY}"
        )
    body = _with_bodies(robot, (prior.mean + prior.factor @ z).reshape(-1, PER_BODY) * found.mass)
    for link, was in zip(body.links, robot.links, strict=True):
        shift = float(np.linalg.norm(np.subtract(link.com, was.com)))
        if shift > FARTHEST * found.settings.spread.com:
            raise IdentificationError(
                f"the base parameters that were identified put the CoM of {link.name} {shift:.2f} m from where the"
                f" robot file has it: state a larger spread of CoMs if the robot was rebuilt, {REMEDY}"
            )
    left = np.diag(np.linalg.inv(told.T @ told + np.eye(count)))
    return WholeBody(body, (1.0 - left).reshape(-1, PER_BODY), misfit)


def as_body(found: IdentifiedCom, whole: WholeBody, source: BodySource) -> Body:
    """Return what a body file keeps of an identification: the whole body, and the base parameters behind it."""
    links = links_of(whole.robot.links)
    names, error = found.base.names, found.model_error
    return Body(found.prior.variant, source, links, names, found.values, found.covariance, error)


def _with_bodies(robot: Robot, theta: Array) -> Robot:
    """Return a robot with masses and first moments (links, 4) [kg], [kg m], and inertias scaled by the masses."""
    links = []
    for link, (mass, *moments) in zip(robot.links, theta.tolist(), strict=True):
        x, y, z = (moment / mass for moment in moments)
        a, b, c = realizable_inertia(link.inertia)
        scale = mass / link.mass
        links.append(replace(link, mass=mass, com=(x, y, z), inertia=(a * scale, b * scale, c * scale)))
    check_realizable(links)
    return replace(robot, links=tuple(links))


def check_realizable(links: list[Link]) -> None:
    """Check that bodies can be.

    Raises:
        IdentificationError: if one cannot; names it and says why.
    """
    for link in links:
        reason = why_impossible(link.mass, link.com, link.inertia)
        if reason:
            raise IdentificationError(f"no body is like link {link.name}: {reason}")
