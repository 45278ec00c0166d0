"""The body's CoM from static postures: eq. (2) solved by weighted least squares, with honest covariances.

Each posture j on foot s gives two numbers, the CoP. With eqs. (2b) and (2c) they are linear in the base parameters, of
which the last, the sum of all masses, is 1. The IMU is mounted a little askew, by small angles beta about the x and y
axes of base_link, the same in all postures; they move the point below the CoM by about c_z beta, 2 mm for 3 mrad. The
cells do not show the CoP quite where it is: their places are known to a tenth of a millimetre at best, o_f on foot f,
and what presses on the rim of the sole, outside of the cells, does not count as far out as it is: distances from the
cells' middle m_f come out too short, by shares k. Both are found along with the body:

    cop_j = A_j theta_b + N_j beta + o_f + diag(cop_j - m_f) k + e_j,    cov e_j = C_j + s^2 I                (2d)
    beta ~ N(0, s_beta^2),    o_f ~ N(0, s_o^2),    k ~ N(0, s_k^2)
    N_j = -c_z d(sigma)/d(beta),    d(down)/d(beta) = -[down]x

C_j comes from the cells' noise. s is what the model leaves over: encoders, mean attitude, soles that are not quite at
rest. It is not assumed but taken as large as makes the residuals as likely as they should be: chi^2 = degrees of
freedom (Mandel and Paule, 1970). So the postures have to tell more numbers than there are unknowns; how well they tell
the body shows in the covariance of the CoM of other postures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import get_args

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from tulip_description.model import Side
from tulip_description.robot import Robot
from tulip_motion.identification.base_parameters import BaseParameters, base_parameters
from tulip_motion.identification.body_prior import Spread
from tulip_motion.identification.cell_mixups import check_plausible
from tulip_motion.identification.com_regressor import regressor_of, standard_parameters
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.static_measurement import StaticMeasurement
from tulip_motion.lipm import GRAVITY

Array = NDArray[np.float64]
SPARE = 10
"""Numbers measured beyond the unknowns, at least: s is then known to a quarter of itself."""
ROUNDS = 3
"""c_z in N comes from the round before; it changes N by a hundredth, so this is more than enough."""
UNKNOWN = 0.1
"""Standard deviation of the CoM from which on the postures tell nothing of it [m]: the singular set."""
ON_ONE_FOOT = 0.05
"""A posture whose weight differs by more than this share from the others' was not held on one foot alone."""


@dataclass(frozen=True)
class IdentificationSettings:
    """What the identification takes for granted.

    Attributes:
        spread: Of the bodies about the robot file: what is beyond plausible is refused.
        mount_spread: Standard deviation of the IMU's mounting angles [rad].
        cop_spread: Standard deviation of what the places of a foot's cells do to its CoP, each axis [m].
        rim_spread: Standard deviation of the share by which distances from the cells' middle come out wrong.
        largest_model_error: s at most [m]; more is no small imperfection.
        largest_uncertainty: Standard deviation of the CoM of any posture, root mean square, at most [m]; more means
            that the postures do not tell the body.
    """

    spread: Spread = field(default_factory=Spread)
    mount_spread: float = 0.003
    cop_spread: float = 1e-4
    rim_spread: float = 0.15
    largest_model_error: float = 1e-3
    largest_uncertainty: float = 2e-3


@dataclass(frozen=True)
class ComIdentification:
    """What static postures told about a robot.

    Attributes:
        prior: The robot as it was believed to be; gives the kinematics.
        settings: What was taken for granted.
        base: Which combinations of standard parameters these are.
        values: (r,) theta_b [m], the last 1.
        covariance: (r, r) of theta_b [m^2]; zero for the last.
        mass: Of the whole robot, as the cells weigh it [kg].
        mount: (2,) beta, how the IMU is mounted, about x and y of base_link [rad].
        mount_covariance: (2, 2) [rad^2].
        model_error: s [m].
        residuals: (postures, 2) measured CoP less that of the fit [m].
        chi_square: Of the residuals by the cells' noise alone.
        spare: Numbers measured beyond the unknowns.
    """

    prior: Robot
    settings: IdentificationSettings
    base: BaseParameters
    values: Array
    covariance: Array
    mass: float
    mount: Array
    mount_covariance: Array
    model_error: float
    residuals: Array
    chi_square: float
    spare: int

    @property
    def postures(self) -> int:
        """How many postures it comes from."""
        return len(self.residuals)

    def com(self, side: Side, joint_positions: Array) -> tuple[Array, Array]:
        """Return the CoM in any posture.

        Args:
            side: In whose sole frame.
            joint_positions: (n,) order of the prior's `joint_names` [rad].

        Returns:
            (3,) CoM [m] and its (3, 3) covariance [m^2].

        Raises:
            ValueError: if joint_positions has a wrong shape.
        """
        rows = self.base.rows(regressor_of(self.prior, side).com(joint_positions))
        return rows @ self.values, rows @ self.covariance @ rows.T


