from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from walk_simulation import CAMERA, Errors, Simulation

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_motion.interface import Odometry
from tulip_vision.features import Features
from tulip_worldmodel.odometry_history import OdometryHistory, increment
from tulip_worldmodel.world_model import WorldModel, WorldModelParameters

FIELD = load_field()
MS = 1_000_000


def odometry(stamp: int, x: float = 0.0, yaw: float = 0.0, pitch: float = 0.0) -> Odometry:
    """Return a reading: yaw about the vertical, then pitch of the trunk."""
    half_yaw, half_pitch = yaw / 2.0, pitch / 2.0
    orientation = np.array(
        [
            -math.sin(half_yaw) * math.sin(half_pitch),
            math.cos(half_yaw) * math.sin(half_pitch),
            math.sin(half_yaw) * math.cos(half_pitch),
            math.cos(half_yaw) * math.cos(half_pitch),
        ]
    )
    return Odometry(stamp, np.array([x, 0.0, 0.9]), orientation, np.zeros(3), np.zeros(3), 0.0)


def nothing(stamp: int) -> Features:
    return Features(stamp, CAMERA, np.array([0.5, -0.5, -1.0, 0.1]), ())


def test_before_any_input_the_state_is_the_start_with_its_uncertainty() -> None:
    start = Pose2D(-2.0, 1.0, 0.5)
    parameters = WorldModelParameters()
    state = WorldModel(parameters, FIELD, start).state(5)
    assert state.robot.pose == start
    position = math.hypot(0.3, parameters.localization.systematic_spread)
    assert np.sqrt(np.diag(state.robot.covariance)) == pytest.approx([position, position, math.radians(10.0)])
    assert state.ball is None
    assert state.opponents == ()


def test_pictures_that_cannot_be_used_are_rejected_whole_with_the_reason() -> None:
    world = WorldModel(WorldModelParameters(), FIELD, Pose2D())
    assert world.add_features(nothing(0))[0].reason == "no odometry yet"
    for stamp in range(0, 1000 * MS, 20 * MS):
        world.add_odometry(odometry(stamp))
    assert world.add_features(nothing(900 * MS)) == ()
    assert "older" in world.add_features(nothing(800 * MS))[0].reason
    assert "newer" in world.add_features(nothing(2000 * MS))[0].reason


def test_dead_reckoning_carries_the_pose_between_pictures() -> None:
    world = WorldModel(WorldModelParameters(), FIELD, Pose2D(1.0, 1.0, math.pi / 2.0))
    for tick in range(50):
        world.add_odometry(odometry(tick * 20 * MS, x=5.0 + 0.01 * tick, pitch=0.1))
    state = world.state(49 * 20 * MS)
    assert state.robot.pose.as_array() == pytest.approx([1.0, 1.49, math.pi / 2.0], abs=1e-5)  # told in steps of 2^-16
    assert state.robot.pose_in_odom.as_array() == pytest.approx([5.49, 0.0, 0.0], abs=1e-5)
    assert state.stamp == 49 * 20 * MS


def test_asking_for_the_state_changes_nothing() -> None:
    world = WorldModel(WorldModelParameters(), FIELD, Pose2D())
    for tick in range(20):
        world.add_odometry(odometry(tick * 20 * MS, x=0.01 * tick))
    first = world.state(300 * MS)
    for _ in range(5):
        world.state(380 * MS)
    again = world.state(300 * MS)
    assert first.robot.pose == again.robot.pose
    assert np.array_equal(first.robot.covariance, again.robot.covariance)
    assert first.stamp == again.stamp == 300 * MS


def test_uncertainty_grows_with_time_in_minutes_without_pictures_and_history_stays_short() -> None:
    world = WorldModel(WorldModelParameters(), FIELD, Pose2D())
    spreads = []
    for tick in range(3000):
        world.add_odometry(odometry(tick * 20 * MS, x=0.004 * tick))
        if tick % 500 == 499:
            spreads.append(np.trace(world.state(tick * 20 * MS).robot.covariance))
    assert all(later > earlier for earlier, later in pairwise(spreads))


