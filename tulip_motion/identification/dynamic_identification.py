"""Dynamic identification: the robot's inertial parameters from its ZMP while it moves.

The paper plans it: "to perform dynamic experiments and fit model parameters in the equations of the Zero Moment Point
(ZMP) position to experimental data of the CoP". The errors (D4) of all recordings are to be small; of all parameters
that make them so, the most probable with the robot file as prior (D8) is taken, by (D7) of `correlated_fit`, and of the
bodies that can be the nearest to it, (D9).

The cells weigh the robot by (D10); moments, as (D4a) of `zmp_rows` has them, do not.

Beside what static postures tell, accelerations weigh the robot (its mass in kg, not only shares of it), show how high
the CoM lies without tilting it, and move moments of inertia. `knowledge` says in numbers what a recording told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import block_diag

from tulip_description.model import floating_model
from tulip_description.robot import Robot
from tulip_motion.identification.base_parameters import reduce_columns
from tulip_motion.identification.body_prior import Spread, check_weight
from tulip_motion.identification.correlated_fit import Fit, Prior, fit
from tulip_motion.identification.dynamic_checks import check_result
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.inertial_prior import inertial_prior
from tulip_motion.identification.realizable_parameters import can_be, most_probable_bodies
from tulip_motion.identification.zmp_regressor import (
    CELL_PARAMETERS,
    PARAMETER_NAMES,
    PER_BODY,
    BodyMotion,
    Ground,
    ZmpRegressor,
    horizontal_axes,
    parameters_of,
    with_parameters,
)
from tulip_motion.identification.zmp_rows import ZmpRows
from tulip_motion.lipm import GRAVITY

Array = NDArray[np.float64]

CELL_SPREAD = 0.1  # standard deviation of the spreads (D5): the rim of the sole is 10 % farther out than the cells
GAIN_ERROR = 2e-3  # standard deviation of the gains (D10): what load cells and their mounting promise
WEIGHT_ERROR = 0.02  # share of the weight that a result may differ by: ten standard deviations of the gains
ROUNDS = 3  # of (D4a); the third changes parameters by less than a thousandth of their deviation
FORCE_ERROR = 0.3  # [N] of the weight of a posture at rest: noise of eight cells over a second, and their resolution
RANDOM_MOTIONS = 150  # for the structural rank: 450 rows for 150 columns


@dataclass(frozen=True)
class DynamicIdentification:
    """What recordings of motion told about a robot.

    Attributes:
        robot: As it was believed to be; gives the kinematics.
        parameters: (10 b,) standard parameters of the moving bodies, see `ZmpRegressor.body_names`.
        cells: (3,) their spreads along and across the soles, (D5), and the error of their gains, (D10).
        covariance: (10 b + 3, 10 b + 3) of both, by the linear equations.
        moved: The bodies, by the link on their joint, that as the linear equations have them cannot be; see (D9).
        fit: Residuals, their correlation, and how many combinations were learned.
    """

    robot: Robot
    parameters: Array
    cells: Array
    covariance: Array
    moved: tuple[str, ...]
    fit: Fit

    @property
    def all_parameters(self) -> Array:
        """(10 b + 3,) of the bodies and the cells, as `ZmpRows` takes them."""
        return np.concatenate([self.parameters, self.cells])

    @property
    def prior(self) -> Prior:
        """What is known of the standard parameters now, for what comes after."""
        inertial = slice(0, len(self.parameters))
        return Prior(self.parameters, self.covariance[inertial, inertial])

    @property
    def mass(self) -> tuple[float, float]:
        """The robot's mass and its standard deviation [kg]."""
        row = np.zeros(len(self.covariance))
        row[: len(self.parameters) : PER_BODY] = 1.0
        return float(row @ self.all_parameters), float(np.sqrt(row @ self.covariance @ row))

    def model(self) -> Any:
        """Return the floating Pinocchio model with these parameters."""
        return with_parameters(floating_model(self.robot), self.parameters)