def identify_com(
    robot: Robot, measurements: Sequence[StaticMeasurement], settings: IdentificationSettings | None = None
) -> ComIdentification:
    """Find the base parameters of a robot's CoM.

    Args:
        robot: As it is believed to be.
        measurements: On both feet, of some 40 postures.
        settings: What is taken for granted.

    Raises:
        IdentificationError: if the measurements cannot be this robot's, or do not tell its body; says what to do.
    """
    p = settings or IdentificationSettings()
    base = base_parameters(robot)
    unknown = len(base.columns) - 1
    _check_shapes(robot, measurements)
    needed = math.ceil((unknown + SPARE) / 2)
    if len(measurements) < needed:
        raise IdentificationError(
            f"{len(measurements)} postures give {2 * len(measurements)} numbers for {unknown} unknown combinations of"
            f" masses and CoMs; measure at least {needed} postures, better {unknown + SPARE}, on both feet"
        )
    mass = weighed_mass(measurements)
    check_plausible(robot, measurements, mass, p.spread, p.mount_spread)
    problem = _Problem(robot, base, measurements, p)
    start = base.combinations @ standard_parameters(robot)
    values, covariance, error, chi_square = problem.solve(start)
    if error > p.largest_model_error:
        raise IdentificationError(
            f"the postures do not fit one rigid body: {error * 1e3:.1f} mm is left over beside the noise, more than"
            f" {p.largest_model_error * 1e3:.1f} mm; look for cells or encoders that are off, a foot that slipped or"
            " stood on its edge, or a load that moved or was changed on the way"
        )
    _check_determined(robot, base, measurements, covariance[:unknown, :unknown], p)
    full = np.zeros((unknown + 1, unknown + 1))
    full[:unknown, :unknown] = covariance[:unknown, :unknown]
    return ComIdentification(
        prior=robot,
        settings=p,
        base=base,
        values=np.append(values[:unknown], 1.0),
        covariance=full,
        mass=mass,
        mount=values[unknown : unknown + 2],
        mount_covariance=covariance[unknown : unknown + 2, unknown : unknown + 2],
        model_error=error,
        residuals=problem.residuals(values),
        chi_square=chi_square,
        spare=2 * len(measurements) - unknown,
    )


def weighed_mass(measurements: Sequence[StaticMeasurement]) -> float:
    """Return the robot's mass by its cells [kg].

    Raises:
        IdentificationError: if a posture was not held on its stance foot alone.
    """
    forces = np.array([measurement.normal_force for measurement in measurements])
    middle = float(np.median(forces))
    for index, force in enumerate(forces.tolist()):
        if abs(force - middle) > ON_ONE_FOOT * middle:
            raise IdentificationError(
                f"posture {index} weighs {force:.1f} N, the others about {middle:.1f} N: its stance foot did not carry"
                " the robot alone, or a cell failed; leave it out or measure it again"
            )
    return float(forces.mean()) / GRAVITY


class _Problem:
    """Eq. (2d) of all postures."""

    def __init__(
        self,
        robot: Robot,
        base: BaseParameters,
        measurements: Sequence[StaticMeasurement],
        settings: IdentificationSettings,
    ) -> None:
        self._disturbances = disturbance_spread(settings)
        self._unknown = len(base.columns) - 1
        postures = [regressor_of(robot, each.side).cop(each.joint_positions, each.down) for each in measurements]
        self._com_z = np.array([base.rows(posture.com)[2] for posture in postures])
        self._rows = np.vstack([base.rows(posture.cop) for posture in postures])
        self._robot, self._measurements = robot, measurements
        self._slope_changes = [posture.slope_change for posture in postures]
        self._cop = np.concatenate([measurement.cop for measurement in measurements])
        self._noise = np.array([measurement.cop_covariance for measurement in measurements])
        self._nuisance = np.zeros((len(self._cop), len(self._disturbances)))

    def solve(self, start: Array) -> tuple[Array, Array, float, float]:
        """Return unknowns with beta, o, k, their covariance, s, and chi^2 without s; start: (r,) theta_b for c_z."""
        unknown = self._unknown
        values = np.append(start[:unknown], np.zeros(len(self._disturbances)))
        for _ in range(ROUNDS):
            heights = self._com_z[:, :unknown] @ values[:unknown] + self._com_z[:, unknown]
            postures = zip(self._measurements, heights.tolist(), self._slope_changes, strict=True)
            self._nuisance = np.vstack([disturbance_rows(self._robot, *posture) for posture in postures])
            error = self._model_error()
            values, covariance, _ = self._least_squares(error)
        return values, covariance, error, self._least_squares(0.0)[2]

    def residuals(self, values: Array) -> Array:
        """Return (postures, 2) what the fit leaves of the CoP [m]."""
        unknown = self._unknown
        left: Array = self._cop - self._rows @ np.append(values[:unknown], 1.0) - self._nuisance @ values[unknown:]
        return left.reshape(-1, 2)

    def _model_error(self) -> float:
        """Return s that makes chi^2 as large as the numbers measured beyond the unknowns; 0 if it is smaller anyway."""
        spare = len(self._cop) - self._unknown

        def excess(error: float) -> float:
            return self._least_squares(error)[2] - spare

        if excess(0.0) <= 0.0:
            return 0.0
        top = 1e-4
        while excess(top) > 0.0:
            top *= 4.0
        return float(scipy.optimize.brentq(excess, 0.0, top, xtol=1e-7))

    def _least_squares(self, error: float) -> tuple[Array, Array, float]:
        """Return values, covariance and chi^2, with the priors of beta, o and k, for a model error s."""
        whiten = [np.linalg.inv(np.linalg.cholesky(noise + error**2 * np.eye(2))) for noise in self._noise]
        known = np.column_stack((self._rows[:, :-1], self._nuisance))
        target = self._cop - self._rows[:, -1]
        rows = np.vstack([each @ known[2 * j : 2 * j + 2] for j, each in enumerate(whiten)])
        wanted = np.concatenate([each @ target[2 * j : 2 * j + 2] for j, each in enumerate(whiten)])
        prior = np.eye(known.shape[1])[-len(self._disturbances) :] / self._disturbances[:, None]
        rows, wanted = np.vstack((rows, prior)), np.append(wanted, np.zeros(len(prior)))
        # Columns of one size, so that the rank does not depend on units.
        size = np.linalg.norm(rows, axis=0)
        size[size == 0.0] = 1.0
        left, singular, right = np.linalg.svd(rows / size, full_matrices=False)
        singular = np.maximum(singular, 1e-9 * singular[0])  # what is not determined shows as an immense covariance
        inverse = right.T / singular / size[:, None]
        values = inverse @ (left.T @ wanted)
        return values, inverse @ inverse.T, float(np.sum((rows @ values - wanted) ** 2))


