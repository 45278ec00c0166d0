"""What an identification found, as tables of words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.robot import Robot
from tulip_motion.identification.base_parameters import base_parameters
from tulip_motion.identification.body_comparison import base_values, com_rows, rms
from tulip_motion.identification.dynamic_identification import DynamicIdentification, base_combinations, knowledge
from tulip_motion.identification.inertial_prior import inertial_prior
from tulip_motion.identification.joint_friction import FrictionResult
from tulip_motion.identification.physical_consistency import IdentifiedCom, WholeBody
from tulip_motion.identification.zmp_regressor import parameters_of

Array = NDArray[np.float64]
Row = tuple[str, ...]
POSTURES = 200
"""On which two bodies are compared."""
BASE_HEADINGS = ("base parameter, by the whole mass", "believed [mm]", "found [mm]", "+- [mm]")
LINK_HEADINGS = ("link", "believed [kg]", "found [kg]", "CoM moved x, y, z [mm]", "told by the postures: mass, x, y, z")


def base_rows(fit: IdentifiedCom) -> list[Row]:
    """Return the base parameters that were sought: in words, as believed, as found, and their standard deviation."""
    before, spread = base_values(fit.prior), np.sqrt(np.diag(fit.covariance))
    columns = zip(fit.base.names, before.tolist(), fit.values.tolist(), spread.tolist(), strict=True)
    return [
        (name, f"{1e3 * was:.2f}", f"{1e3 * found:.2f}", f"{1e3 * sigma:.2f}")
        for name, was, found, sigma in list(columns)[fit.base.unknown]
    ]


def link_rows(fit: IdentifiedCom, whole: WholeBody) -> list[Row]:
    """Return mass and CoM of each link, and how much of them the postures told."""
    rows: list[Row] = []
    for was, found, told in zip(fit.prior.links, whole.robot.links, whole.told.tolist(), strict=True):
        moved = 1e3 * np.subtract(found.com, was.com)
        shares = ", ".join(f"{share:.0%}" for share in told)
        rows.append(
            (was.name, f"{was.mass:.3f}", f"{found.mass:.3f}", ", ".join(f"{x:+.1f}" for x in moved.tolist()), shares)
        )
    return rows


def com_difference(one: Robot, other: Robot) -> Array:
    """Return (2,) by how much the CoM of two bodies of one robot differs, RMS of x and y over random postures [m]."""
    rows = com_rows(one, POSTURES, np.random.default_rng(0))
    return rms(rows @ (base_values(one) - base_values(other)))


def difference_rows(one: Robot, other: Robot, covariance: Array) -> list[Row]:
    """Return the base parameters of two bodies, and by how many standard deviations they differ.

    Args:
        one: A body.
        other: Another one of the same robot.
        covariance: (r, r) of the difference [m^2]; where it is zero there is no deviation to tell.
    """
    first, second, spread = base_values(one), base_values(other), np.sqrt(np.diag(covariance))
    rows: list[Row] = []
    for name, a, b, sigma in zip(base_parameters(one).names, first, second, spread, strict=True):
        if a != b:
            deviations = f"{abs(a - b) / sigma:.1f}" if sigma > 0.0 else ""
            rows.append((name, f"{1e3 * a:.2f}", f"{1e3 * b:.2f}", f"{1e3 * (b - a):+.2f}", deviations))
    return rows


DIFFERENCE_HEADINGS = ("base parameter, by the whole mass", "first [mm]", "second [mm]", "difference [mm]", "sigmas")
DYNAMIC_HEADINGS = ("combination kept under", "believed", "found", "+-", "shows at rest")
TOLD = 0.5
"""Standard deviation by that of the prior, up to which a combination counts as told."""
FRICTION_HEADINGS = ("joint", "rad/s", "in all", "Coulomb", "viscous")
HIGHEST_SPEED = 1.0
"""Speed at which friction is told, if the joint moved so fast [rad/s]: better known there than its parts."""


def dynamic_rows(found: DynamicIdentification) -> list[Row]:
    """Return the combinations that the recordings tell twice as well as the robot file, or better.

    In words, as believed, as found, with standard deviation, and whether postures at rest would show it, too.
    """
    combinations = base_combinations(found.robot)
    prior = knowledge(combinations, inertial_prior(found.robot).covariance)
    now = knowledge(combinations, found.covariance)
    believed = parameters_of(floating_model(found.robot))
    rows: list[Row] = []
    for combination, before, after in zip(combinations, prior.tolist(), now.tolist(), strict=True):
        if after <= TOLD * before:
            values = (f"{combination.row @ p:.4f}" for p in (believed, found.parameters))
            rows.append((combination.name, *values, f"{after:.4f}", "yes" if combination.static else ""))
    return rows


def friction_rows(found: FrictionResult) -> list[Row]:
    """Return the friction of each joint that has a result, as a whole and in its parts, with standard deviations."""
    rows: list[Row] = []
    for name, joint in found.joints.items():
        speed = min(HIGHEST_SPEED, joint.highest_speed)
        torque, sigma = joint.torque(speed, found.coulomb_speed)
        coulomb, viscous = np.sqrt(np.diag(joint.covariance)[:2]).tolist()
        parts = (f"{joint.coulomb:.2f} +- {coulomb:.2f}", f"{joint.viscous:.2f} +- {viscous:.2f}")
        rows.append((name, f"{speed:.2f}", f"{torque:.3f} +- {sigma:.3f}", *parts))
    return rows
