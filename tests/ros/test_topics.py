"""The graph as declared."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest
from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy

from tulip_ros import topics
from tulip_ros.nodes import DRIVERS, NODES, ROBOT
from tulip_ros.run import session
from tulip_sim.timing import CAMERA_TICKS, DECISION_TICKS, SLOW_TICKS, TICK

NAME = re.compile(r"[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*)*")


def test_names_are_relative_and_unique():
    names = [topic.name for topic in topics.TOPICS] + [service.name for service in topics.SERVICES]
    assert len(set(names)) == len(names)
    assert [name for name in names if not NAME.fullmatch(name)] == ["/clock"]


def test_every_constant_is_in_the_list():
    declared = {value.name for value in vars(topics).values() if isinstance(value, topics.Topic)}
    assert declared == {topic.name for topic in topics.TOPICS}
    served = {value.name for value in vars(topics).values() if isinstance(value, topics.Service)}
    assert served == {service.name for service in topics.SERVICES}


def test_publishers_and_subscribers_are_nodes():
    known = {*NODES, *(entry.name for entry in DRIVERS.values())}
    for topic in topics.TOPICS:
        assert set(topic.publishers) | set(topic.subscribers) <= known, topic.name
    assert {service.server for service in topics.SERVICES} <= known
    assert {*ROBOT, "driver"} == set(topics.ALL_NODES)


def test_no_playing_node_listens_to_the_ground_truth():
    listeners = {name for name, entry in NODES.items() if entry.playing} & set(topics.GROUND_TRUTH.subscribers)
    assert listeners == set()
    assert topics.GROUND_TRUTH.publishers == ("driver",)


def test_every_playing_node_hears_and_says_something():
    for name in ROBOT:
        said = {topic.name for topic in topics.published_by(name)} - {"diagnostics"}
        assert said, name
    hearing = {name for name in ROBOT if {topic.name for topic in topics.heard_by(name)} - {"/clock"}}
    assert hearing == set(ROBOT)


def test_an_input_that_is_missed_comes_several_times_before_that() -> None:
    for topic in topics.TOPICS:
        assert topic.missed_after == 0.0 or topic.missed_after * topic.rate > 5.0, topic.name
        assert topic.rate >= 0.0 and topic.missed_after >= 0.0


def test_rates_are_those_of_the_simulation() -> None:
    ticks = 1000 / TICK
    assert topics.JOINT_STATES.rate == topics.LEG_COMMAND.rate == ticks
    assert topics.ODOMETRY.rate == topics.CLOCK.rate == topics.GROUND_TRUTH.rate == ticks / SLOW_TICKS
    assert topics.WORLD_STATE.rate == topics.WALK_COMMAND.rate == ticks / DECISION_TICKS
    assert topics.CAMERA_IMAGE.rate == topics.FEATURES.rate == pytest.approx(ticks / CAMERA_TICKS, rel=0.01)


def test_table_has_a_line_for_each_topic_and_service():
    table = topics.markdown_tables()
    for each in (*topics.TOPICS, *topics.SERVICES):
        assert table.count(f"| `{each.name}` | {each.type_name} |") == 1


def test_latched_profile_keeps_the_last_message_for_late_listeners():
    profile = topics.LATCHED.profile()
    assert (profile.depth, profile.durability.name, profile.reliability.name) == (1, "TRANSIENT_LOCAL", "RELIABLE")
    assert topics.CONTROL.profile().durability.name == "VOLATILE"


def test_no_playing_nodes_program_mentions_the_ground_truth():
    for name in ROBOT:
        spec = importlib.util.find_spec(NODES[name].module)
        assert spec is not None and spec.origin is not None, f"node {name} has no module {NODES[name].module}"
        assert "ground_truth" not in Path(spec.origin).read_text().lower(), name


def test_who_only_looks_has_nothing_repeated_for_it_but_what_is_latched(ros_domain: int) -> None:
    with session(lambda: Node("viewer"), arguments=[]) as (node, _):
        found = {}
        for topic in (topics.JOINT_STATES, topics.GAME_STATE):
            for only_looks in (False, True):
                ear = topic.subscribe_from(node, lambda _: None, only_looks=only_looks)
                (profile,) = [each.qos_profile for each in node.get_subscriptions_info_by_topic(topic.name)]
                found[topic.name, only_looks] = profile.reliability
                node.destroy_subscription(ear)
    reliable, best_effort = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
    assert found == {
        (topics.JOINT_STATES.name, False): reliable,
        (topics.JOINT_STATES.name, True): best_effort,
        (topics.GAME_STATE.name, False): reliable,
        (topics.GAME_STATE.name, True): reliable,
    }