def disturbance_rows(robot: Robot, measurement: StaticMeasurement, com_height: float, slope_change: Array) -> Array:
    """Return (2, 8) by what the CoP of a posture changes with beta, o_left, o_right and k of eq. (2d).

    Args:
        robot: Gives the cells' places.
        measurement: The posture.
        com_height: c_z above its sole [m].
        slope_change: (2, 2) of the posture, see `CopRows`.
    """
    rows = np.zeros((2, 8))
    foot = get_args(Side).index(measurement.side)
    rows[:, :2] = -com_height * slope_change
    rows[:, 2 + 2 * foot : 4 + 2 * foot] = np.eye(2)
    rows[:, 6:] = np.diag(measurement.cop - np.mean(robot.feet[foot].cells, axis=0))
    return rows


def disturbance_spread(settings: IdentificationSettings) -> Array:
    """Return (8,) the standard deviations of beta [rad], o_left, o_right [m] and k."""
    return np.array([settings.mount_spread] * 2 + [settings.cop_spread] * 4 + [settings.rim_spread] * 2)


def _check_shapes(robot: Robot, measurements: Sequence[StaticMeasurement]) -> None:
    count = len(robot.joint_names)
    for index, measurement in enumerate(measurements):
        if len(measurement.joint_positions) != count:
            raise IdentificationError(
                f"posture {index} has {len(measurement.joint_positions)} joints, the robot {robot.variant} {count}:"
                " the log belongs to another robot; choose the variant that was measured"
            )


def _check_determined(
    robot: Robot,
    base: BaseParameters,
    measurements: Sequence[StaticMeasurement],
    covariance: Array,
    settings: IdentificationSettings,
) -> None:
    """Raise IdentificationError if the CoM of other postures stays unknown; say which combination, and why."""
    rng = np.random.default_rng(0)
    low, high = robot.position_limits
    rows = np.vstack(
        [
            base.rows(regressor_of(robot, side).com(rng.uniform(low, high)))[:2, :-1]
            for side in get_args(Side)
            for _ in range(50)
        ]
    )
    uncertainty = math.sqrt(float(np.mean(np.sum((rows @ covariance) * rows, axis=1))))
    if uncertainty <= settings.largest_uncertainty:
        return
    size = f"uncertain by {uncertainty * 1e3:.1f} mm" if uncertainty < UNKNOWN else "unknown"
    worst = int(np.argmax(np.diag(covariance)))
    joints = np.array([measurement.joint_positions for measurement in measurements])
    still = [name for name, span in zip(robot.joint_names, np.ptp(joints, axis=0), strict=True) if span < 0.1]
    feet = {measurement.side for measurement in measurements}
    cause = f"; {', '.join(still)} did not move" if still else ""
    cause += f"; only the {feet.pop()} foot was stood on" if len(feet) == 1 else ""
    raise IdentificationError(
        f"the postures do not tell the body: the CoM of others would be {size}, above all for"
        f" {base.names[worst]}{cause}; add postures that differ in these joints, on both feet, or fix joints"
        " that stay as they are in the robot's model"
    )
