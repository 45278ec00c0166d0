"""The referee's hands: a robot that lies is set on its feet again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.world import World

pytestmark = pytest.mark.sim


def lying() -> World:
    world = World(Scenario(Pose2D(-3.0, -2.0, 0.7), (0.0, 0.0)), WorldParameters.exact(), 1)
    world.advance(100)
    world.push((300.0, 0.0, 0.0), 100)
    world.advance(2500)
    assert world.truth().base_position[2] < 0.8
    return world


def test_it_stands_at_rest_where_it_lay() -> None:
    world = lying()
    before = world.truth()
    world.set_upright()
    truth = world.truth()
    np.testing.assert_allclose(truth.base_position[:2], before.base_position[:2], atol=1e-9)
    assert truth.base_position[2] == pytest.approx(standing_posture(load_robot()).base_height, abs=1e-9)
    assert abs(truth.base_orientation[:2]).max() < 1e-12
    np.testing.assert_allclose(truth.joint_positions, standing_posture(load_robot()).joint_positions)
    assert not truth.base_linear_velocity.any() and not truth.joint_velocities.any()
    world.advance(4)
    assert np.isfinite(world.sensors().imu_linear_acceleration).all()


def test_it_stands_where_it_is_put_and_carries_its_weight() -> None:
    world = lying()
    world.set_upright(Pose2D(1.0, -1.0, 2.0))
    truth = world.truth()
    np.testing.assert_allclose(truth.base_position[:2], (1.0, -1.0), atol=1e-9)
    assert 2.0 * math.atan2(*truth.base_orientation[2:].tolist()) == pytest.approx(2.0, abs=1e-9)
    world.advance(20)
    assert world.sensors().foot_cells.sum(axis=1).min() > 40.0


def test_a_place_that_is_not_finite_is_refused() -> None:
    world = World(Scenario(Pose2D(), (3.0, 0.0)), WorldParameters.exact())
    with pytest.raises(ValueError, match="expected finite numbers"):
        world.set_upright(Pose2D(math.nan, 0.0, 0.0))
