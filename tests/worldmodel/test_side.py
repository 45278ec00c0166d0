"""Which half of the field is which, and vision that claims to be better than it is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from walk_simulation import ROUGH, ROUGH_CAMERA, ROUGH_WORLD, Errors, Simulation, stand, tour

from tulip_description.field import Field, load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.noise_scale import NoiseScale
from tulip_worldmodel.pose_filter import PoseFilter
from tulip_worldmodel.world_model import WorldModel

FIELD = load_field()
BARE = FIELD.without_poles()
START = Pose2D(-1.5, 0.3, 0.2)
MIRRORED = Pose2D(-START.x, -START.y, START.yaw + math.pi)


def follow(simulation: Simulation, guess: Pose2D, arena: Field) -> np.ndarray:
    """Return errors of position [m] and heading [rad], and the noise scale, (n, 3), one row a tick."""
    world = WorldModel(ROUGH_WORLD, arena, guess)
    errors = []
    for moment in simulation.run():
        world.add_odometry(moment.odometry)
        if moment.features is not None:
            world.add_features(moment.features)
        pose = world.state(moment.stamp).robot.pose
        off = math.hypot(pose.x - moment.pose.x, pose.y - moment.pose.y)
        errors.append((off, abs(wrap_angle(pose.yaw - moment.pose.yaw)), world.localization.noise_scale))
    return np.array(errors)


@pytest.mark.parametrize("arena", [FIELD, BARE], ids=["poles", "no poles"])
@pytest.mark.parametrize("seed", range(3))
def test_vision_twice_as_bad_as_it_claims_costs_accuracy_but_never_the_half_of_the_field(
    seed: int, arena: Field
) -> None:
    simulation = Simulation(tour, 20.0, START, np.random.default_rng(seed), Errors(claimed=0.5), arena=arena)
    errors = follow(simulation, START, arena)
    assert errors[:, 1].max() < math.radians(60.0)
    late = errors[250:]  # the claims have been seen through by then
    assert np.sqrt(np.mean(late[:, 0] ** 2)) < 0.15
    assert np.sqrt(np.mean(late[:, 1] ** 2)) < math.radians(4.0)
    assert np.mean(late[:, 2]) > 1.3


def test_vision_as_good_as_it_claims_is_believed() -> None:
    simulation = Simulation(tour, 20.0, START, np.random.default_rng(4))
    errors = follow(simulation, START, FIELD)
    assert np.mean(errors[:, 2]) < 1.15


def test_robot_told_the_wrong_half_is_put_right_by_the_poles_and_stays_right() -> None:
    errors = follow(Simulation(stand, 12.0, START, np.random.default_rng(1)), MIRRORED, FIELD)
    assert errors[0, 1] == pytest.approx(math.pi, abs=0.1)
    assert errors[-250:, 0].max() < 0.2
    assert errors[-250:, 1].max() < math.radians(5.0)


def test_without_poles_a_robot_told_the_wrong_half_cannot_know_and_does_not_change_its_mind() -> None:
    errors = follow(Simulation(stand, 8.0, START, np.random.default_rng(1), arena=BARE), MIRRORED, BARE)
    assert errors[:, 1].min() > math.radians(170.0)


def test_turning_round_twice_is_the_same_hypothesis_again() -> None:
    hypothesis = PoseFilter(ROUGH, ROUGH_CAMERA, START, (0.3, 0.2, 0.1))
    hypothesis.side = 2.0
    before, spread = hypothesis.pose, hypothesis.covariance
    hypothesis.turn_round()
    assert hypothesis.pose.as_array() == pytest.approx([MIRRORED.x, MIRRORED.y, wrap_angle(MIRRORED.yaw)], abs=1e-12)
    assert hypothesis.side == -2.0
    hypothesis.turn_round()
    assert hypothesis.pose.as_array() == pytest.approx(before.as_array(), abs=1e-12)
    assert np.allclose(hypothesis.covariance, spread)


def test_absorbing_gives_the_moments_of_the_mixture() -> None:
    first = PoseFilter(ROUGH, ROUGH_CAMERA, Pose2D(1.0, 0.0, math.pi - 0.1), (0.1, 0.1, 0.05))
    second = PoseFilter(ROUGH, ROUGH_CAMERA, Pose2D(1.4, 0.2, -math.pi + 0.1), (0.3, 0.3, 0.1))
    first.absorb(second, 0.25)
    assert first.pose.as_array() == pytest.approx([1.1, 0.05, math.pi - 0.05], abs=1e-9)
    rng = np.random.default_rng(0)
    of_second = rng.random(400_000) < 0.25
    x = np.where(of_second, rng.normal(1.4, 0.3, len(of_second)), rng.normal(1.0, 0.1, len(of_second)))
    assert first.covariance[0, 0] == pytest.approx(np.var(x), rel=0.02)


@pytest.mark.parametrize("factor", [1.0, 2.0, 3.0])
def test_noise_scale_finds_the_factor_among_false_features(factor: float) -> None:
    rng = np.random.default_rng(2)
    scale, values = NoiseScale(LocalizationParameters()), []
    for _ in range(6000):
        false = rng.random() < 0.1
        error = rng.uniform(5.0, 50.0, 2) if false else rng.normal(0.0, factor, 2)
        scale.add(float(error @ error) / scale.value**2, 2, 0.1)
        values.append(scale.value)
    assert np.mean(values[2000:]) == pytest.approx(factor, rel=0.12)


def test_noise_scale_stays_within_its_bounds() -> None:
    parameters = replace(LocalizationParameters(), greatest_noise_scale=2.0)
    scale = NoiseScale(parameters)
    for _ in range(2000):
        scale.add(math.inf, 2, 0.05)
    assert scale.value == pytest.approx(2.0)
    for _ in range(2000):
        scale.add(0.0, 1, 0.05)
    assert scale.value == 1.0
