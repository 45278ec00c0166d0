"""Dynamic identification from made-up motion of a robot that differs from its file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2
from synthetic_motion import PERIOD, changed, still_rows, swaying_log

from tulip_description.model import floating_model
from tulip_description.robot import Robot, load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.identification.correlated_fit import Prior, Series, fit
from tulip_motion.identification.dynamic_identification import (
    GAIN_ERROR,
    base_combinations,
    com_error,
    identify_dynamics,
    knowledge,
    static_covariance,
)
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.inertial_prior import inertial_prior
from tulip_motion.identification.motion_log import MotionLog, longest_part, smooth
from tulip_motion.identification.realizable_parameters import can_be
from tulip_motion.identification.zmp_regressor import BodyMotion, Ground, ZmpRegressor, horizontal_axes, parameters_of
from tulip_motion.identification.zmp_rows import zmp_rows

BELIEVED = load_robot()
TRUE = changed(BELIEVED, np.random.default_rng(11))
REGRESSOR = ZmpRegressor(BELIEVED)
TRUE_PARAMETERS = parameters_of(floating_model(TRUE))


@pytest.fixture(scope="module")
def log() -> MotionLog:
    return swaying_log(TRUE)


def random_equations(rng: np.random.Generator, count: int, cop_error: float) -> Series:
    """Return equations of random motions whose CoP errs by a standard deviation [m], the force by as many kN."""
    design, target = [], []
    for _ in range(count):
        up = np.array([*rng.uniform(-0.3, 0.3, 2), 1.0])
        up /= np.linalg.norm(up)
        q = rng.uniform(*BELIEVED.position_limits)
        values = [scale * rng.normal(size=size) for scale, size in ((2.0, 14), (10.0, 14), (1.0, 3), (5.0, 3))]
        motion = BodyMotion(q, *values, 9.81 * up + rng.normal(size=3))
        at_origin = Ground(up, horizontal_axes(up), np.zeros(3), np.zeros(3), np.zeros((3, 2)), 1.0)
        x, y, force = REGRESSOR.rows(motion, at_origin) @ TRUE_PARAMETERS
        zmp = np.array([x, y]) / force + cop_error * rng.normal(size=2)
        cop = zmp @ at_origin.horizontal
        ground = at_origin._replace(cop=cop, soles=cop)
        design.append(REGRESSOR.rows(motion, ground))
        target.append([0.0, 0.0, force + 1e3 * cop_error * rng.normal()])
    return Series(np.array(design), np.array(target))


def test_without_noise_every_base_parameter_is_recovered_exactly() -> None:
    equations = random_equations(np.random.default_rng(0), 400, 0.0)
    prior = inertial_prior(BELIEVED)
    found = fit([equations], prior)
    rows = np.array([combination.row for combination in base_combinations(BELIEVED)])
    errors = rows @ (found.parameters - TRUE_PARAMETERS)
    doubts = knowledge(base_combinations(BELIEVED), prior.covariance)
    assert (np.abs(errors) < 1e-4 * doubts).all()


def test_stated_covariance_of_base_parameters_is_honest() -> None:
    rows = np.array([combination.row for combination in base_combinations(BELIEVED)])
    prior = inertial_prior(BELIEVED)
    wide = Prior(prior.mean, 100.0 * prior.covariance)  # the truth is not drawn from the prior; it must not matter
    squares = []
    for seed in range(8):
        found = fit([random_equations(np.random.default_rng(seed), 600, 0.5e-3)], wide)
        error, covariance = rows @ (found.parameters - TRUE_PARAMETERS), rows @ found.covariance @ rows.T
        squares.append(float(error @ np.linalg.solve(covariance, error)))
    # The weights are estimated with 600 samples of each kind, and the force differs from motion to motion.
    assert 0.7 * len(rows) < np.mean(squares) < 1.3 * len(rows)
    assert max(squares) < 1.3 * chi2.ppf(0.9999, len(rows))


def test_motion_shows_more_combinations_than_rest() -> None:
    combinations = base_combinations(BELIEVED)
    at_rest = [combination for combination in combinations if combination.static]
    # Three moments of the trunk, two of each of the 14 others across its axis, and the mass.
    assert len(at_rest) == 32
    assert len(combinations) > 3 * len(at_rest)
    assert not any(combination.name.startswith("I") for combination in at_rest)
    assert combinations[-1].name == "m(base_link)"
    np.testing.assert_allclose(combinations[-1].row[::10], 1.0)  # the mass of all
    assert combinations[-1].static


def test_recording_predicts_the_zmp_of_another_motion_and_the_com_at_rest(log: MotionLog) -> None:
    found = identify_dynamics(REGRESSOR, [zmp_rows(REGRESSOR, log)])
    other = zmp_rows(REGRESSOR, swaying_log(TRUE, seconds=5.0, joint_amplitude=0.1, trunk_amplitude=0.08))

    def rms(parameters: np.ndarray) -> float:
        return 1e3 * float(np.sqrt((other.error(parameters) ** 2).sum(axis=1).mean()))

    wrong = rms(np.append(inertial_prior(BELIEVED).mean, np.zeros(3)))
    floor = rms(np.append(TRUE_PARAMETERS, np.zeros(3)))
    assert floor < 0.5 < 3.0 < wrong  # [mm] the filter's products of fast signals
    assert rms(found.all_parameters) < floor + 0.3
    rng = np.random.default_rng(3)
    postures = [(0, log.joint_positions[0] + rng.uniform(-0.15, 0.15, 14)) for _ in range(50)]
    before = com_error(floating_model(BELIEVED), floating_model(TRUE), postures)
    after = com_error(found.model(), floating_model(TRUE), postures)
    assert np.sqrt((after[:, :2] ** 2).mean()) < 0.1 * np.sqrt((before[:, :2] ** 2).mean())
    mass, deviation = found.mass
    assert abs(mass - TRUE.mass) < deviation
    assert deviation == pytest.approx(GAIN_ERROR * TRUE.mass, rel=0.1)  # what the cells' gains leave open
    assert all(can_be(body) for body in found.parameters.reshape(-1, 10))


def test_spread_of_the_cells_is_found_and_does_not_go_into_the_body() -> None:
    log = swaying_log(TRUE, spreads=(0.10, 0.15))
    found = identify_dynamics(REGRESSOR, [zmp_rows(REGRESSOR, log)])
    np.testing.assert_allclose(found.cells[:2], [0.10, 0.15], atol=0.01)
    assert found.mass[0] == pytest.approx(TRUE.mass, abs=0.05)


def test_biases_of_the_imu_are_found_and_taken_off(log: MotionLog) -> None:
    tilt = np.array([[1.0, 0.0, -0.004], [0.0, 1.0, 0.003], [0.004, -0.003, 1.0]])
    biased = replace(
        log,
        base_rotations=log.base_rotations @ tilt,
        angular_velocity=log.angular_velocity + np.array([0.003, -0.002, 0.001]),
        specific_force=log.specific_force + np.array([0.03, -0.02, 0.04]),
    )
    rows = zmp_rows(REGRESSOR, biased)
    np.testing.assert_allclose(rows.biases.specific_force, [0.03, -0.02, 0.04], atol=2e-3)
    np.testing.assert_allclose(
        rows.biases.angular_velocity, [0.003, -0.002, 0.001], atol=5e-4
    )  # rest may be slow motion
    np.testing.assert_allclose(rows.biases.tilt, tilt, atol=1e-4)
    away = rows.error(np.append(TRUE_PARAMETERS, np.zeros(3))) - zmp_rows(REGRESSOR, log).error(
        np.append(TRUE_PARAMETERS, np.zeros(3))
    )
    assert np.abs(away).max() < 0.5e-3


def test_postures_at_rest_tell_nothing_of_moments_of_inertia() -> None:
    prior = inertial_prior(BELIEVED)
    rng = np.random.default_rng(4)
    postures = [(i % 2, rng.uniform(*BELIEVED.position_limits)) for i in range(60)]
    after = static_covariance(REGRESSOR, postures, prior, 0.5e-3)
    combinations = base_combinations(BELIEVED)
    ratio = knowledge(combinations, after) / knowledge(combinations, prior.covariance)
    shares = {combination.name: share for combination, share in zip(combinations, ratio.tolist(), strict=True)}
    assert max(shares[f"m{axis}(base_link)"] for axis in "xyz") < 0.1
    # A body's inertia shares its mass and CoM with what rest shows; on its own it stays as doubtful as it was.
    alone = [i for i, c in enumerate(combinations) if c.name.startswith("Ixy") and not c.together_with]
    assert len(alone) > 5
    assert ratio[alone].min() > 0.7


def test_log_without_motion_without_rest_or_of_another_robot_is_refused(log: MotionLog) -> None:
    still = {name: np.repeat(getattr(log, name)[:1], 1000, axis=0) for name in vars(log) if name != "period"}
    with pytest.raises(IdentificationError, match=r"acceleration varies by 0\.000 m/s\^2 only"):
        zmp_rows(REGRESSOR, MotionLog(PERIOD, **still))
    moving = {name: getattr(log, name)[700:-700] for name in vars(log) if name != "period"}
    with pytest.raises(IdentificationError, match=r"rests for 0\.00 s of the log"):
        zmp_rows(REGRESSOR, MotionLog(PERIOD, **moving))
    with pytest.raises(IdentificationError, match="never carry"):
        zmp_rows(REGRESSOR, replace(log, foot_cells=0.1 * log.foot_cells))
    with pytest.raises(IdentificationError, match="14 joints; expected the robot's 12"):
        zmp_rows(ZmpRegressor(load_robot("table")), log)


def test_recording_that_tells_hardly_anything_is_refused() -> None:
    one_posture = still_rows(TRUE, np.random.default_rng(0), 1, 0.0)
    with pytest.raises(IdentificationError, match=r"tell 3\.. combinations .* expected 5 or more"):
        identify_dynamics(REGRESSOR, [one_posture])


def test_gap_in_the_readings_is_refused() -> None:
    def reading(stamp: int) -> Sensors:
        upright = np.array([0.0, 0.0, 0.0, 1.0])
        return Sensors(stamp, *(np.zeros(14) for _ in range(3)), upright, np.zeros(3), np.zeros(3), np.ones((2, 4)))

    stamps = [4_000_000 * k for k in range(10)]
    assert MotionLog.of([reading(stamp) for stamp in stamps]).period == pytest.approx(0.004)
    with pytest.raises(ValueError, match=r"readings 4 and 5 are 8\.0 ms apart"):
        MotionLog.of([reading(stamp) for stamp in stamps[:5] + stamps[6:]])
    longest = longest_part([reading(stamp) for stamp in [-2_000_000, *stamps[:3], *stamps[5:]]])
    assert [each.stamp for each in longest] == stamps[5:]


def test_filter_keeps_slow_sines_and_their_derivatives_in_phase(log: MotionLog) -> None:
    times = PERIOD * np.arange(3000)
    sine, slope = np.sin(2 * np.pi * times), 2 * np.pi * np.cos(2 * np.pi * times)
    parts = {name: np.repeat(getattr(log, name)[:1], 3000, axis=0) for name in vars(log) if name != "period"}
    found = smooth(MotionLog(PERIOD, **(parts | {"joint_positions": sine[:, None] * np.ones(14)})), 6.0)
    middle = slice(200, -200)
    np.testing.assert_allclose(found.q[middle, 0], sine[middle], atol=1e-4)
    np.testing.assert_allclose(found.dq[middle, 0], slope[middle], atol=2e-3)
    np.testing.assert_allclose(found.ddq[middle, 0], -((2 * np.pi) ** 2) * sine[middle], atol=0.05)


def test_prior_spreads_links_as_it_says() -> None:
    def mass_deviation(robot: Robot) -> float:
        row = np.zeros(150)
        row[::10] = 1.0
        return float(np.sqrt(row @ inertial_prior(robot).covariance @ row))

    independent = 0.2 * np.sqrt(sum(link.mass**2 for link in BELIEVED.links))
    assert mass_deviation(BELIEVED) == pytest.approx(independent)
    with pytest.raises(ValueError, match=r"inertia_share is 0\.0; expected > 0"):
        inertial_prior(BELIEVED, inertia_share=0.0)
