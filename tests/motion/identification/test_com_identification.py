"""Static identification on synthetic postures with the simulator's sensor errors, and what it refuses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2
from synthetic import Held, com_by_pinocchio, measure

from tulip_description.robot import Robot, load_robot
from tulip_motion.identification.body_prior import Spread
from tulip_motion.identification.com_identification import ComIdentification, IdentificationSettings, identify_com
from tulip_motion.identification.com_regressor import standard_parameters
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.static_measurement import StaticMeasurement
from tulip_motion.motion import with_fixed_head
from tulip_sim.parameters import WorldParameters
from tulip_sim.secret_body import secret_body, table_robot

ROBOT = load_robot()
TABLE = IdentificationSettings(spread=Spread(unlisted=3.0))
"""The table does not list upper body and head."""


def errors(found: ComIdentification, truth: Robot, unseen: Held) -> tuple[np.ndarray, np.ndarray]:
    """Return the CoM's error in x and y (2,), root mean square, before and after [m]."""
    true = np.array([com_by_pinocchio(truth, *posture)[:2] for posture in unseen])
    before = np.array([com_by_pinocchio(found.prior, *posture)[:2] for posture in unseen])
    after = np.array([found.com(*posture)[0][:2] for posture in unseen])
    return np.sqrt(np.mean((before - true) ** 2, axis=0)), np.sqrt(np.mean((after - true) ** 2, axis=0))


def nees(found: ComIdentification, truth: Robot) -> float:
    """Return the normalised error squared of the base parameters that were unknown."""
    unknown = found.base.unknown
    error = (found.values - found.base.combinations @ standard_parameters(truth))[unknown]
    return float(error @ np.linalg.solve(found.covariance[unknown, unknown], error))


def sound(held: Held, seed: int = 3) -> tuple[Robot, list[StaticMeasurement]]:
    """Return a robot that was secretly changed and its measurements."""
    truth = secret_body(ROBOT, np.random.default_rng(seed))
    return truth, measure(truth, held, np.random.default_rng([seed, 1]))


@pytest.mark.parametrize("seed", range(3))
def test_com_of_200_unseen_postures_is_within_2_mm_and_ten_times_better_than_before(
    held: Held, unseen: Held, seed: int
) -> None:
    truth, measurements = sound(held, seed)
    before, after = errors(identify_com(ROBOT, measurements), truth, unseen)
    assert (after < 2e-3).all()
    assert np.hypot(*after) < np.hypot(*before) / 10.0


def test_the_teams_table_as_prior_finds_the_robot_of_23_kg(held: Held, unseen: Held) -> None:
    found = identify_com(table_robot(), measure(ROBOT, held, np.random.default_rng(1)), TABLE)
    before, after = errors(found, ROBOT, unseen)
    assert found.mass == pytest.approx(23.0, abs=0.02)
    assert (after < 2e-3).all() and (after < before / 10.0).all()


def test_covariance_is_honest_over_seeds(held: Held) -> None:
    seeds, total = 30, 0.0
    for seed in range(seeds):
        truth, measurements = sound(held, seed)
        found = identify_com(ROBOT, measurements)
        total += nees(found, truth)
    numbers = seeds * (len(found.values) - 1)
    # s is estimated from 49 numbers, which widens the range of the sum beyond that of chi^2 by about a tenth
    assert 0.9 * chi2.ppf(0.005, numbers) < total < 1.1 * chi2.ppf(0.995, numbers)


def test_without_sensor_errors_the_base_parameters_are_exact(held: Held) -> None:
    truth = secret_body(ROBOT, np.random.default_rng(1))
    perfect = WorldParameters.exact().sensors
    found = identify_com(ROBOT, measure(truth, held, np.random.default_rng(0), perfect))
    assert found.values == pytest.approx(found.base.combinations @ standard_parameters(truth), abs=1e-6)
    assert found.mount == pytest.approx(np.zeros(2), abs=1e-6)


def test_mounting_of_the_imu_is_found_within_its_covariance(held: Held) -> None:
    mounting = np.array([0.006, -0.004])  # [rad] about x and y
    truth, measurements = sound(held)
    turned = [replace(each, down=_tilted(each.down, mounting)) for each in measurements]
    plain, found = identify_com(ROBOT, measurements), identify_com(ROBOT, turned)
    assert found.mount - plain.mount == pytest.approx(mounting, abs=1e-4)
    deviation = np.sqrt(np.diag(found.mount_covariance))
    assert (deviation < 5e-4).all()
    assert errors(found, truth, held)[1] == pytest.approx(errors(plain, truth, held)[1], abs=1e-4)


def _tilted(down: np.ndarray, mounting: np.ndarray) -> np.ndarray:
    tilted = down - np.cross(np.append(mounting, 0.0), down)
    return tilted / np.linalg.norm(tilted)


def test_sum_of_all_masses_is_known_and_what_the_cells_weigh(held: Held) -> None:
    truth, measurements = sound(held)
    found = identify_com(ROBOT, measurements)
    assert found.values[-1] == 1.0 and not found.covariance[-1].any()
    assert found.mass == pytest.approx(truth.mass, rel=1e-3)


