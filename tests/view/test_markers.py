"""Markers for RViz: where they lie, and the tree of frames that they stand in."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from xml.etree import ElementTree

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from tulip_description import frames
from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import JOINTS, load_robot
from tulip_description.urdf import build_urdf
from tulip_motion.interface import Odometry
from tulip_motion.messages import body_transforms
from tulip_msgs.msg import Feature, Features, MotionState, ObjectEstimate, WorldState
from tulip_ros import topics
from tulip_ros.run import session
from tulip_view.markers import feature_markers, field_markers, motion_markers, world_markers
from tulip_view.markers_node import MarkersNode
from tulip_worldmodel.messages import map_to_odom_message
from tulip_worldmodel.world_state import RobotEstimate
from tulip_worldmodel.world_state import WorldState as World

WAIT = 30.0  # [s] of wall-clock time for things that take one
FIELD, ROBOT = load_field(), load_robot()


def points(marker: Marker) -> np.ndarray:
    return np.array([[each.x, each.y, each.z] for each in marker.points])


def named(markers: list[Marker], name: str, index: int = 0) -> Marker:
    return next(each for each in markers if (each.ns, each.id) == (name, index))


def check(markers: list[Marker], frame: str) -> None:
    """RViz refuses a marker without a size or with a turn that is none, and one of two with the same name."""
    assert len({(each.ns, each.id) for each in markers}) == len(markers)
    for each in markers:
        assert each.header.frame_id == frame
        turn = each.pose.orientation
        assert math.hypot(turn.x, turn.y, turn.z, turn.w) == pytest.approx(1.0)
        assert each.scale.x > 0.0 and each.color.a > 0.0
        assert np.isfinite(points(each)).all()


def test_field_lines_end_at_the_corners_of_the_field() -> None:
    markers = field_markers(FIELD)
    check(markers, frames.MAP)
    reach = np.abs(points(named(markers, "field"))).max(axis=0)
    np.testing.assert_allclose(reach, [FIELD.length / 2.0, FIELD.width / 2.0, 0.0])
    assert len([each for each in markers if each.ns == "goals and poles"]) == 4 + len(FIELD.poles)


def test_a_rolling_ball_is_drawn_in_the_map_with_the_way_that_it_will_roll() -> None:
    world = WorldState(robot_pose=[1.0, 2.0, math.pi / 2.0], robot_covariance=np.diag([0.01, 0.04, 0.1]).ravel())
    world.ball_known = True
    world.ball = ObjectEstimate(position=[2.0, 0.0], position_in_map=[1.0, 4.0], covariance=(0.01 * np.eye(4)).ravel())
    world.ball_rest, world.ball_rest_after = [3.0, 0.5], 2.0
    markers = world_markers(world, FIELD.ball_radius)
    check(markers, frames.MAP)
    ball = named(markers, "ball").pose.position
    assert (ball.x, ball.y, ball.z) == (1.0, 4.0, FIELD.ball_radius)
    way = points(named(markers, "ball", 2))
    np.testing.assert_allclose(way, [[1.0, 4.0, 0.0], [0.5, 5.0, 0.0]], atol=1e-12)  # 3 m ahead is +y of the map
    ellipse = points(named(markers, "robot", 1))
    assert np.ptp(ellipse[:, 0]) == pytest.approx(4 * 0.1) and np.ptp(ellipse[:, 1]) == pytest.approx(4 * 0.2)


def test_without_a_ball_none_is_drawn() -> None:
    assert {each.ns for each in world_markers(WorldState(), FIELD.ball_radius)} == {"robot"}


def test_soles_are_outlined_where_they_stand_and_a_zmp_without_contact_is_left_out() -> None:
    state = MotionState(zmp=[math.nan, math.nan], com=[0.1, 0.2, 0.8])
    sole = np.eye(4)
    sole[:3, 3] = (0.5, 0.1, 0.03)
    state.left_sole, state.right_sole = sole.ravel(), np.eye(4).ravel()
    markers = motion_markers(state, ROBOT.feet)
    check(markers, frames.ODOM)
    outline, foot = points(named(markers, "soles")), ROBOT.feet[0]
    np.testing.assert_allclose(outline.min(axis=0), [0.5 + foot.x[0], 0.1 + foot.y[0], 0.03])
    np.testing.assert_allclose(outline.max(axis=0), [0.5 + foot.x[1], 0.1 + foot.y[1], 0.03])
    np.testing.assert_allclose(points(named(markers, "CoM")), [[0.1, 0.2, 0.0]])
    assert [each.id for each in markers if each.ns == "ZMP"] == [1]  # the wanted one


def test_a_feature_is_drawn_where_its_ray_meets_the_ground_and_one_above_the_horizon_is_not() -> None:
    features = Features(camera_position=[0.0, 0.0, 1.0])
    down = Feature(kind=Feature.BALL, azimuth=math.pi / 2.0, elevation=-math.pi / 4.0, end_elevation=math.nan)
    up = Feature(kind=Feature.GOAL_POST, azimuth=0.0, elevation=0.1, end_elevation=math.nan)
    line = Feature(kind=Feature.LINE, elevation=-math.pi / 4.0, end_azimuth=math.pi, end_elevation=-math.pi / 4.0)
    features.features = [down, up, line]
    markers = feature_markers(features)
    check(markers, frames.BASE_FOOTPRINT)
    assert {each.ns for each in markers} == {"seen ball", "seen lines"}
    np.testing.assert_allclose(points(named(markers, "seen ball")), [[0.0, 1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(points(named(markers, "seen lines")), [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], atol=1e-12)


def test_what_the_nodes_publish_and_the_urdf_make_one_tree_from_map_with_every_frame_once() -> None:
    """RViz needs one way from map to each link; robot_state_publisher gives those of the URDF by joint_states."""
    odometry = Odometry(
        0,
        np.array([0.0, 0.0, 0.8]),
        np.array([0.0, 0.0, 0.0, 1.0]),
        np.zeros(3),
        np.zeros(3),
        0.0,
        np.eye(6),
        np.eye(6),
    )
    world = World(0, RobotEstimate(Pose2D(1.0, 2.0, 0.3), np.eye(3), Pose2D(0.5, 0.0, 0.0)), None, ())
    sent = [*map_to_odom_message(world).transforms, *body_transforms(odometry).transforms]
    edges = [(each.header.frame_id, each.child_frame_id) for each in sent]
    urdf = ElementTree.fromstring(build_urdf(ROBOT).encode())
    moving = []
    for joint in urdf.iter("joint"):
        edges.append((joint.find("parent").get("link"), joint.find("child").get("link")))
        moving += [joint.get("name")] if joint.get("type") == "revolute" else []
    parent = {child: above for above, child in edges}
    assert len(parent) == len(edges)  # nobody has two parents
    links = {link.get("name") for link in urdf.iter("link")}
    mounts = {frames.LEFT_SOLE, frames.RIGHT_SOLE, frames.IMU, frames.CAMERA, frames.CAMERA_OPTICAL}
    assert set(parent) == {frames.ODOM, frames.BASE_FOOTPRINT} | links and mounts < links
    for frame in parent:
        for _ in range(len(parent)):
            frame = parent.get(frame, frame)
        assert frame == frames.MAP
    assert sorted(moving) == sorted(JOINTS)  # those that joint_states names


@pytest.mark.ros
def test_the_node_listens_and_draws_only_while_somebody_looks(ros_domain: int) -> None:
    drawn: list[str] = []
    with session(MarkersNode, ["test"], handle_signals=False) as (node, spin):

        def until(holds: Callable[[], object]) -> None:
            end = time.monotonic() + WAIT
            while not holds():
                assert time.monotonic() < end, "it did not come to hold"
                world.publish(WorldState())
                spin(0.05)

        def ears() -> int:
            return int(node.count_subscribers("world_state"))

        world = topics.WORLD_STATE.publish_from(node)
        for _ in range(20):
            spin(0.05)
        assert ears() == 0
        viewer = topics.MARKERS.subscribe_from(node, lambda message: drawn.extend(each.ns for each in message.markers))
        until(lambda: {"field", "robot"} <= set(drawn))
        assert ears() == 1
        node.destroy_subscription(viewer)
        until(lambda: ears() == 0)
