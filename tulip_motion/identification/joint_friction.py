"""Friction of the leg joints from the torques of a leg that swings freely.

The motors of a leg in the air move it alone: what they give and inverse dynamics do not need is friction,

    tau_j - Y_j(q, v, a) pi_leg = F_c tanh(dq_j / v_c) + F_v dq_j + tau_0                  (D6)

with Coulomb friction F_c, viscous friction F_v, and the offset tau_0 of the torque sensor. Legs that stand are left
out: on two feet nobody knows how they share the horizontal forces, and on one foot an error of 1 % of the body's weight
is as large as the friction. The leg's own inertial parameters pi_leg err as well, so they are unknowns too, with their
prior: a wrong model must not turn into friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import LEG_JOINTS, SIDES
from tulip_motion.identification.correlated_fit import Fit, Prior, Series, fit
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.motion_log import MotionLog, smooth
from tulip_motion.identification.zmp_regressor import PER_BODY, ZmpRegressor
from tulip_motion.identification.zmp_rows import RowParameters, body_at, find_biases

Array = NDArray[np.float64]
PER_LEG = len(LEG_JOINTS) // len(SIDES)
SURE = 3.0
"""Standard deviations below zero from which on friction is refused as negative."""


@dataclass(frozen=True)
class FrictionParameters:
    """How friction is looked for."""

    cutoff: float = 10.0  # [Hz] a leg swings at 1 Hz
    row_rate: float = 50.0  # [1/s] twice the cutoff and a little
    # [rad/s] v_c, over which Coulomb friction builds up; the likeliest is chosen. Dry joints need hardly any; a
    # lubricated gear, or a simulator that cannot step over a jump, more
    coulomb_speeds: tuple[float, ...] = (0.05, 0.1, 0.2, 0.5, 1.0)
    friction_share: float = 0.1  # prior: standard deviation of F_c by the torque limit, and of F_v by that at 1 rad/s
    offset: float = 0.2  # [N m] prior: standard deviation of tau_0
    moving_speed: float = 0.15  # [rad/s] slower is no motion: sensors err by 0.005
    negligible: float = 0.02  # [N m] by which friction may come out negative: torques err by as much
    moving_time: float = 0.5  # [s] in either direction at least, or the joint is refused


class Friction(NamedTuple):
    """Friction of one joint.

    Attributes:
        coulomb: F_c [N m].
        viscous: F_v [N m s/rad].
        offset: tau_0 [N m].
        covariance: (3, 3) of the three.
        highest_speed: That it was moved with [rad/s].
    """

    coulomb: float
    viscous: float
    offset: float
    covariance: Array
    highest_speed: float

    def torque(self, speed: float, coulomb_speed: float) -> tuple[float, float]:
        """Return the friction at a speed [rad/s] and its standard deviation [N m].

        It is better known than its parts: at speeds below v_c, F_c / v_c and F_v act alike.
        """
        row = np.array([np.tanh(speed / coulomb_speed), speed, 0.0])
        value = float(row[0] * self.coulomb + row[1] * self.viscous)
        return value, float(np.sqrt(row @ self.covariance @ row))


class FrictionResult(NamedTuple):
    """Friction of the joints that moved.

    Attributes:
        joints: By name.
        refused: Why a joint has no result, by name.
        coulomb_speed: v_c that explains the torques best [rad/s].
        residuals: Standard deviation of the torque that is left, by joint [N m].
    """

    joints: dict[str, Friction]
    refused: dict[str, str]
    coulomb_speed: float
    residuals: dict[str, float]


class _Swing(NamedTuple):
    """Pieces of recordings in which one leg swings: rows (t, 6, 60) of its inertial parameters, torques and speeds."""

    inertial: list[Array]
    torques: list[Array]
    speeds: list[Array]


def identify_friction(
    regressor: ZmpRegressor, logs: Sequence[MotionLog], prior: Prior, parameters: FrictionParameters | None = None
) -> FrictionResult:
    """Return the friction of the leg joints.

    Args:
        regressor: Of the robot.
        logs: Recordings of `leg_swing`, each with some rest, on which `find_biases` depends. The swings of a walk are
            too short: they end before the filter has forgotten the ground.
        prior: Of the inertial parameters, (10 b,): drawings, or what dynamic identification found.
        parameters: How friction is looked for.

    Raises:
        IdentificationError: if no joint of a swinging leg moved, or the robot never rests.
    """
    p = parameters if parameters is not None else FrictionParameters()
    swings = [_Swing([], [], []) for _ in SIDES]
    for log in logs:
        _collect(regressor, log, p, swings)
    refused: dict[str, str] = {}
    for side, swing in enumerate(swings):
        for joint, name in enumerate(LEG_JOINTS[PER_LEG * side : PER_LEG * (side + 1)]):
            reason = _refusal([speeds[:, joint] for speeds in swing.speeds], p)
            if reason:
                refused[name] = reason
    if len(refused) == len(LEG_JOINTS):
        raise IdentificationError(
            f"no leg joint moved enough while its leg swung; {LEG_JOINTS[0]}: {refused[LEG_JOINTS[0]]}."
            " Expected a log of standing on one foot while the other leg swings"
        )
    limits = regressor.robot.effort_limits
    able = [side for side in range(len(SIDES)) if swings[side].speeds]
    fits = {
        speed: {side: _fit(swings[side], _leg_prior(prior, limits, side, p), speed) for side in able}
        for speed in p.coulomb_speeds
    }
    # The likeliest v_c leaves the smallest residuals, each joint by its own scale.
    best = min(fits, key=lambda speed: sum(float(np.log(found.deviations).sum()) for found in fits[speed].values()))
    joints, residuals = {}, {}
    for side, found in fits[best].items():
        for joint, name in enumerate(LEG_JOINTS[PER_LEG * side : PER_LEG * (side + 1)]):
            if name in refused:
                continue
            columns = PER_LEG * PER_BODY + PER_LEG * np.arange(3) + joint
            coulomb, viscous, offset = found.parameters[columns].tolist()
            fastest = max(float(np.abs(speeds[:, joint]).max()) for speeds in swings[side].speeds)
            covariance = found.covariance[np.ix_(columns, columns)]
            friction = Friction(coulomb, viscous, offset, covariance, fastest)
            torque, deviation = friction.torque(fastest, best)
            if torque < -max(p.negligible, SURE * deviation):
                refused[name] = (
                    f"would be {torque:.3f} +- {deviation:.3f} N m at {fastest:.1f} rad/s, and friction is never"
                    " negative: check the sign of the torque sensor and the leg's masses"
                )
                continue
            joints[name] = friction
            residuals[name] = float(found.deviations[joint])
    return FrictionResult(joints, refused, best, residuals)


def _collect(regressor: ZmpRegressor, log: MotionLog, parameters: FrictionParameters, swings: list[_Swing]) -> None:
    """Add the pieces of a log in which a leg swings."""
    p = parameters
    motion = smooth(log, p.cutoff)
    edge = round(1.0 / (p.cutoff * log.period))
    biases = find_biases(regressor, log, motion, RowParameters(cutoff=p.cutoff), edge)
    every = max(1, round(1.0 / (p.row_rate * log.period)))
    for side, swing in enumerate(swings):
        in_the_air = log.foot_cells[:, side].sum(axis=1) == 0.0
        for begin, end in _runs(in_the_air):
            # The filter mixes torques of the leg on the ground into the first and last readings in the air.
            chosen = range(begin + edge, end - edge, every)
            if len(chosen) < 2:
                continue
            own = slice(PER_LEG * side, PER_LEG * (side + 1))
            bodies = slice(PER_BODY * (1 + PER_LEG * side), PER_BODY * (1 + PER_LEG * (side + 1)))
            rows = [regressor.inverse_dynamics(body_at(regressor, motion, biases, t))[6:] for t in chosen]
            swing.inertial.append(np.array([row[own, bodies] for row in rows]))
            swing.torques.append(motion.efforts[chosen, own])
            swing.speeds.append(motion.dq[chosen, own])


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return begin and end of each run of True."""
    changes = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(begin), int(end)) for begin, end in changes.reshape(-1, 2)]