@pytest.mark.parametrize(
    ("order", "sides", "explanation"),
    [
        ((2, 3, 0, 1), ("left", "right"), "heel and toe cells of both feet are swapped"),
        ((2, 3, 0, 1), ("right",), "heel and toe cells of the right foot are swapped"),
        ((1, 0, 3, 2), ("left", "right"), "inner and outer cells of both feet are swapped"),
        ((1, 0, 3, 2), ("left",), "inner and outer cells of the left foot are swapped"),
        ((3, 2, 1, 0), ("left", "right"), "heel and toe and inner and outer cells of both feet are swapped"),
        ((1, 0, 2, 3), ("left", "right"), "heel inner and heel outer cells of both feet are swapped"),
        ((1, 0, 2, 3), ("left",), "heel inner and heel outer cells of the left foot are swapped"),
        ((0, 3, 2, 1), ("right",), "heel outer and toe outer cells of the right foot are swapped"),
        ((3, 1, 2, 0), ("left",), "heel inner and toe outer cells of the left foot are swapped"),
        ((1, 2, 3, 0), ("left", "right"), "no swap of cells explains it"),
    ],
)
@pytest.mark.parametrize("prior", [ROBOT, table_robot()], ids=["playing", "table"])
def test_swapped_cells_are_named(
    held: Held, prior: Robot, order: tuple[int, ...], sides: tuple[str, ...], explanation: str
) -> None:
    truth, measurements = sound(held)
    wrong = measure(truth, held, np.random.default_rng([3, 1]), cell_order=order)
    mixed = [bad if bad.side in sides else good for bad, good in zip(wrong, measurements, strict=True)]
    with pytest.raises(IdentificationError, match=explanation):
        identify_com(prior, mixed, None if prior is ROBOT else TABLE)


def test_cells_of_left_and_right_foot_swapped_are_named(held: Held) -> None:
    # The foot that seems to carry is the other one, and in its frame inner and outer cells lie the other way round.
    other = {"left": "right", "right": "left"}
    mirror = np.array([1.0, -1.0])
    swapped = [
        replace(
            each,
            side=other[each.side],
            cop=each.cop * mirror,
            cop_covariance=each.cop_covariance * np.outer(mirror, mirror),
        )
        for each in sound(held)[1]
    ]
    with pytest.raises(IdentificationError, match="cells of the left and the right foot are swapped"):
        identify_com(ROBOT, swapped)


def test_too_few_postures_are_refused_with_how_many_it_takes(held: Held) -> None:
    _, measurements = sound(held)
    with pytest.raises(
        IdentificationError, match=r"20 postures give 40 numbers for 31 unknown .* measure at least 21 postures"
    ):
        identify_com(ROBOT, measurements[:20])
    assert identify_com(ROBOT, measurements[:24]).postures == 24


def test_two_postures_again_and_again_are_refused_as_telling_nothing(held: Held) -> None:
    truth, _ = sound(held)
    with pytest.raises(IdentificationError, match="do not tell the body: the CoM of others would be unknown"):
        identify_com(ROBOT, measure(truth, held[:2] * 20, np.random.default_rng(0)))


def test_one_foot_alone_is_refused_with_the_foot_named(held: Held) -> None:
    truth, _ = sound(held)
    left = [posture for posture in held if posture[0] == "left"]
    with pytest.raises(IdentificationError, match="only the left foot was stood on"):
        identify_com(ROBOT, measure(truth, left * 2, np.random.default_rng(0)))


def test_a_head_that_did_not_move_is_named_and_may_be_fixed_instead(held: Held) -> None:
    truth, _ = sound(held)
    still = [(side, np.append(joints[:12], (0.0, 0.0))) for side, joints in held]
    measurements = measure(truth, still, np.random.default_rng(0))
    with pytest.raises(IdentificationError, match="head_pan, head_tilt did not move"):
        identify_com(ROBOT, measurements)
    legs = [replace(each, joint_positions=each.joint_positions[:12]) for each in measurements]
    found = identify_com(with_fixed_head(ROBOT), legs)
    side, joints = still[0]
    assert found.com(side, joints[:12])[0] == pytest.approx(com_by_pinocchio(truth, side, joints), abs=1e-3)


def test_another_weight_is_refused_unless_the_spread_allows_for_it(held: Held) -> None:
    measurements = measure(ROBOT, held, np.random.default_rng(1))
    with pytest.raises(IdentificationError, match=r"the cells weigh 23\.0\d kg, the robot playing has 16\.7\d kg"):
        identify_com(table_robot(), measurements)
    identify_com(table_robot(), measurements, TABLE)


def test_a_robot_with_longer_thighs_is_another_robot(held: Held) -> None:
    joints = tuple(
        replace(joint, origin=(0.0, 0.0, joint.origin[2] - 0.04)) if joint.name.endswith("knee") else joint
        for joint in ROBOT.joints
    )
    log = measure(replace(ROBOT, joints=joints), held, np.random.default_rng(1))
    with pytest.raises(IdentificationError, match="no swap of cells explains it: a log of another robot"):
        identify_com(ROBOT, log)


def test_a_robot_with_other_joints_is_another_robot(held: Held) -> None:
    _, measurements = sound(held)
    with pytest.raises(IdentificationError, match="posture 0 has 14 joints, the robot table 12"):
        identify_com(load_robot("table"), measurements)


def test_a_posture_that_the_other_foot_helped_to_hold_is_named(held: Held) -> None:
    _, measurements = sound(held)
    measurements[7] = replace(measurements[7], cells=0.8 * measurements[7].cells)
    with pytest.raises(IdentificationError, match=r"posture 7 weighs .* stance foot did not carry the robot alone"):
        identify_com(ROBOT, measurements)


def test_postures_that_no_rigid_body_explains_are_refused(held: Held) -> None:
    rng = np.random.default_rng(0)
    _, measurements = sound(held)
    shaken = [replace(each, cop=each.cop + 2e-3 * rng.standard_normal(2)) for each in measurements]
    with pytest.raises(IdentificationError, match="do not fit one rigid body"):
        identify_com(ROBOT, shaken)


@pytest.mark.parametrize("changes", [{"mass": 0.0}, {"com": math.nan}, {"unlisted": -1.0}])
def test_spreads_that_cannot_be_are_refused(changes: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=f"^{next(iter(changes))} is "):
        Spread(**changes)
