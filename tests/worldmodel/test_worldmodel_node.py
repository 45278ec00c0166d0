from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, replace

import numpy as np
import pytest
from nav_msgs.msg import Odometry as OdometryMessage
from walk_simulation import CAMERA, Simulation

from tulip_description.planar import Pose2D
from tulip_motion.messages import odometry_to_message
from tulip_msgs.msg import Features as FeaturesMessage
from tulip_ros import topics
from tulip_ros.keepsake import VARIABLE, Keepsake, Memory
from tulip_ros.run import session
from tulip_ros.time import from_message, stamp_of
from tulip_strategy.messages import world_state_from_message
from tulip_vision.features import Feature, FeatureClass
from tulip_vision.messages import features_to_message
from tulip_worldmodel.messages import (
    features_from_message,
    map_to_odom_message,
    robot_pose_to_message,
    start_pose_from_message,
    start_pose_to_message,
    world_state_to_message,
)
from tulip_worldmodel.world_model import WorldModel, WorldModelParameters
from tulip_worldmodel.world_state import WorldState
from tulip_worldmodel.worldmodel_node import WorldModelNode

pytestmark = pytest.mark.ros


def simulated(seconds: float = 2.0) -> tuple[list[OdometryMessage | FeaturesMessage], WorldState]:
    """Return messages of a walk towards ball and keeper, and the world at its end."""
    ball = (np.array([0.5, 0.1]), np.zeros(2))
    simulation = Simulation(
        lambda time, pose: (0.2, 0.0, 0.1),
        seconds,
        Pose2D(-1.5, 0.0, 0.0),
        np.random.default_rng(1),
        ball=lambda time: ball,
        opponent=lambda time: np.array([2.0, 0.5]),
        head_pan=lambda time: 0.0,
    )
    world = WorldModel(WorldModelParameters(), simulation.arena, simulation.start)
    messages: list[OdometryMessage | FeaturesMessage] = []
    for moment in simulation.run():
        world.add_odometry(moment.odometry)
        messages.append(odometry_to_message(moment.odometry))
        if moment.features is not None:
            world.add_features(moment.features)
            messages.append(features_to_message(moment.features))
    return messages, world.state(moment.stamp)


def same(first: object, second: object) -> bool:
    """Tell whether two dataclass objects agree to rounding; arrays and nested objects included."""
    if hasattr(first, "__dataclass_fields__"):
        return all(same(getattr(first, name), getattr(second, name)) for name in first.__dataclass_fields__)
    if isinstance(first, tuple):
        return len(first) == len(second) and all(same(a, b) for a, b in zip(first, second, strict=True))
    if first is None or second is None:
        return first is second
    return np.allclose(np.asarray(first, dtype=float), np.asarray(second, dtype=float), equal_nan=True)


def test_features_survive_the_way_through_a_message() -> None:
    simulation = Simulation(lambda time, pose: (0.0, 0.0, 0.0), 0.5, Pose2D(), np.random.default_rng(0))
    pictures = [moment.features for moment in simulation.run() if moment.features is not None]
    assert sum(len(picture.features) for picture in pictures) > 5
    assert all(same(features_from_message(features_to_message(picture)), picture) for picture in pictures)
    of_all_fields = Feature(FeatureClass.GOAL, 0.1, -0.2, 0.01, 0.02, 0.5, 0.3, -0.4, 0.05, side=-1)
    values = [getattr(of_all_fields, field.name) for field in fields(Feature)]
    assert len(set(values)) == len(values)  # none that another could be taken for
    assert all(
        field.default is MISSING or value != field.default for field, value in zip(fields(Feature), values, strict=True)
    )
    picture = replace(pictures[0], features=(of_all_fields,))
    assert same(features_from_message(features_to_message(picture)), picture)


def test_world_state_survives_the_way_through_a_message_with_and_without_ball() -> None:
    _, world = simulated()
    assert world.ball is not None and len(world.opponents) == 1
    for state in (world, replace(world, ball=None, opponents=())):
        assert same(world_state_from_message(world_state_to_message(state)), state)


