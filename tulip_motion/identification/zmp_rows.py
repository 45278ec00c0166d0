"""From a recording to the equations of dynamic identification: calibration at rest, smoothing, rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tulip_motion.identification.correlated_fit import Series
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.motion_log import MotionLog, SmoothMotion, smooth
from tulip_motion.identification.zmp_regressor import CELL_PARAMETERS, BodyMotion, ZmpRegressor
from tulip_motion.lipm import GRAVITY

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RowParameters:
    """How a recording becomes equations."""

    cutoff: float = 6.0  # [Hz] squats and sways end at 1 Hz, steps at 2.2 with harmonics; contacts ring above 10
    row_rate: float = 25.0  # [1/s] twice the cutoff and a little: more rows repeat the same errors
    rest_speed: float = 0.03  # [rad/s] of every joint and the trunk: slower counts as rest
    rest_time: float = 0.8  # [s] of rest at least: 0.05 m/s^2 of accelerometer noise come down to 0.004
    least_force: float = 100.0  # [N] on both feet together; with less the robot hops or hangs
    least_motion: float = 0.1  # [m/s^2] standard deviation of the trunk's acceleration; less is standing


class Biases(NamedTuple):
    """What the IMU says wrongly, constant in a recording; in base_link.

    Attributes:
        tilt: (3, 3) rotation that takes its upward direction to the true one.
        angular_velocity: (3,) [rad/s].
        specific_force: (3,) [m/s^2].
    """

    tilt: Array
    angular_velocity: Array
    specific_force: Array


class ZmpRows(NamedTuple):
    """Equations (D3) at t instants. Their parameters are pi, (10 b,), and those of the cells, (3,): (D5) and (D10).

    Attributes:
        times: (t,) since the start of the recording [s].
        rows: (t, 3, 10 b) of (D3).
        ways: (t, 2, 2) what the spreads of (D5) add to the CoP, forward and left [m].
        force: (t,) vertical, of all cells [N].
        cop: (t, 2) as the cells say, forward and left of the soles' mean [m].
        biases: Found at rest.
    """

    times: Array
    rows: Array
    ways: Array
    force: Array
    cop: Array
    biases: Biases

    def zmp(self, parameters: Array) -> Array:
        """Return (t, 2) ZMP that parameters (10 b + 3,) predict for the cells, forward and left of the soles' mean [m].

        With spreads of the cells, it is the place where those cells would show it, as far as the error is small.
        """
        return self.cop + self.error(parameters)

    def error(self, parameters: Array) -> Array:
        """Return (t, 2) way from the measured CoP to the ZMP that parameters (10 b + 3,) predict [m], (D4), (D5)."""
        inertial, (*spreads, _) = np.split(parameters, [-CELL_PARAMETERS])
        away: Array = self._away(inertial) - self.ways @ spreads
        return away

    def rms_error(self, parameters: Array) -> float:
        """Return the root mean square length of `error` [m]."""
        return float(np.sqrt((self.error(parameters) ** 2).sum(axis=1).mean()))

    def equations(self, parameters: Array) -> Series:
        """Return the equations near parameters (10 b + 3,), linear: (D4a) with (D5) [m], and (D10) [N].

        Where the ZMP lies does not depend on how heavy the robot is, if all masses grow alike. (D3), homogeneous, would
        say otherwise: the smaller the masses, the smaller its errors, and a fit that weighs equations by their errors
        ends at none. (D4) itself, near pi_k, where it is e_k, is

            e(pi) = e_k + (u x M_o - e_k u . F) / (u . F of pi_k)                                          (D4a)

        which is e_k for every multiple of pi_k; and it takes moments about the predicted ZMP, not about the noisy CoP.
        For the same reason the error of the gains multiplies the predicted force, not the measured one.
        """
        inertial = parameters[:-CELL_PARAMETERS]
        away, force = self._away(inertial), self.rows[:, 2]
        weight = force @ inertial
        design = np.zeros((len(self.times), 3, len(parameters)))
        moments = self.rows[:, :2] - away[:, :, None] * force[:, None, :]
        design[:, :2, :-CELL_PARAMETERS] = moments / weight[:, None, None]
        design[:, :2, -CELL_PARAMETERS:-1] = -self.ways
        design[:, 2, :-CELL_PARAMETERS] = force
        design[:, 2, -1] = weight
        return Series(design, np.column_stack([-away, self.force]))

    def _away(self, inertial: Array) -> Array:
        """Return (t, 2) way from the CoP, as the cells show it, to the ZMP of inertial parameters (10 b,) [m]."""
        along, left, force = np.moveaxis(self.rows @ inertial, 1, 0)
        away: Array = np.stack([along, left], axis=1) / force[:, None]
        return away


def zmp_rows(regressor: ZmpRegressor, log: MotionLog, parameters: RowParameters | None = None) -> ZmpRows:
    """Return the equations of a recording, which begins and ends at rest on a level floor.

    Raises:
        IdentificationError: if the recording has no rest to find the IMU's biases in, no motion, or no force on the
            feet.
    """
    p = parameters if parameters is not None else RowParameters()
    _check(regressor, log)
    motion = smooth(log, p.cutoff)
    force = motion.foot_cells.sum(axis=(1, 2))
    if not (force > p.least_force).any():
        raise IdentificationError(f"the feet never carry {p.least_force} N; expected the log of a robot that stands")
    edge = round(1.0 / (p.cutoff * log.period))  # the filter knows only one side of the first and last readings
    biases = find_biases(regressor, log, motion, p, edge)
    moving = motion.specific_force[edge:-edge].std(axis=0).max()
    if moving < p.least_motion:
        raise IdentificationError(
            f"the trunk's acceleration varies by {moving:.3f} m/s^2 only; expected {p.least_motion} or more:"
            " from standing still take static identification"
        )
    every = max(1, round(1.0 / (p.row_rate * log.period)))
    chosen = [t for t in range(edge, len(force) - edge, every) if force[t] > p.least_force]
    rows, ways, cop = [], [], []
    for t in chosen:
        body = body_at(regressor, motion, biases, t)
        ground = regressor.ground(motion.q[t], biases.tilt @ motion.up[t], motion.foot_cells[t])
        rows.append(regressor.rows(body, ground))
        ways.append(ground.horizontal @ ground.ways)
        cop.append(ground.horizontal @ (ground.cop - ground.soles))
    return ZmpRows(log.times[chosen], np.array(rows), np.array(ways), force[chosen], np.array(cop), biases)


def body_at(regressor: ZmpRegressor, motion: SmoothMotion, biases: Biases, t: int) -> BodyMotion:
    """Return the motion of the body at reading t, the IMU's specific force moved to base_link's origin."""
    lever = np.array(regressor.robot.imu.origin)
    turning, change = motion.angular_velocity[t] - biases.angular_velocity, motion.angular_acceleration[t]
    at_imu = motion.specific_force[t] - biases.specific_force
    force = at_imu - np.cross(change, lever) - np.cross(turning, np.cross(turning, lever))
    return BodyMotion(motion.q[t], motion.dq[t], motion.ddq[t], turning, change, force)


def find_biases(
    regressor: ZmpRegressor, log: MotionLog, motion: SmoothMotion, parameters: RowParameters, edge: int
) -> Biases:
    """Return the IMU's biases.

    Tilt and rate from where the robot rests: it turns nowhere, and stands on level soles, whose normal the encoders
    tell better than an IMU its own mounting; 3 mrad of that would be 2 mm of CoM. Acceleration from the whole
    recording: a body that begins and ends at rest has felt gravity alone on average, whatever it did in between.

    Raises:
        IdentificationError: if there is too little rest.
    """
    p = parameters
    still = (np.abs(motion.dq) < p.rest_speed).all(axis=1)
    still &= (np.abs(motion.angular_velocity) < p.rest_speed).all(axis=1)
    still &= motion.foot_cells.sum(axis=(1, 2)) > p.least_force
    still[:edge] = still[len(still) - edge :] = False
    if still.sum() * log.period < p.rest_time:
        raise IdentificationError(
            f"the robot rests for {still.sum() * log.period:.2f} s of the log; expected {p.rest_time} s or more:"
            " let it stand before it moves, so that the IMU's biases can be found"
        )
    chosen = np.flatnonzero(still)[::5]  # at rest the next readings say the same
    rotations = [regressor.soles(motion.q[t])[1] for t in chosen]
    normals = [
        cells.sum(axis=1) @ soles[:, :, 2] for cells, soles in zip(motion.foot_cells[chosen], rotations, strict=True)
    ]
    tilt = _least_turn(_unit(motion.up[chosen].mean(axis=0)), _unit(np.mean(normals, axis=0)))
    level = log.base_rotations @ tilt.T
    felt = np.einsum("tij,tj->i", level, log.specific_force) / len(level)
    bias = np.linalg.solve(level.mean(axis=0), felt - np.array([0.0, 0.0, GRAVITY]))
    return Biases(tilt, motion.angular_velocity[still].mean(axis=0), bias)


def _check(regressor: ZmpRegressor, log: MotionLog) -> None:
    joints, expected = log.joint_positions.shape[1], len(regressor.robot.joint_names)
    if joints != expected:
        raise IdentificationError(
            f"the log has {joints} joints; expected the robot's {expected}: it is of another robot"
        )


def _unit(vector: Array) -> Array:
    scaled: Array = vector / np.linalg.norm(vector)
    return scaled


def _least_turn(a: Array, b: Array) -> Array:
    """Return the (3, 3) rotation by the least angle that takes unit vector a to b, which is near."""
    axis = np.cross(a, b)
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Array = np.eye(3) + skew + skew @ skew / (1.0 + float(a @ b))
    return turn
