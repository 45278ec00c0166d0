"""The world on MuJoCo: the same robot, ball and field as on pybullet."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import LEG_JOINTS, load_robot
from tulip_description.robot_io import JointCommand
from tulip_sim.bench.body import Body
from tulip_sim.keeper import Keeper
from tulip_sim.parameters import ENGINES, WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.world import World

pytest.importorskip("mujoco", reason="MuJoCo is not installed (extra mujoco)")
pytestmark = pytest.mark.sim
FIELD = load_field()
EXACT = {engine: replace(WorldParameters.exact(), engine=engine) for engine in ENGINES}
FAR = Scenario(robot=Pose2D(-3.0, -2.0, 0.7), ball=(0.0, 0.0), poles=False)


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> Iterator[str]:
    yield request.param


def test_an_unknown_engine_is_refused() -> None:
    with pytest.raises(ValueError, match="engine is 'ode'; expected pybullet or mujoco"):
        WorldParameters(engine="ode")


def test_each_seed_draws_the_same_robot_on_both_engines() -> None:
    worlds = [World(FAR, WorldParameters(engine=engine), seed=3) for engine in ENGINES]
    assert worlds[0].friction == worlds[1].friction
    np.testing.assert_array_equal(worlds[0].robots[0].dry_friction, worlds[1].robots[0].dry_friction)
    np.testing.assert_array_equal(worlds[0].sensors().imu_orientation, worlds[1].sensors().imu_orientation)


def test_the_first_milliseconds_of_flight_are_the_same_on_both_engines() -> None:
    """Both step semi-implicitly, so in the air, where nothing touches, they agree to the order of a step squared."""
    ends = []
    for name in ENGINES:
        world = World(FAR, EXACT[name])
        only = world.robots[0]
        only.body.place(np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 0.0, 1.0]), only.joint_positions)
        zero = np.zeros(12)
        effort = np.array([1.0, -3.0, 4.0, -5.0, 2.0, 0.3, -1.0, 2.0, -6.0, 3.0, -1.0, -0.2])
        world.apply(JointCommand(1, 0, LEG_JOINTS, zero, zero, effort, zero, zero))
        world.advance(20)
        ends.append(world.truth())
    np.testing.assert_allclose(ends[0].base_position, ends[1].base_position, atol=2e-5)
    np.testing.assert_allclose(ends[0].base_angular_velocity, ends[1].base_angular_velocity, atol=0.02)
    moved = np.abs(ends[0].joint_positions - World(FAR, EXACT["pybullet"]).truth().joint_positions)
    assert moved.max() > 0.05
    np.testing.assert_allclose(ends[0].joint_positions, ends[1].joint_positions, atol=0.02 * moved.max())


def test_the_robot_walks_equally_far_on_both_engines_with_unchanged_parameters() -> None:
    ways = []
    for name in ENGINES:
        body = Body(1, Pose2D(-3.0, 2.0, 0.0), world=WorldParameters(engine=name))
        body.go(0.3)
        start = body.world.truth().base_position
        body.go(6.0, (0.3, 0.0, 0.0))
        assert not body.fallen
        ways.append(body.world.truth().base_position - start)
        assert 1.2 < ways[-1][0] < 1.8  # two seconds to speed up at most
        assert abs(ways[-1][1]) < 0.1
    assert ways[0][0] == pytest.approx(ways[1][0], abs=0.05)


def test_a_push_topples_the_robot(engine: str) -> None:
    body = Body(0, Pose2D(-3.0, 2.0, 0.0), world=WorldParameters(engine=engine))
    body.go(0.5)
    body.world.push([0.0, 400.0, 0.0], 200)
    body.go(2.0)
    assert body.fallen
    assert body.world.truth().base_position[1] > 2.0


def test_the_cells_carry_the_weight(engine: str) -> None:
    world = World(FAR, EXACT[engine])
    world.advance(1500)  # the driver holds the start posture
    cells = world.sensors().foot_cells
    assert cells.sum() == pytest.approx(load_robot().mass * 9.81, rel=0.02)
    cop = cells[0] @ np.array(load_robot().feet[0].cells) / cells[0].sum()
    assert cop[0] == pytest.approx(0.04, abs=0.03)


def test_a_rolling_ball_slows_as_stated(engine: str) -> None:
    world = World(FAR, EXACT[engine])
    world.place_ball(0.0, 1.0, 2.0, 0.0)
    world.advance(200)
    before = world.truth().ball_linear_velocity[0]
    world.advance(1500)
    truth = world.truth()
    assert (before - truth.ball_linear_velocity[0]) / 1.5 == pytest.approx(0.35, rel=0.02)
    assert truth.ball_angular_velocity[1] * FIELD.ball_radius == pytest.approx(truth.ball_linear_velocity[0], rel=0.02)


def test_a_ball_bounces_as_an_implicit_spring_and_damper(engine: str) -> None:
    """Rebound e^2 h with e = exp(-pi z / sqrt(1 - z^2)), z the damping ratio of K and B + h K."""
    world = World(FAR, EXACT[engine])
    p = world.parameters
    world.physics.place_ball(np.array([0.0, 0.0, FIELD.ball_radius + 0.5]), np.zeros(3), np.zeros(3))
    world.advance(340)  # it falls for 319 ms, and touches for 17
    heights = []
    for _ in range(400):
        world.advance(1)
        heights.append(world.truth().ball_position[2] - FIELD.ball_radius)
    ratio = (p.ball_damping + 1e-3 * p.ball_stiffness) / (2.0 * np.sqrt(p.ball_stiffness * p.ball_mass))
    restitution = np.exp(-np.pi * ratio / np.sqrt(1.0 - ratio**2))
    assert max(heights) == pytest.approx(restitution**2 * 0.5, rel=0.1)


def test_keeper_and_feet_count_their_touches_and_several_robots_stand(engine: str) -> None:
    keeper = Keeper(Pose2D(4.2, 0.4, np.pi))
    world = World(replace(FAR, keeper=keeper, others=(Pose2D(1.0, 2.0, 0.5),)), EXACT[engine])
    world.place_ball(3.5, 0.26, 3.0, 0.0)
    world.advance(800)
    truth = world.truth()
    assert truth.keeper_touches == 1 and truth.ball_position[0] < 4.2
    assert truth.base_position[2] > 1.0 and truth.others[0].base_position[2] > 1.0
    np.testing.assert_allclose(truth.others[0].base_position[:2], [1.0, 2.0], atol=0.02)
    foot = world.truth().footprint.transform((0.6, -0.12))
    back = -2.0 * np.array([np.cos(0.7), np.sin(0.7)])
    world.place_ball(*foot, *back)
    world.advance(600)
    assert world.truth().foot_touches[1] >= 1 and world.truth().foot_touches[0] == 0


def test_the_same_seed_gives_the_same_motion_bit_for_bit(engine: str) -> None:
    ends = []
    for _ in range(2):
        body = Body(4, Pose2D(), world=WorldParameters(engine=engine))
        body.go(1.0, (0.3, 0.0, 0.0))
        truth = body.world.truth()
        ends.append(np.concatenate([truth.base_position, truth.joint_positions, truth.ball_position]))
    np.testing.assert_array_equal(ends[0], ends[1])


def test_set_upright_puts_a_fallen_robot_on_its_feet(engine: str) -> None:
    world = World(FAR, EXACT[engine])
    world.push([300.0, 0.0, 0.0], 300)
    world.advance(2500)
    assert world.truth().base_position[2] < 0.8
    world.set_upright(Pose2D(1.0, 1.0, 0.3))
    world.advance(500)
    truth = world.truth()
    assert truth.base_position[2] > 1.0
    np.testing.assert_allclose(truth.base_position[:2], [1.0, 1.0], atol=0.03)
