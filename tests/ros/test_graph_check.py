"""What the doctor makes of facts about a graph."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tulip_ros import topics
from tulip_ros.aggregation import Report
from tulip_ros.finding import Level
from tulip_ros.graph_check import Diagnosis, Endpoint, GraphFacts, check
from tulip_ros.nodes import DRIVER, ROBOT

WELL = Report(Level.OK, "running", {"version": "1"})
NODES = tuple(f"/{name}" for name in (DRIVER, *ROBOT))


def ends(topic: topics.Topic, nodes: tuple[str, ...]) -> tuple[Endpoint, ...]:
    here = [f"/{name}" for name in nodes if f"/{name}" in NODES]
    return tuple(Endpoint(name, topic.type_name, True, topic.quality.latched) for name in here)


def full(topic: topics.Topic) -> str:
    return topic.name if topic.name.startswith("/") else f"/{topic.name}"


HEALTHY = GraphFacts(
    nodes=NODES,
    publishers={full(topic): ends(topic, topic.publishers) for topic in topics.TOPICS},
    subscribers={full(topic): ends(topic, topic.subscribers) for topic in topics.TOPICS},
    rates={full(topic): topic.rate for topic in topics.TOPICS if topic.rate},
    pace=1.0,
    reports=dict.fromkeys(NODES, WELL),
    version="1",
)


def wrong(facts: GraphFacts) -> list[Diagnosis]:
    return [each for each in check(facts) if each.level > Level.OK]


def only(facts: GraphFacts) -> Diagnosis:
    found = wrong(facts)
    assert len(found) == 1, found
    return found[0]


def within(facts: GraphFacts, space: str) -> GraphFacts:
    """Return the same robot in a namespace, with the clock and the driver outside."""

    def moved(name: str) -> str:
        return name if name in ("/clock", f"/{DRIVER}") else f"{space}{name}"

    def all_moved(table: dict[str, tuple[Endpoint, ...]]) -> dict[str, tuple[Endpoint, ...]]:
        return {
            moved(name): tuple(replace(end, node=moved(end.node)) for end in these) for name, these in table.items()
        }

    return replace(
        facts,
        nodes=tuple(moved(name) for name in facts.nodes),
        publishers=all_moved(dict(facts.publishers)),
        subscribers=all_moved(dict(facts.subscribers)),
        rates={moved(name): rate for name, rate in facts.rates.items()},
        reports={moved(name): report for name, report in facts.reports.items()},
    )


def test_a_healthy_graph_is_well_in_every_part() -> None:
    found = check(HEALTHY)
    assert wrong(HEALTHY) == []
    parts = [each.part for each in found]
    assert parts == ["nodes", "clock", "types", "quality of service", "rates", "diagnostics", "versions"]


def test_a_robot_in_a_namespace_whose_driver_serves_it_from_outside_is_as_well() -> None:
    assert wrong(within(HEALTHY, "/striker")) == []


def test_no_graph_at_all_is_no_fault() -> None:
    assert check(GraphFacts(())) == [Diagnosis(Level.OK, "nodes", "no robot runs here")]
    assert "/rviz" in check(GraphFacts(("/rviz",)))[0].words


def test_a_missing_node_is_named() -> None:
    facts = replace(HEALTHY, nodes=tuple(name for name in NODES if name != "/vision"))
    facts = replace(facts, reports={name: WELL for name in facts.nodes})
    assert only(facts).words.startswith("/vision is missing")


def test_perception_may_stand_in_for_vision() -> None:
    nodes = tuple("/perception" if name == "/vision" else name for name in NODES)
    assert wrong(replace(HEALTHY, nodes=nodes, reports=dict.fromkeys(nodes, WELL))) == []


def test_an_experiment_moves_the_body_alone() -> None:
    nodes = ("/driver", "/identify")
    publishers = {"/joint_states": HEALTHY.publishers["/joint_states"]}
    assert wrong(GraphFacts(nodes, publishers, {}, {}, None, dict.fromkeys(nodes, WELL), "1")) == []


def test_a_missing_driver_is_told_by_what_it_does_not_send() -> None:
    nodes = tuple(name for name in NODES if name != "/driver")
    publishers = {name: these for name, these in HEALTHY.publishers.items() if "driver" not in str(these)}
    facts = GraphFacts(nodes, publishers, {}, {}, None, dict.fromkeys(nodes, WELL), "1")
    assert only(facts).words == "/driver is missing, nobody sends joint_states: start a driver"


def test_two_drivers_of_one_name_and_their_clocks_are_named() -> None:
    clock = HEALTHY.publishers["/clock"]
    facts = replace(HEALTHY, nodes=(*NODES, "/driver"), publishers={**HEALTHY.publishers, "/clock": clock * 2})
    found = wrong(facts)
    assert [each.part for each in found] == ["nodes", "clock"]
    assert found[0].words.startswith("2 nodes are called /driver") and "2 senders of /clock" in found[1].words


def test_a_second_sender_of_a_command_is_named_and_one_of_diagnostics_is_not() -> None:
    stranger = Endpoint("/joystick", topics.WALK_COMMAND.type_name)
    publishers = {**HEALTHY.publishers, "/walk_command": (*HEALTHY.publishers["/walk_command"], stranger)}
    words = only(replace(HEALTHY, publishers=publishers)).words
    assert words == "/walk_command has 2 senders (/joystick, /strategy): end all but one"
    speaker = Endpoint("/joystick", topics.DIAGNOSTICS.type_name)
    publishers = {**HEALTHY.publishers, "/diagnostics": (*HEALTHY.publishers["/diagnostics"], speaker)}
    assert wrong(replace(HEALTHY, publishers=publishers)) == []


def test_a_wrong_type_is_named_with_the_one_expected_also_on_a_topic_that_is_not_ours() -> None:
    listener = Endpoint("/plotter", "std_msgs/msg/String")
    subscribers = {**HEALTHY.subscribers, "/odometry": (*HEALTHY.subscribers["/odometry"], listener)}
    words = only(replace(HEALTHY, subscribers=subscribers)).words
    assert words.startswith("/plotter uses /odometry as std_msgs/msg/String; expected nav_msgs/msg/Odometry")
    two = (Endpoint("/a", "x/msg/A"), Endpoint("/b", "x/msg/A"), Endpoint("/c", "x/msg/B"))
    words = only(replace(HEALTHY, publishers={**HEALTHY.publishers, "/own": two})).words
    assert words.startswith("/c uses /own as x/msg/B; expected x/msg/A")


@pytest.mark.parametrize(
    ("asks", "lacks"), [({"latched": True}, "transient local"), ({"reliable": True}, None), ({"reliable": False}, None)]
)
def test_a_subscription_that_asks_for_more_than_is_offered_is_named(asks: dict[str, bool], lacks: str | None) -> None:
    ear = Endpoint("/plotter", topics.ODOMETRY.type_name, **asks)
    subscribers = {**HEALTHY.subscribers, "/odometry": (*HEALTHY.subscribers["/odometry"], ear)}
    facts = replace(HEALTHY, subscribers=subscribers)
    if lacks is None:
        assert wrong(facts) == []
    else:
        assert f"/plotter gets nothing of /odometry: it asks /motion for {lacks}" in only(facts).words


def test_a_best_effort_publisher_does_not_fit_our_reliable_subscriptions() -> None:
    publishers = {**HEALTHY.publishers, "/imu": (Endpoint("/driver", topics.IMU.type_name, reliable=False),)}
    words = only(replace(HEALTHY, publishers=publishers)).words
    assert words.startswith("/motion gets nothing of /imu: it asks /driver for reliable")


@pytest.mark.parametrize(
    ("pace", "level"), [(0.0, Level.ERROR), (0.1, Level.WARNING), (0.5, Level.OK), (3.0, Level.OK)]
)
def test_the_clock_is_judged_by_how_fast_it_goes(pace: float, level: Level) -> None:
    rates = {name: rate * pace for name, rate in HEALTHY.rates.items()}
    found = [each for each in check(replace(HEALTHY, pace=pace, rates=rates)) if each.part == "clock"]
    assert [each.level for each in found] == [level]
    assert wrong(replace(HEALTHY, pace=pace, rates=rates)) == [each for each in found if each.level]


def test_rates_are_expected_in_the_graphs_time() -> None:
    rates = {**{name: 0.5 * rate for name, rate in HEALTHY.rates.items()}, "/features": 4.0}
    found = only(replace(HEALTHY, pace=0.5, rates=rates))
    assert found.level == Level.WARNING
    assert found.words == "/features comes 4.0 times a second, expected 7.8: look after /vision"


def test_the_worst_of_what_nodes_say_comes_first_and_a_node_that_says_nothing_hangs() -> None:
    reports = dict(HEALTHY.reports)
    del reports["/head"]
    reports["/vision"] = Report(Level.WARNING, "takes 9 of 16 pictures", WELL.values)
    reports["/motion"] = Report(Level.ERROR, "no imu for 0.4 s: look after driver", WELL.values)
    found = wrong(replace(HEALTHY, reports=reports))
    assert [(each.level, each.part) for each in found] == [
        (Level.ERROR, "/head"), (Level.ERROR, "/motion"), (Level.WARNING, "/vision"),
    ]  # fmt: skip
    assert "hangs" in found[0].words


def test_nodes_of_another_version_are_told() -> None:
    reports = {**HEALTHY.reports, "/motion": Report(Level.OK, "running", {"version": "0.9"})}
    found = only(replace(HEALTHY, reports=reports))
    assert found.words == "nodes of version 0.9 run, this is 1: start the graph again"
