"""One state out of many."""

from __future__ import annotations

from tulip_ros.aggregation import STALE_AFTER, STARTING, Aggregation, Report
from tulip_ros.finding import Level

ORDER = ("driver", "vision", "worldmodel", "motion")
WELL = Report(Level.OK, "running")
SLOW = Report(Level.WARNING, "takes 9 of 16 pictures")
BLIND = Report(Level.ERROR, "no features for 4.0 s: look after vision")


def heard(expected: tuple[str, ...] = (), **reports: Report) -> Aggregation:
    aggregation = Aggregation(ORDER, expected, 0.0)
    for name, report in reports.items():
        aggregation.hear(name, report, 0.0)
    return aggregation


def test_all_well_is_one_word_and_the_nodes_come_in_the_order_of_the_data_flow() -> None:
    aggregation = heard(motion=WELL, recorder=WELL, vision=WELL, driver=WELL)
    assert aggregation.summary(1.0) == Report(Level.OK, "all nodes are well")
    assert list(aggregation.reports(1.0)) == ["driver", "vision", "motion", "recorder"]


def test_the_worst_node_gives_level_and_sentence_and_of_equals_the_first_in_the_data_flow() -> None:
    aggregation = heard(motion=BLIND, vision=SLOW, worldmodel=BLIND, driver=WELL)
    assert aggregation.summary(1.0) == Report(Level.ERROR, f"worldmodel: {BLIND.words} (and 2 more)")


def test_a_node_without_a_report_for_three_seconds_is_stale_and_comes_before_those_that_miss_it() -> None:
    aggregation = heard(vision=WELL)
    aggregation.hear("worldmodel", BLIND, 4.0)
    assert aggregation.reports(STALE_AFTER - 0.1)["vision"].level == Level.OK
    assert aggregation.reports(4.0)["vision"].level == Level.STALE
    whole = aggregation.summary(4.0)
    assert whole.level == Level.ERROR  # not all are stale
    assert whole.words.startswith("vision: says nothing for 4 s") and whole.words.endswith("(and 1 more)")


def test_when_all_are_stale_the_whole_is() -> None:
    assert heard(vision=WELL, motion=WELL).summary(10.0).level == Level.STALE


def test_an_expected_node_may_start_for_some_seconds_and_is_then_told_as_never_heard() -> None:
    aggregation = heard(("driver", "motion"), driver=WELL)
    assert aggregation.summary(1.0) == Report(Level.OK, "waits for motion")
    aggregation.hear("driver", WELL, STARTING)
    whole = aggregation.summary(STARTING)
    assert whole.level == Level.ERROR and whole.words.startswith("motion: was never heard: start it")


def test_a_tool_that_ends_is_forgotten_unless_it_was_expected() -> None:
    aggregation = heard(("recorder",), launcher=WELL, recorder=WELL)
    assert set(aggregation.reports(10.0)) == {"recorder"}


def test_a_robots_node_in_a_namespace_is_looked_after_and_placed_as_without_it() -> None:
    aggregation = Aggregation(ORDER, (), 0.0)
    for name in ("striker/motion", "keeper/vision", "striker/vision"):
        aggregation.hear(name, WELL, 0.0)
    assert list(aggregation.reports(10.0)) == ["keeper/vision", "striker/vision", "striker/motion"]


def test_without_any_node_somebody_is_told_so() -> None:
    assert heard().summary(1.0).level == Level.STALE