def test_transform_of_odom_and_standard_pose_agree_with_the_estimate() -> None:
    _, world = simulated()
    transform = map_to_odom_message(world).transforms[0]
    turn = transform.transform.rotation
    odom = Pose2D(
        transform.transform.translation.x, transform.transform.translation.y, 2.0 * math.atan2(turn.z, turn.w)
    )
    assert same(odom @ world.robot.pose_in_odom, world.robot.pose)
    assert (transform.header.frame_id, transform.child_frame_id) == ("map", "odom")
    pose = robot_pose_to_message(world).pose
    assert pose.pose.position.x == world.robot.pose.x
    assert np.array(pose.covariance).reshape(6, 6)[0, 5] == world.robot.covariance[0, 2]


def collect(node: WorldModelNode, spin: Callable[[float], None], messages: list) -> dict[str, list]:
    """Send messages through the graph one by one and return what the node published."""
    received: dict[str, list] = {"world_state": [], "robot_pose": [], "tf": []}
    watched = {"world_state": topics.WORLD_STATE, "robot_pose": topics.ROBOT_POSE, "tf": topics.TF}
    for name, topic in watched.items():
        topic.subscribe_from(node, received[name].append)
    odometry, features = topics.ODOMETRY.publish_from(node), topics.FEATURES.publish_from(node)
    for message in messages:
        sender = odometry if isinstance(message, OdometryMessage) else features
        expected = len(received["world_state"]) + 1
        sender.publish(message)
        for _ in range(200):
            spin(0.05)
            if len(received["world_state"]) >= expected:
                break
    for _ in range(20):
        spin(0.01)
    return received


def test_node_publishes_the_state_of_the_core_with_each_input(ros_domain: int) -> None:
    messages, world = simulated(1.0)
    with session(WorldModelNode, arguments=["test"]) as (node, spin):
        received = collect(node, spin, messages)
    assert len(received["world_state"]) == len(received["robot_pose"]) == len(received["tf"]) == len(messages)
    pictures = [stamp_of(message) for message in messages if isinstance(message, FeaturesMessage)]
    told = [from_message(message.picture) for message in received["world_state"]]
    assert sorted(set(told) - {0}) == pictures  # each as soon as its features have come
    last = received["world_state"][-1]
    assert stamp_of(last) == world.stamp
    assert last.robot_pose == pytest.approx(world.robot.pose.as_array(), abs=0.05)
    assert last.ball_known
    assert last.ball.position == pytest.approx(world.ball.position, abs=0.1)


def test_node_begins_anew_when_time_goes_back(ros_domain: int) -> None:
    messages, _ = simulated(1.0)
    still = Simulation(lambda time, pose: (0.0, 0.0, 0.0), 0.1, Pose2D(), np.random.default_rng(0))
    anew = [replace(moment.odometry, stamp=moment.stamp - 10**9) for moment in still.run()]
    later = []
    for message in messages:
        message.header.stamp.sec += 50
        later.append(message)
    with session(WorldModelNode, arguments=["test"]) as (node, spin):
        received = collect(node, spin, [*later, *(odometry_to_message(odometry) for odometry in anew)])
    last = received["world_state"][-1]
    assert stamp_of(last) == anew[-1].stamp
    assert last.robot_pose == pytest.approx([-1.5, 0.0, 0.0], abs=0.01)
    assert not last.ball_known


def test_camera_of_the_simulation_is_as_high_as_that_of_the_standing_robot() -> None:
    from tulip_description.camera_pose import camera_in_footprint
    from tulip_description.posture import standing_posture
    from tulip_description.robot import load_robot

    robot = load_robot()
    transform = camera_in_footprint(robot, standing_posture(robot).base_height, (0.0, 0.0, 0.0, 1.0), 0.0, 0.4)
    assert transform[2, 3] == pytest.approx(CAMERA[2], abs=0.05)