def test_delay_of_features_is_taken_into_account_when_the_robot_turns_fast() -> None:
    """At 0.8 rad/s an 80 ms old picture used as a new one would err by 3.7 degrees."""
    simulation = Simulation(
        lambda time, pose: (0.0, 0.0, 0.8),
        10.0,
        Pose2D(0.5, 0.0, 0.0),
        np.random.default_rng(3),
        Errors(heading_drift=0.0, odometry_scale=1.0),
        head_pan=lambda time: 0.0,
    )
    world = WorldModel(WorldModelParameters(), FIELD, simulation.start)
    errors = []
    for moment in simulation.run():
        world.add_odometry(moment.odometry)
        if moment.features is not None:
            world.add_features(moment.features)
        errors.append(math.remainder(world.state(moment.stamp).robot.pose.yaw - moment.pose.yaw, 2.0 * math.pi))
    assert abs(np.mean(errors[100:])) < math.radians(0.7)
    assert np.sqrt(np.mean(np.square(errors[100:]))) < math.radians(1.2)


def test_same_inputs_give_the_same_world_bit_for_bit() -> None:
    poses = []
    for _ in range(2):
        simulation = Simulation(
            lambda time, pose: (0.2, 0.0, 0.1), 4.0, Pose2D(-1.0, 0.0, 0.0), np.random.default_rng(9)
        )
        world = WorldModel(WorldModelParameters(), FIELD, simulation.start)
        for moment in simulation.run():
            world.add_odometry(moment.odometry)
            if moment.features is not None:
                world.add_features(moment.features)
        robot = world.state(moment.stamp).robot
        poses.append((robot.pose, robot.covariance.tobytes()))
    assert poses[0] == poses[1]


def test_history_interpolates_between_readings_across_the_wrap_of_the_heading() -> None:
    history = OdometryHistory(1.0)
    history.append(odometry(0, x=0.0, yaw=3.1))
    history.append(odometry(20 * MS, x=0.2, yaw=-3.1))
    middle = history.at(10 * MS)
    assert middle.pose.x == pytest.approx(0.1)
    assert abs(middle.pose.yaw) == pytest.approx(math.pi)
    assert middle.distance == pytest.approx(0.1)


def test_history_ignores_old_readings_and_forgets_what_is_too_long_ago() -> None:
    history = OdometryHistory(0.5)
    assert history.append(odometry(100 * MS))
    assert not history.append(odometry(100 * MS))
    assert not history.append(odometry(50 * MS))
    for tick in range(6, 100):
        history.append(odometry(tick * 20 * MS, x=0.1 * tick))
    assert history.at(0).stamp == 1460 * MS  # the first one before half a second ago
    assert history.at(10**12).stamp == 1980 * MS


def test_history_without_readings_says_so() -> None:
    with pytest.raises(LookupError, match="no odometry yet"):
        OdometryHistory(1.0).at(0)


def test_swaying_of_the_trunk_counts_as_no_path_but_a_walk_does() -> None:
    history = OdometryHistory(10.0)
    for tick in range(100):
        history.append(odometry((tick + 1) * 4 * MS, x=0.05 * math.sin(0.3 * tick)))
    for tick in range(100):
        history.append(odometry((tick + 101) * 4 * MS, x=0.01 * tick))
    assert increment(history.at(4 * MS), history.at(400 * MS)).distance == 0.0
    assert increment(history.at(400 * MS), history.at(800 * MS)).distance == pytest.approx(1.0, abs=0.2)


def test_swinging_of_the_trunk_counts_as_no_turning_but_a_turn_does() -> None:
    history = OdometryHistory(10.0)
    for tick in range(100):
        history.append(odometry((tick + 1) * 4 * MS, yaw=0.04 * math.sin(0.3 * tick)))
    for tick in range(100):
        history.append(odometry((tick + 101) * 4 * MS, yaw=-0.04 + 0.01 * tick))
    swung = increment(history.at(4 * MS), history.at(400 * MS))
    turned = increment(history.at(400 * MS), history.at(800 * MS))
    assert swung.turned == 0.0
    assert turned.turned == pytest.approx(1.0, abs=0.15)


def test_parameters_out_of_range_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match="greatest_delay"):
        WorldModelParameters(greatest_delay=0.0)