def identify_dynamics(
    regressor: ZmpRegressor, recordings: Sequence[ZmpRows], spread: Spread | None = None
) -> DynamicIdentification:
    """Find the inertial parameters of a robot.

    Args:
        regressor: Of the robot as it is believed to be; its bodies can be.
        recordings: Squats, sways, leans, swings of the legs, walks; also long still ones.
        spread: Of the links' masses and CoMs about the robot file; what is beyond plausible is refused.

    Raises:
        IdentificationError: if the recordings tell hardly more than the prior, or cannot be this robot's.
    """
    if not recordings:
        raise IdentificationError("there are no recordings; expected one or more of squats, sways, leans or walks")
    prior = dynamic_prior(regressor.robot, spread)
    best = prior.mean
    weight = float(np.concatenate([recording.force for recording in recordings]).mean())
    check_weight(regressor.robot, weight / GRAVITY, spread if spread is not None else Spread())
    try:
        for _ in range(ROUNDS):
            found = fit([recording.equations(best) for recording in recordings], prior)
            best = found.parameters
    except ValueError as error:
        raise IdentificationError(str(error)) from error
    check_result(regressor, recordings, prior, found)
    parameters, cells = np.split(best, [-CELL_PARAMETERS])
    moved = tuple(
        name
        for name, body in zip(regressor.body_names, parameters.reshape(-1, PER_BODY), strict=True)
        if not can_be(body)
    )
    start = parameters_of(floating_model(regressor.robot))
    parameters = most_probable_bodies(parameters, found.covariance[: len(start), : len(start)], start)
    result = DynamicIdentification(regressor.robot, parameters, cells, found.covariance, moved, found)
    if abs(GRAVITY * result.mass[0] - weight) > WEIGHT_ERROR * weight:
        raise IdentificationError(
            f"the most probable bodies that can be weigh {result.mass[0]:.2f} kg; expected what the cells weigh,"
            f" {weight / GRAVITY:.2f} kg, to {WEIGHT_ERROR:.0%}: a body in the robot file is far from the truth;"
            " correct robot.yaml, or add motions that tell more"
        )
    return result


def dynamic_prior(robot: Robot, spread: Spread | None = None) -> Prior:
    """Return what is known of the inertial parameters and those of the cells, (10 b + 3,)."""
    known = inertial_prior(robot, spread)
    mean = np.concatenate([known.mean, np.zeros(CELL_PARAMETERS)])
    cells = np.diag([CELL_SPREAD, CELL_SPREAD, GAIN_ERROR]) ** 2
    return Prior(mean, block_diag(known.covariance, cells))


class Combination(NamedTuple):
    """One base parameter of the ZMP equation.

    Attributes:
        name: Of the standard parameter that it is kept under, as "mz(left_thigh)".
        together_with: What cannot be told from it, in words; empty for one alone.
        row: (10 b,) its coefficients.
        static: Whether postures at rest show it: no acceleration is needed.
    """

    name: str
    together_with: str
    row: Array
    static: bool


@cache
def base_combinations(robot: Robot) -> tuple[Combination, ...]:
    """Return the independent combinations of standard parameters in (D3), reduced as those of the CoM are.

    What a body has in common with its parent goes to the parent, as Gautier has it: its mass, its first moment along
    the joint's axis, and one of its two moments of inertia across that axis.
    """
    regressor = ZmpRegressor(robot)
    rng = np.random.default_rng(0)
    moving = np.vstack([_random_rows(regressor, rng, moving=True) for _ in range(RANDOM_MOTIONS)])
    resting = np.vstack([_random_rows(regressor, rng, moving=False) for _ in range(RANDOM_MOTIONS)])
    reduction = reduce_columns(moving, _preference(robot))
    names = [f"{kind}({body})" for body in regressor.body_names for kind in PARAMETER_NAMES]
    # A combination is static if it lies in the span of the rows at rest.
    span = np.linalg.svd(resting, full_matrices=False)
    directions = span[2][span[1] > 1e-9 * span[1][0]]
    found = []
    for column, row in zip(reduction.columns, reduction.combinations, strict=True):
        outside = row - directions.T @ (directions @ row)
        others = [i for i in np.flatnonzero(np.abs(row) > 1e-9).tolist() if i != column]
        words = " ".join(f"{row[i]:+.4g} {names[i]}" for i in others)
        found.append(Combination(names[column], words, row, float(np.linalg.norm(outside)) < 1e-7))
    return tuple(found)


