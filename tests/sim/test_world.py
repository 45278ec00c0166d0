"""The physics: the robot in it, the ball, goals and keeper."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pybullet
import pytest

from tulip_description.field import load_field
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import JOINTS, LEG_JOINTS, VARIANTS, load_robot
from tulip_description.robot_io import JointCommand
from tulip_sim import bodies
from tulip_sim.bullet_physics import BulletRobot
from tulip_sim.keeper import Keeper
from tulip_sim.parameters import SensorParameters, WorldParameters
from tulip_sim.scenario import BALL_DISTANCE, Scenario, random_trial
from tulip_sim.truth import Truth
from tulip_sim.world import World

FIELD = load_field()
STANCE_KP = np.array([150.0, 400.0, 400.0, 400.0, 200.0, 200.0] * 2)
STANCE_KD = np.array([3.0, 8.0, 8.0, 8.0, 2.0, 0.4] * 2)
EXACT = WorldParameters.exact()
FAR = Scenario(robot=Pose2D(-3.0, -2.0, 0.7), ball=(0.0, 0.0))
MakeWorld = Callable[..., World]


@pytest.fixture
def make_world() -> Iterator[MakeWorld]:
    worlds: list[World] = []

    def make(*args: object, **kwargs: object) -> World:
        worlds.append(World(*args, **kwargs))  # type: ignore[arg-type]
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()


def stand(sequence: int, effort: float = 0.0, stiffness: float = 1.0) -> JointCommand:
    posture = standing_posture(load_robot()).joint_positions[:12]
    zero = np.zeros(12)
    return JointCommand(sequence, 0, LEG_JOINTS, posture, zero, zero + effort, stiffness * STANCE_KP, STANCE_KD)


def run(world: World, seconds: float, stiffness: float = 1.0) -> Truth:
    for _ in range(round(seconds / 0.004)):
        assert world.apply(stand(world.stamp // 1_000_000 + 1, stiffness=stiffness)) == ""
        world.advance(4)
    return world.truth()


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_link_has_the_mass_com_and_inertia_of_the_model(variant: str) -> None:
    robot = load_robot(variant)
    client = bodies.connect(EXACT)
    try:
        body, index = bodies.add_robot(client, robot)
        assert pybullet.getNumJoints(body, physicsClientId=client) == len(robot.links) - 1
        for link in robot.links:
            info = pybullet.getDynamicsInfo(body, index[link.name], physicsClientId=client)
            assert info[0] == pytest.approx(link.mass, rel=1e-9), link.name
            np.testing.assert_allclose(info[2], link.inertia, rtol=1e-6, err_msg=link.name)
            np.testing.assert_allclose(info[3], link.com, atol=1e-9, err_msg=link.name)
            np.testing.assert_allclose(info[4], [0, 0, 0, 1], atol=1e-9, err_msg=link.name)
            assert info[5] == 0.0  # restitution
        for joint in robot.moving:
            info = pybullet.getJointInfo(body, index[joint.name], physicsClientId=client)
            assert (info[8], info[9], info[6]) == (joint.lower, joint.upper, 0.0)
    finally:
        pybullet.disconnect(client)


def pybullet_body(world: World) -> BulletRobot:
    body = world.robots[0].body
    assert isinstance(body, BulletRobot)
    return body


def _dynamics(world: World, link: str) -> tuple[Any, ...]:
    only = pybullet_body(world)
    return tuple(pybullet.getDynamicsInfo(only.number, only.index[link], physicsClientId=only.client))


def test_masses_are_spread_by_the_seed_within_the_range(make_world: MakeWorld) -> None:
    world = make_world(FAR, replace(EXACT, mass_spread=0.05), seed=3)
    ratios = [_dynamics(world, link.name)[0] / link.mass for link in world.robot.links]
    assert 0.95 <= min(ratios) < 0.98 < 1.02 < max(ratios) <= 1.05


def test_all_masses_and_inertias_are_scaled_alike(make_world: MakeWorld) -> None:
    world = make_world(FAR, replace(EXACT, mass_scale=1.1))
    for link in world.robot.links:
        info = _dynamics(world, link.name)
        assert info[0] == pytest.approx(1.1 * link.mass)
        np.testing.assert_allclose(info[2], 1.1 * np.array(link.inertia), rtol=1e-6)


def test_robot_starts_where_the_scenario_says_with_soles_on_the_ground(make_world: MakeWorld) -> None:
    world = make_world(FAR, EXACT)
    truth = world.truth()
    np.testing.assert_allclose(truth.base_position[:2], [-3.0, -2.0], atol=1e-9)
    assert truth.base_position[2] == pytest.approx(standing_posture(load_robot()).base_height, abs=1e-9)
    np.testing.assert_allclose(truth.base_orientation, [0, 0, np.sin(0.35), np.cos(0.35)], atol=1e-9)
    np.testing.assert_allclose(truth.joint_positions, standing_posture(load_robot()).joint_positions)
    assert truth.stamp == 0


@pytest.mark.parametrize("seed", [1, 2])
def test_stiff_joints_hold_a_stand_for_two_seconds(make_world: MakeWorld, seed: int) -> None:
    world = make_world(FAR, WorldParameters(), seed)
    start = world.truth()
    end = run(world, 2.0)
    assert np.abs(end.joint_positions - start.joint_positions).max() < 0.06  # sag by gravity: 12 N m / 400 N m/rad
    np.testing.assert_allclose(end.base_position, start.base_position, atol=0.03)
    assert np.abs(end.base_orientation[:2]).max() < 0.01


def test_robot_stands_before_the_first_command(make_world: MakeWorld) -> None:
    world = make_world(FAR, WorldParameters(), 1)
    world.advance(1500)
    assert world.truth().base_position[2] > 1.0


def test_table_variant_stands_too(make_world: MakeWorld) -> None:
    robot = load_robot("table")
    world = make_world(FAR, EXACT, robot=robot)
    world.advance(1000)
    assert world.truth().base_position[2] > 1.0
    assert world.truth().joint_positions.shape == (12,)


def test_robot_falls_when_commands_stop(make_world: MakeWorld) -> None:
    world = make_world(FAR, EXACT)
    run(world, 0.1)
    world.advance(2500)
    assert world.truth().base_position[2] < 0.8


def test_efforts_are_reported_and_saturated(make_world: MakeWorld) -> None:
    world = make_world(FAR, EXACT)
    assert world.apply(stand(1, effort=1000.0)) == ""
    world.advance(4)
    efforts = world.sensors().joint_efforts
    assert (np.abs(efforts) <= load_robot().effort_limits).all()
    assert efforts[JOINTS.index("left_knee")] == 65.0


def test_cells_carry_the_weight_and_cop_lies_below_the_com(make_world: MakeWorld) -> None:
    world = make_world(FAR, EXACT)
    run(world, 2.0)
    sums = []
    for tick in range(50):
        world.apply(stand(10_000 + tick))
        world.advance(4)
        sums.append(world.sensors().foot_cells)
    cells = np.mean(sums, axis=0)
    assert cells.sum() == pytest.approx(23.0 * 9.81, rel=0.01)
    assert abs(cells[0].sum() - cells[1].sum()) < 5.0
    cop = cells[0] @ np.array(load_robot().feet[0].cells) / cells[0].sum()
    assert cop[0] == pytest.approx(0.04, abs=0.03)


def test_sensors_without_error_equal_the_truth(make_world: MakeWorld) -> None:
    world = make_world(FAR, EXACT)
    world.advance(8)
    np.testing.assert_array_equal(world.sensors().joint_positions, world.truth().joint_positions)
    assert world.sensors().stamp == world.truth().stamp == 8_000_000


def test_delayed_sensors_show_the_past(make_world: MakeWorld) -> None:
    fresh, late = make_world(FAR, EXACT), make_world(FAR, replace(EXACT, sensor_delay=(6, 6)))
    fresh.advance(34)
    late.advance(34)
    late.advance(6)
    assert late.sensors().stamp == 34_000_000
    np.testing.assert_array_equal(late.sensors().joint_positions, fresh.truth().joint_positions)
    late.advance(2)
    assert late.sensors().stamp == 34_000_000  # the next one was measured at 38 ms and comes at 44 ms


@pytest.mark.parametrize("delay", [0, 3, 9])
def test_readings_come_at_every_tick_in_order_with_the_drawn_delay(make_world: MakeWorld, delay: int) -> None:
    world = make_world(FAR, replace(EXACT, sensor_delay=(delay, delay)))
    world.advance(100)  # nobody looks: only the newest must be kept
    stamps = []
    for _ in range(5):
        world.advance(4)
        stamps.append(world.sensors().stamp)
    assert np.diff(stamps).tolist() == [4_000_000] * 4
    assert world.stamp - stamps[-1] == delay * 1_000_000


def test_joints_stay_inside_their_ranges(make_world: MakeWorld) -> None:
    world = make_world(FAR, EXACT)
    zero = np.zeros(12)
    for tick in range(250):
        world.apply(JointCommand(tick + 1, 0, LEG_JOINTS, zero, zero, np.full(12, -12.0), zero, zero))
        world.advance(4)
    lower, upper = load_robot().position_limits
    positions = world.truth().joint_positions
    assert (positions > lower - 0.05).all() and (positions < upper + 0.05).all()
    assert (positions < lower + 0.05).any()


def test_push_moves_the_trunk_by_its_impulse(make_world: MakeWorld) -> None:
    still, pushed = make_world(FAR, EXACT), make_world(FAR, EXACT)
    pushed.push((0.0, 50.0, 0.0), 100)
    for world in (still, pushed):
        world.advance(100)
    gained = pushed.truth().base_linear_velocity - still.truth().base_linear_velocity
    assert 0.03 < gained[1] < 5.0 / 23.0 * 3.0  # the feet hold the lower half
    still.advance(1)
    with pytest.raises(ValueError, match="expected three finite numbers"):
        pushed.push((0.0, np.nan, 0.0), 10)


def test_same_seed_and_commands_give_the_same_truth_bit_for_bit(make_world: MakeWorld) -> None:
    keeper = Keeper(Pose2D(4.2, 0.4, np.pi), ((4.2, -0.4),))
    scenario = Scenario(Pose2D(0.0, 0.0, 0.1), (0.35, 0.1), keeper)
    runs = []
    for _ in range(2):
        world = make_world(scenario, WorldParameters(), seed=7)
        run(world, 0.2)
        world.push((60.0, 0.0, 0.0), 80)
        world.place_ball(3.0, 0.1, 4.0, 0.5)
        runs.append((run(world, 0.6, stiffness=0.7), world.sensors()))
    for a, b in zip(*runs, strict=True):
        for name, value in vars(a).items():
            np.testing.assert_array_equal(value, getattr(b, name), err_msg=name)
    other = make_world(scenario, WorldParameters(), seed=8)
    assert not np.array_equal(run(other, 0.1).joint_positions, runs[0][0].joint_positions)


@pytest.mark.parametrize("friction", [0.6, 1.0])
def test_rolling_ball_slows_down_as_parameterised(make_world: MakeWorld, friction: float) -> None:
    world = make_world(FAR, replace(EXACT, friction=(friction, friction)))
    world.place_ball(-1.0, 0.0, 2.0, 0.0)
    world.advance(200)
    before = world.truth().ball_linear_velocity[0]
    world.advance(1500)
    after = world.truth().ball_linear_velocity[0]
    assert (before - after) / 1.5 == pytest.approx(world.parameters.ball_rolling_deceleration, rel=0.1)


def test_ball_at_rest_stays_at_rest(make_world: MakeWorld) -> None:
    world = make_world(FAR, WorldParameters(), 2)
    world.advance(2000)
    np.testing.assert_allclose(world.truth().ball_position[:2], 0.0, atol=2e-3)
    assert world.truth().ball_position[2] == pytest.approx(FIELD.ball_radius, abs=2e-3)


@pytest.mark.parametrize(("y", "vx", "vy"), [(0.0, 4.0, 0.0), (0.9, 9.0, 1.0), (-0.2, 5.0, -1.5)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_net_stops_a_ball_inside_the_goal(make_world: MakeWorld, side: float, y: float, vx: float, vy: float) -> None:
    world = make_world(FAR, EXACT)
    world.place_ball(side * 3.9, y, side * vx, vy)
    world.advance(1500)
    x, end_y, _ = world.truth().ball_position
    goal = FIELD.opponent_goal
    assert goal.x < side * x < goal.x + goal.depth
    assert abs(end_y) < goal.width / 2 + goal.posts[0].radius * 2
    assert np.linalg.norm(world.truth().ball_linear_velocity) < 0.8


def test_post_keeps_a_ball_out(make_world: MakeWorld) -> None:
    world = make_world(FAR, EXACT)
    world.place_ball(3.9, FIELD.opponent_goal.posts[0].y, 4.0, 0.0)
    world.advance(800)
    assert world.truth().ball_position[0] < 4.5


def test_keeper_stops_a_ball_and_stays(make_world: MakeWorld) -> None:
    keeper = Keeper(Pose2D(4.2, 0.4, np.pi))
    world = make_world(replace(FAR, keeper=keeper), EXACT)
    world.place_ball(3.5, 0.26, 3.0, 0.0)
    world.advance(800)
    truth = world.truth()
    assert truth.ball_position[0] < 4.2
    assert truth.keeper == keeper.pose
    assert truth.keeper_touches == 1
    assert truth.foot_touches == (0, 0)


def test_moving_keeper_goes_to_and_fro_and_its_body_with_it(make_world: MakeWorld) -> None:
    keeper = Keeper(Pose2D(4.2, 0.4, np.pi), ((4.2, -0.4),), speed=0.4)
    assert keeper.pose_at(1_000_000_000).y == pytest.approx(0.0)
    assert keeper.pose_at(3_000_000_000).y == pytest.approx(0.0)
    assert keeper.pose_at(4_000_000_000).y == pytest.approx(0.4)
    world = make_world(replace(FAR, keeper=keeper), EXACT)
    world.advance(1000)
    truth = world.truth()
    assert truth.keeper is not None and truth.keeper.y == pytest.approx(0.0)
    assert truth.keeper_path == ((4.2, 0.4), (4.2, -0.4))
    world.place_ball(3.9, 0.14, 3.0, 0.0)  # onto its left foot, which was at 0.54 in the beginning
    world.advance(300)
    assert world.truth().keeper_touches == 1


def test_touch_of_a_foot_is_counted_once(make_world: MakeWorld) -> None:
    world = make_world(Scenario(Pose2D(0.0, 0.0, 0.0), (1.0, 0.12)), EXACT)
    world.place_ball(0.6, 0.12, -1.5, 0.0)
    world.advance(400)
    truth = world.truth()
    assert truth.foot_touches == (1, 0)
    assert truth.ball_linear_velocity[0] > 0.1  # it came back, slowed down by its spin


def test_poles_can_be_left_out(make_world: MakeWorld) -> None:
    with_poles, without = make_world(FAR, EXACT), make_world(replace(FAR, poles=False), EXACT)
    for world in (with_poles, without):
        world.place_ball(0.0, 2.8, 0.0, 3.0)
        world.advance(500)
    assert with_poles.truth().ball_position[1] < 3.4 < without.truth().ball_position[1]


def test_uneven_start_postures_are_refused() -> None:
    posture = standing_posture(load_robot()).joint_positions.copy()
    posture[3] += 0.3
    with pytest.raises(ValueError, match="expected level soles"):
        World(FAR, EXACT, joint_positions=posture)
    with pytest.raises(ValueError, match=r"shape \(3,\)"):
        World(FAR, EXACT, joint_positions=np.zeros(3))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("friction", (0.0, 1.0)),
        ("friction", (1.0, 0.5)),
        ("mass_spread", 1.0),
        ("mass_scale", 0.0),
        ("sensor_delay", (2, 1)),
        ("ball_mass", 0.0),
        ("net_damping", -1.0),
    ],
)
def test_world_parameters_are_checked(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=name):
        WorldParameters(**{name: value})  # type: ignore[arg-type]


def test_random_trials_keep_the_rules_of_the_scenario() -> None:
    for seed in range(200):
        trial = random_trial(np.random.default_rng(seed), FIELD)
        robot, keeper = trial.robot, trial.keeper
        assert -FIELD.length / 2 < robot.x < 0 and abs(robot.y) < FIELD.width / 2
        to_goal = np.arctan2(-robot.y, FIELD.length / 2 - robot.x)
        assert abs(robot.yaw - to_goal) <= np.radians(45) + 1e-9
        distance = np.hypot(trial.ball[0] - robot.x, trial.ball[1] - robot.y)
        assert BALL_DISTANCE[0] <= distance <= BALL_DISTANCE[1]
        assert abs(trial.ball[0]) < FIELD.length / 2 and abs(trial.ball[1]) < FIELD.width / 2
        assert (
            keeper is not None and keeper.pose.x < FIELD.length / 2 and 0.2 < abs(keeper.pose.y) < FIELD.goal_width / 2
        )
    assert random_trial(np.random.default_rng(5), FIELD) == random_trial(np.random.default_rng(5), FIELD)


def test_sensor_errors_are_off_in_the_exact_world() -> None:
    for field in dataclasses.fields(SensorParameters):
        if field.name != "period":
            assert getattr(EXACT.sensors, field.name) == 0.0


@pytest.mark.parametrize("variant", VARIANTS)
def test_accelerations_in_free_flight_equal_the_model(make_world: MakeWorld, variant: str) -> None:
    robot = load_robot(variant)
    world = make_world(FAR, EXACT, robot=robot)
    body = pybullet_body(world)
    base, _ = pybullet.getBasePositionAndOrientation(body.number, physicsClientId=body.client)
    turn = [0.1, -0.2, 0.3, np.sqrt(1 - 0.14)]
    pybullet.resetBasePositionAndOrientation(body.number, [base[0], base[1], 3.0], turn, physicsClientId=body.client)
    effort = np.array([1.0, -3.0, 4.0, -5.0, 2.0, 0.3, -1.0, 2.0, -6.0, 3.0, -1.0, -0.2])
    zero = np.zeros(12)
    world.apply(JointCommand(1, 0, LEG_JOINTS, zero, zero, effort, zero, zero))
    heads = len(robot.joint_names) - 12
    if heads:
        nothing = np.zeros(2)
        world.apply(JointCommand(1, 0, robot.joint_names[12:], nothing, nothing, nothing, nothing, nothing))
    before = world.truth()
    world.advance(1)
    after = world.truth()
    model = floating_model(robot)
    q = np.concatenate([before.base_position, before.base_orientation, before.joint_positions])
    expected = pin.aba(
        model, model.createData(), q, np.zeros(model.nv), np.concatenate([np.zeros(6), effort, np.zeros(heads)])
    )
    rotation = pin.Quaternion(*before.base_orientation[[3, 0, 1, 2]]).toRotationMatrix()
    joints = (after.joint_velocities - before.joint_velocities) / 1e-3
    np.testing.assert_allclose(joints, expected[6:], rtol=0.02, atol=0.5)
    np.testing.assert_allclose(rotation.T @ after.base_angular_velocity / 1e-3, expected[3:6], rtol=0.02, atol=0.2)
    np.testing.assert_allclose(rotation.T @ after.base_linear_velocity / 1e-3, expected[:3], rtol=0.02, atol=0.2)


def test_a_keeper_that_follows_the_ball_goes_level_with_it_and_no_further_than_the_goal(make_world: MakeWorld) -> None:
    keeper = Keeper(Pose2D(4.2, 0.0, np.pi), speed=0.2, follows=1.0)
    world = make_world(replace(FAR, ball=(0.0, 0.3), keeper=keeper), EXACT)
    world.advance(1000)
    first = world.truth().keeper
    assert first is not None
    assert first.y == pytest.approx(0.2, abs=1e-6)
    world.advance(1000)
    assert world.truth().keeper == Pose2D(4.2, pytest.approx(0.3, abs=1e-6), np.pi)
    world.place_ball(0.0, 2.9)
    world.advance(5000)
    assert world.truth().keeper == Pose2D(4.2, pytest.approx(1.0, abs=1e-6), np.pi)
    with pytest.raises(ValueError, match="follows is 1"):
        Keeper(Pose2D(4.2, 0.0, np.pi), ((4.2, 1.0),), follows=1.0)


def test_obstacles_stand_in_the_balls_way(make_world: MakeWorld) -> None:
    scenario = replace(FAR, obstacles=(Pose2D(1.0, 0.15, np.pi),))
    world = make_world(scenario, EXACT)
    assert world.truth().figures == scenario.obstacles
    world.place_ball(0.0, 0.15, 2.0, 0.0)
    world.advance(2000)
    assert world.truth().ball_position[0] < 1.0