def _refusal(speeds: Sequence[Array], parameters: FrictionParameters) -> str:
    """Return why a joint's friction cannot be found, or ""."""
    p = parameters
    for direction, sign in (("forwards", 1.0), ("backwards", -1.0)):
        time = sum(int((sign * piece > p.moving_speed).sum()) for piece in speeds) / p.row_rate
        if time < p.moving_time:
            return (
                f"moved {direction} faster than {p.moving_speed} rad/s for {time:.2f} s only;"
                f" expected {p.moving_time} s or more"
            )
    return ""


def _leg_prior(prior: Prior, limits: Array, side: int, parameters: FrictionParameters) -> Prior:
    """Return the prior of a leg's inertial parameters (60,), F_c (6,), F_v (6,) and tau_0 (6,)."""
    p = parameters
    own = slice(PER_BODY * (1 + PER_LEG * side), PER_BODY * (1 + PER_LEG * (side + 1)))
    inertial = PER_LEG * PER_BODY
    wide = p.friction_share * limits[PER_LEG * side : PER_LEG * (side + 1)]
    covariance = np.diag(np.concatenate([np.ones(inertial), wide, wide, np.full(PER_LEG, p.offset)]) ** 2)
    covariance[:inertial, :inertial] = prior.covariance[own, own]
    return Prior(np.concatenate([prior.mean[own], np.zeros(3 * PER_LEG)]), covariance)


def _fit(swing: _Swing, prior: Prior, coulomb_speed: float) -> Fit:
    """Return what eq. (D6) gives for one leg."""
    series = []
    for inertial, torques, speeds in zip(swing.inertial, swing.torques, swing.speeds, strict=True):
        each = np.eye(PER_LEG)
        friction = (np.tanh(speeds / coulomb_speed)[:, None] * each, speeds[:, None] * each)
        offset = np.broadcast_to(each, (len(speeds), PER_LEG, PER_LEG))
        series.append(Series(np.concatenate([inertial, *friction, offset], axis=2), torques))
    return fit(series, prior)