@pytest.mark.parametrize(
    ("x", "w"), [(math.nan, 1.0), (math.inf, 1.0), (1e9, 1.0), (0.0, math.nan), (0.0, 1e200), (0.0, 0.0), (0.0, 1e-300)]
)
def test_a_start_pose_that_is_none_is_refused(x: float, w: float) -> None:
    message = start_pose_to_message(Pose2D(1.0, 2.0, 0.5), 0)
    assert start_pose_from_message(message) == pytest.approx(Pose2D(1.0, 2.0, 0.5))
    message.pose.pose.position.x = x
    turn = message.pose.pose.orientation
    turn.z, turn.w = turn.z * w, turn.w * w
    assert start_pose_from_message(message) is None


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let nodes leave each other what they know, as below a launcher."""
    memory = Memory("worldmodel")
    monkeypatch.setenv(VARIABLE, memory.path)
    yield
    memory.close()


def test_a_node_that_died_is_followed_by_one_that_knows_where_the_robot_has_come_to(
    ros_domain: int, kept: None
) -> None:
    odometry = [message for message in simulated()[0] if isinstance(message, OdometryMessage)]
    half, told = len(odometry) // 2, start_pose_to_message(Pose2D(1.0, 2.0, 0.5), 0)
    with session(WorldModelNode, ["test"], handle_signals=False) as (node, _):
        node._on_start_pose(told)
        for message in odometry[:half]:
            node._on_odometry(message)
        before = Keepsake().read()
    with session(WorldModelNode, ["test"], handle_signals=False) as (node, _):
        node._on_start_pose(told)  # latched; it was used long ago
        node._on_odometry(odometry[-1])  # some way on
        after = node._world.state(stamp_of(odometry[-1])).robot
    way = Pose2D(*before["odom"]).inverse() @ after.pose_in_odom
    expected = Pose2D(*before["map"]) @ way
    assert math.hypot(way.x, way.y) > 0.05
    np.testing.assert_allclose(after.pose.as_array(), expected.as_array(), atol=1e-3)
    with session(WorldModelNode, ["test"], handle_signals=False) as (node, _):
        node._on_odometry(odometry[-1])
        node._on_start_pose(told)  # now after the first odometry
        after = node._world.state(stamp_of(odometry[-1])).robot
        np.testing.assert_allclose(after.pose.as_array(), expected.as_array(), atol=1e-3)


def test_a_node_that_died_is_followed_by_one_that_obeys_people_and_a_time_that_began_anew(
    ros_domain: int, kept: None
) -> None:
    odometry = [message for message in simulated()[0] if isinstance(message, OdometryMessage)]
    last = stamp_of(odometry[-1])
    told, elsewhere = start_pose_to_message(Pose2D(1.0, 2.0, 0.5), 0), Pose2D(-3.0, -2.0, 1.0)

    def place(node: WorldModelNode, message: OdometryMessage) -> np.ndarray:
        node._on_odometry(message)
        return node._world.state(stamp_of(message)).robot.pose.as_array()

    def run(*events: Callable[[WorldModelNode], object]) -> np.ndarray:
        """Let a node live and die; return where it believes the robot to be in the end."""
        with session(WorldModelNode, ["test"], handle_signals=False) as (node, _):
            for event in events:
                result = event(node)
        return np.asarray(result)

    run(lambda node: node._on_start_pose(told), lambda node: place(node, odometry[-2]))
    set_down = run(
        lambda node: node._on_start_pose(told),  # latched
        lambda node: place(node, odometry[-2]),
        lambda node: node._on_start_pose(start_pose_to_message(elsewhere, last)),
        lambda node: place(node, odometry[-1]),
    )
    np.testing.assert_allclose(set_down, elsewhere.as_array(), atol=1e-3)
    while_dead = run(
        lambda node: node._on_start_pose(start_pose_to_message(Pose2D(1.0, 2.0, 0.5), last + 1)),
        lambda node: place(node, odometry[-1]),
    )
    np.testing.assert_allclose(while_dead, [1.0, 2.0, 0.5], atol=1e-3)
    anew = run(
        lambda node: place(node, odometry[0]),  # older than what the node before has kept
        lambda node: node._on_start_pose(start_pose_to_message(elsewhere, stamp_of(odometry[0]))),
        lambda node: place(node, odometry[1]),
    )
    np.testing.assert_allclose(anew, elsewhere.as_array(), atol=1e-2)
    node_told_before = run(
        lambda node: node._on_start_pose(start_pose_to_message(elsewhere, stamp_of(odometry[0]))),  # latched
        lambda node: setattr(node, "_before", node._before | {"stamp": 10**15}),  # of the time before another beginning
        lambda node: place(node, odometry[0]),
    )
    np.testing.assert_allclose(node_told_before, elsewhere.as_array(), atol=1e-2)