def static_covariance(
    regressor: ZmpRegressor, postures: Sequence[tuple[int, Array]], prior: Prior, cop_error: float
) -> Array:
    """Return the covariance (10 b, 10 b) of the standard parameters that postures at rest would leave.

    Args:
        regressor: Of the robot.
        postures: Stance foot (0 left, 1 right) and joint positions (n,) [rad] of each.
        prior: Of the standard parameters.
        cop_error: Standard deviation of the CoP of each posture [m].
    """
    weight = GRAVITY * float(prior.mean[::PER_BODY].sum())
    deviations = np.array([cop_error * weight, cop_error * weight, FORCE_ERROR])
    information = np.linalg.inv(prior.covariance)
    for foot, joints in postures:
        positions, rotations = regressor.soles(joints)
        up = rotations[foot][:, 2]
        still, none = np.zeros(len(joints)), np.zeros(3)
        body = BodyMotion(joints, still, still, none, none, GRAVITY * up)
        rows = regressor.rows(body, _ground_at(positions[foot], up)) / deviations[:, None]
        information += rows.T @ rows
    covariance: Array = np.linalg.inv(information)
    return covariance


def knowledge(combinations: Sequence[Combination], covariance: Array) -> Array:
    """Return the standard deviation of each combination, given the covariance of the standard parameters (10 b,)."""
    rows = np.array([combination.row for combination in combinations])
    variances: Array = np.einsum("ci,ij,cj->c", rows, covariance[: rows.shape[1], : rows.shape[1]], rows)
    return np.sqrt(variances)


def com_error(identified: Any, true: Any, postures: Sequence[tuple[int, Array]]) -> Array:
    """Return (postures, 3) error of the CoM in the sole frame of a foot [m], by two floating models.

    Args:
        identified: Floating Pinocchio model.
        true: Another of the same kinematics.
        postures: Stance foot (0 left, 1 right) and joint positions (n,) [rad] of each.
    """
    errors = []
    for foot, joints in postures:
        q = np.concatenate([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], joints])
        data, other = identified.createData(), true.createData()
        difference = pin.centerOfMass(identified, data, q) - pin.centerOfMass(true, other, q)
        pin.framesForwardKinematics(true, other, q)
        sole = other.oMf[true.getFrameId(("l_sole", "r_sole")[foot])]
        errors.append(sole.rotation.T @ difference)
    return np.array(errors)


def _preference(robot: Robot) -> list[int]:
    """Return the indices of the standard parameters (10 b,), those first that belong to one body alone."""
    moments, second = ("mx", "my", "mz"), ("Izz", "Izz", "Iyy")  # by axis: the one across it that is given away
    shared = [{"m"}]
    for joint in robot.moving:
        axis = int(np.abs(joint.axis).argmax())
        shared.append({"m", moments[axis], second[axis]})
    own: list[int] = []
    common: list[int] = []
    for body, names in enumerate(shared):
        for kind, name in enumerate(PARAMETER_NAMES):
            (common if name in names else own).append(PER_BODY * body + kind)
    return own + common


def _random_rows(regressor: ZmpRegressor, rng: np.random.Generator, moving: bool) -> Array:
    """Return (3, 10 b) rows of some posture, with some motion or none."""
    low, high = regressor.robot.position_limits
    n, share = low.size, 1.0 if moving else 0.0
    up = np.append(rng.uniform(-0.5, 0.5, 2), 1.0)
    up /= np.linalg.norm(up)
    q = rng.uniform(low, high)
    rates, changes = share * rng.uniform(-3.0, 3.0, n), share * rng.uniform(-20.0, 20.0, n)
    turning, change = share * rng.uniform(-2.0, 2.0, 3), share * rng.uniform(-10.0, 10.0, 3)
    force = GRAVITY * up + share * rng.uniform(-3.0, 3.0, 3)
    ground = _ground_at(regressor.soles(q)[0][0], up)
    return regressor.rows(BodyMotion(q, rates, changes, turning, change, force), ground)


def _ground_at(point: Array, up: Array) -> Ground:
    """Return the ground of a robot whose CoP is some point (3,) of base_link: any spans the same rows."""
    return Ground(up, horizontal_axes(up), point, point, np.zeros((3, 2)), 1.0)
