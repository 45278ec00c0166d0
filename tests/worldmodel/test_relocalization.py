"""Being lost and found again: kidnapped robots, wrong starts, and the two halves that look alike."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest
from walk_simulation import ROUGH, ROUGH_WORLD, Errors, Moment, Simulation, stand, tour

from tulip_description.field import Field, load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.quaternion import pose_on_ground
from tulip_motion.interface import Odometry
from tulip_worldmodel.localization import Localization
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.odometry_history import Increment
from tulip_worldmodel.pose_seeds import SeedFinder
from tulip_worldmodel.world_model import WorldModel

FIELD = load_field()
BARE = FIELD.without_poles()
BEFORE = 3.0  # [s] that all is well
START = Pose2D(-1.5, 0.3, 0.2)


def kidnapped(target: Pose2D, seconds: float, arena: Field, seed: int) -> Iterator[Moment]:
    """Yield a robot that looks round, is carried elsewhere in no time, and looks round there.

    Legs know nothing of it; the IMU's heading turns with the body.
    """
    before = list(Simulation(stand, BEFORE, START, np.random.default_rng(seed), arena=arena).run())
    yield from before
    last = before[-1]
    here = pose_on_ground(last.odometry.position, last.odometry.orientation)
    base = Pose2D(here.x, here.y, here.yaw + target.yaw - last.pose.yaw)
    first: Pose2D | None = None
    for moment in Simulation(stand, seconds, target, np.random.default_rng(seed + 1), arena=arena).run():
        told = pose_on_ground(moment.odometry.position, moment.odometry.orientation)
        first = first or told
        pose = base @ (first.inverse() @ told)
        shift = round(BEFORE * 1e9)
        odometry = Odometry(
            moment.stamp + shift,
            np.array([pose.x, pose.y, 0.9]),
            np.array([0.0, 0.0, math.sin(pose.yaw / 2.0), math.cos(pose.yaw / 2.0)]),
            np.zeros(3),
            np.zeros(3),
            0.0,
        )
        features = None if moment.features is None else replace(moment.features, stamp=moment.features.stamp + shift)
        yield replace(moment, stamp=moment.stamp + shift, odometry=odometry, features=features)


@dataclass(frozen=True)
class Course:
    """What became of an estimate: at each moment its error, (3,), and whether it knew itself lost."""

    errors: np.ndarray
    lost: np.ndarray
    world: WorldModel


def follow(moments: Iterator[Moment], guess: Pose2D, arena: Field, parameters: LocalizationParameters) -> Course:
    world = WorldModel(replace(ROUGH_WORLD, localization=parameters), arena, guess)
    errors, lost = [], []
    for moment in moments:
        world.add_odometry(moment.odometry)
        if moment.features is not None:
            world.add_features(moment.features)
        pose = world.state(moment.stamp).robot.pose
        errors.append((pose.x - moment.pose.x, pose.y - moment.pose.y, wrap_angle(pose.yaw - moment.pose.yaw)))
        lost.append(world.localization.lost)
    return Course(np.array(errors), np.array(lost), world)


TARGETS = [Pose2D(2.0, -1.5, 2.5), Pose2D(-3.0, 1.0, -0.6), Pose2D(0.4, 2.0, -1.6), Pose2D(1.5, -0.3, 0.2 - math.pi)]


@pytest.mark.parametrize("arena", [FIELD, BARE], ids=["poles", "no poles"])
@pytest.mark.parametrize("index", range(len(TARGETS)))
def test_kidnapped_robot_notices_it_and_is_found_within_10_seconds_not_mirrored(index: int, arena: Field) -> None:
    moments = kidnapped(TARGETS[index], 10.0, arena, 10 + index)
    course = follow(moments, START, arena, ROUGH)
    before = round(BEFORE * 50)
    assert not course.lost[:before].any()
    assert course.lost[before:].any()
    assert not course.lost[-1]
    assert np.hypot(*course.errors[-25:, :2].T).max() < 0.3
    assert np.abs(course.errors[-25:, 2]).max() < math.radians(8.0)


@pytest.mark.parametrize("seed", range(4))
def test_start_error_of_half_a_metre_and_15_degrees_is_absorbed_within_5_seconds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = rng.uniform(-math.pi, math.pi)
    side = float(rng.choice((-1.0, 1.0)))
    guess = Pose2D(
        START.x + 0.5 * math.cos(turn), START.y + 0.5 * math.sin(turn), START.yaw + side * math.radians(15.0)
    )
    course = follow(Simulation(stand, 6.0, START, rng).run(), guess, FIELD, ROUGH)
    assert np.hypot(*course.errors[250:, :2].T).max() < 0.15
    assert np.abs(course.errors[250:, 2]).max() < math.radians(3.0)


def test_walk_without_kidnapping_is_never_called_lost() -> None:
    course = follow(Simulation(tour, 40.0, START, np.random.default_rng(3)).run(), START, FIELD, ROUGH)
    assert not course.lost.any()


def test_robot_that_sees_only_false_crossings_is_lost_and_says_so_by_its_covariance() -> None:
    blind = Errors(miss=1.0, false_crossing=0.45)
    course = follow(Simulation(stand, 12.0, START, np.random.default_rng(1), blind).run(), START, FIELD, ROUGH)
    assert course.lost[-1]
    assert np.sqrt(np.trace(course.world.localization.covariance[:2, :2])) > 0.5


def test_uncertainty_without_features_covers_the_error_of_dead_reckoning() -> None:
    inside = []
    for seed in range(6):
        world = WorldModel(ROUGH_WORLD, FIELD, START)
        sim = Simulation(tour, 30.0, START, np.random.default_rng(seed), Errors(vision=False, heading_drift=0.01))
        for moment in sim.run():
            world.add_odometry(moment.odometry)
        robot = world.state(moment.stamp).robot
        error = np.array([robot.pose.x - moment.pose.x, robot.pose.y - moment.pose.y])
        inside.append(error @ np.linalg.solve(robot.covariance[:2, :2], error) < 9.2)  # 99 % of chi-square, 2 values
    assert all(inside)


def picture_from(pose: Pose2D, arena: Field) -> Moment:
    exact = Errors(
        angle_spread=1e-4, tilt_spread=1e-6, azimuth_bias=1e-6, landmark_spread=0.0, miss=0.0, false_crossing=0
    )
    sim = Simulation(stand, 0.1, pose, np.random.default_rng(0), exact, arena=arena)
    return next(moment for moment in sim.run() if moment.features is not None)


@pytest.mark.parametrize("pose", [Pose2D(1.0, 0.5, 0.3), Pose2D(-2.0, -1.0, 3.0), Pose2D(0.5, -1.0, 1.0)])
def test_seeds_of_an_exact_picture_hold_the_true_pose_first_and_its_mirror_image_far_behind(pose: Pose2D) -> None:
    parameters = LocalizationParameters()
    features = picture_from(pose, BARE).features
    assert features is not None
    seeds = SeedFinder(replace(parameters, seeds=400), BARE).find(features, pose.yaw)
    best = seeds[0]
    assert math.hypot(best.pose.x - pose.x, best.pose.y - pose.y) < 0.02
    assert abs(wrap_angle(best.pose.yaw - pose.yaw)) < 0.01
    mirrored = [
        seed
        for seed in seeds
        if math.hypot(seed.pose.x + pose.x, seed.pose.y + pose.y) < 0.02
        and abs(wrap_angle(seed.pose.yaw - pose.yaw - math.pi)) < 0.01
    ]
    # All that tells the two apart is the heading that the IMU has kept.
    assert len(mirrored) == 1
    expected = math.log(1.0 + parameters.heading_break) - math.log(parameters.heading_break)
    assert best.log_weight - mirrored[0].log_weight == pytest.approx(expected, abs=0.1)


def test_without_a_heading_and_without_poles_both_halves_stay_possible_and_the_covariance_spans_both() -> None:
    blind = replace(ROUGH, heading_continuity=100.0)  # [rad] any heading is as likely as any other
    course = follow(kidnapped(TARGETS[0], 5.0, BARE, 5), START, BARE, blind)
    localization = course.world.localization
    (first, first_weight), (second, second_weight) = localization.hypotheses[:2]
    assert first_weight + second_weight > 0.9
    assert abs(wrap_angle(first.yaw - second.yaw)) == pytest.approx(math.pi, abs=0.1)
    assert math.hypot(first.x + second.x, first.y + second.y) < 0.3
    assert localization.lost
    apart = second_weight * math.dist((first.x, first.y), (second.x, second.y)) ** 2
    assert np.trace(localization.covariance[:2, :2]) > apart > 1.0


def test_odometry_that_says_it_slipped_adds_exactly_that_to_the_position() -> None:
    exact = replace(
        LocalizationParameters(), position_noise_per_metre=1e-9, position_noise_per_radian=1e-9,
        position_noise_per_second=1e-9, start_heading_spread=1e-9,
    )  # fmt: skip
    pose = Pose2D(0.0, 0.0, math.pi / 2.0)
    localization = Localization(exact, FIELD, pose)
    before = localization.covariance
    localization.predict(Increment(Pose2D(), 0.0, 0.0, 0.02, np.diag([0.04, 0.01])))
    added = localization.covariance - before
    assert added[:2, :2] == pytest.approx(np.diag([0.01, 0.04]), abs=1e-9)  # turned with the robot
