"""Node perception: a thin layer over the core, and the plan that puts it in the place of vision."""

from __future__ import annotations

import time

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from tulip_description import frames
from tulip_description.field import load_field
from tulip_description.robot import JOINTS
from tulip_description.short_numbers import fixed_point
from tulip_msgs.msg import Features
from tulip_ros import topics
from tulip_ros.run import session
from tulip_ros.time import header, stamp_of
from tulip_sim.match_graph import trial_plan
from tulip_sim.messages import truth_from_message, truth_to_message
from tulip_sim.parameters import WorldParameters
from tulip_sim.perception import PerceptionParameters
from tulip_sim.perception_node import PerceptionNode
from tulip_sim.referee import Referee, RefereeParameters
from tulip_sim.scenario import make_scenario
from tulip_sim.world import World
from tulip_vision.features import FeatureClass

pytestmark = pytest.mark.ros

STEP = 20_000_000  # [ns]


@pytest.fixture(scope="module")
def world() -> World:
    world = World(make_scenario("open", np.random.default_rng(0), load_field()), WorldParameters.exact(), 0)
    world.advance(20)
    return world


def test_truth_survives_the_way_through_a_message(world: World) -> None:
    truth = world.truth()
    again = truth_from_message(
        truth_to_message(truth, Referee(RefereeParameters(), world.field).verdict()), truth.poles
    )
    assert again.stamp == truth.stamp
    for name in ("base_position", "base_orientation", "joint_positions", "ball_position"):
        assert np.array_equal(getattr(again, name), fixed_point(getattr(truth, name))), name
    assert again.footprint.as_array() == pytest.approx(truth.footprint.as_array(), abs=1e-4)


def test_node_turns_the_truth_into_features_with_the_pose_of_odometry(world: World, ros_domain: int) -> None:
    truth = world.truth()
    found: list[Features] = []
    with session(PerceptionNode, arguments=["test"]) as (node, spin):
        topics.FEATURES.subscribe_from(node, found.append)
        bodies, heads = topics.ODOMETRY.publish_from(node), topics.JOINT_STATES.publish_from(node)
        truths = topics.GROUND_TRUTH.publish_from(node)
        message = truth_to_message(truth, Referee(RefereeParameters(), world.field).verdict())
        begin = stamp_of(message)
        truths.publish(message)
        end = time.monotonic() + 10.0
        while not node._waiting and time.monotonic() < end:
            spin(0.02)
        for stamp in range(begin - STEP, begin + 5 * STEP, STEP):
            body = Odometry(header=header(stamp, frames.ODOM))
            body.pose.pose.position.z = float(truth.base_position[2])
            body.pose.pose.orientation.w = 1.0
            bodies.publish(body)
            spin(0.02)
            heads.publish(JointState(header=header(stamp), name=list(JOINTS), position=truth.joint_positions.tolist()))
            spin(0.02)
        while not found and time.monotonic() < end:
            spin(0.02)
    assert [stamp_of(each) for each in found] == [begin]
    assert FeatureClass.LINE in {FeatureClass(each.kind) for each in found[0].features}


def test_plan_with_perception_has_no_vision_and_no_pictures() -> None:
    plan = {start.name: start for start in trial_plan(1, perception=PerceptionParameters())}
    assert "vision" not in plan
    assert not plan["perception"].entry.playing
    assert plan["driver"].parameters["camera"] is False
    assert "perception" not in {start.name for start in trial_plan(1)}
