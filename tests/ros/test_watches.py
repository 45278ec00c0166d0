"""What a node misses: its inputs, and a time that goes on."""

from __future__ import annotations

import pytest

from tulip_ros.finding import Finding, Level, say, worst
from tulip_ros.watches import GRACE, HOLD, InputWatch, StallWatch, TimeWatch

SECOND = 1_000_000_000
LOOK = 0.2


def camera(now: float = 0.0) -> InputWatch:
    return InputWatch("camera/image_raw", ("driver",), rate=10.0, missed_after=0.5, now=now)


def looks(watch: InputWatch, begin: float, end: float, pace: float = 1.0, comes: bool = False) -> Finding | None:
    """Look every 0.2 s of the wall clock, while the graph's time goes `pace` times as fast."""
    found, now = None, begin
    while now < end:
        if comes:
            watch.count += 1
        found = watch.look(now, round((1.0 + pace * now) * SECOND))
        now += LOOK
    return found


def test_an_input_that_comes_is_not_missed_and_one_that_stops_is_within_its_time_and_two_looks() -> None:
    watch = camera()
    assert looks(watch, 0.0, 3.0, comes=True) is None
    assert looks(watch, 3.0, 3.3) is None
    found = looks(watch, 3.4, 3.0 + 0.5 + 2 * LOOK)
    assert found is not None and found.level == Level.ERROR
    assert found.words.startswith("no camera/image_raw for ") and found.words.endswith("look after driver")
    assert looks(watch, 4.0, 4.1, comes=True) is None


def test_a_simulation_at_a_tenth_of_real_time_makes_pictures_rare_but_not_missing() -> None:
    watch = camera()
    looks(watch, 0.0, 0.1, pace=0.1, comes=True)
    assert looks(watch, 0.2, 4.0, pace=0.1) is None  # 0.4 s of the graph's time
    assert looks(watch, 4.0, 8.0, pace=0.1) is not None


def test_an_input_is_not_missed_while_time_stands_still_but_the_time_is() -> None:
    watch, time = camera(), TimeWatch(0.0)
    looks(watch, 0.0, 0.1, comes=True)
    assert looks(watch, 0.2, 9.0, pace=0.0) is None
    assert time.look(0.0, 5 * SECOND) is None
    assert time.look(1.0, 5 * SECOND) is None
    found = time.look(1.2, 5 * SECOND)
    assert found is not None and found.level == Level.WARNING and "time stands still for 1 s" in found.words
    assert time.look(1.4, 5 * SECOND + 1) is None


def test_an_input_that_never_came_is_a_warning_after_the_other_nodes_had_time_to_start() -> None:
    watch = camera()
    assert looks(watch, 0.0, GRACE) is None
    found = looks(watch, GRACE + LOOK, GRACE + 2 * LOOK)
    assert found == Finding(Level.WARNING, "no camera/image_raw has come yet: start driver")


def test_a_topic_on_events_is_never_missed() -> None:
    watch = InputWatch("game_state", ("game_input",), rate=0.0, missed_after=0.0, now=0.0)
    looks(watch, 0.0, 0.1, comes=True)
    assert looks(watch, 0.2, 100.0) is None


@pytest.mark.parametrize(("came", "too_slow"), [(10, False), (9, False), (7, True), (1, True)])
def test_messages_left_out_are_told_by_the_stamps_of_those_that_came(came: int, too_slow: bool) -> None:
    watch = camera()
    watch.count, watch.stamp = 1, SECOND
    assert watch.tally() is None  # nothing to compare with yet
    watch.count, watch.stamp = 1 + came, 2 * SECOND
    found = watch.tally()
    assert (found is not None) == too_slow
    if found is not None:
        assert found.words.startswith(f"takes {came} of 10 camera/image_raw")


def test_the_latency_is_the_mean_since_it_was_last_asked_for_and_none_without_messages() -> None:
    watch = camera()
    for delay in (0.010, 0.030):
        watch.served(delay)
    assert watch.latency() == pytest.approx(0.020)
    assert watch.latency() is None


def test_stamps_of_before_time_began_anew_are_not_compared() -> None:
    watch = camera()
    watch.count, watch.stamp = 1, 100 * SECOND
    watch.tally()
    watch.begin_anew()
    watch.count, watch.stamp = 2, SECOND
    assert watch.tally() is None


@pytest.mark.parametrize(("to", "words"), [(2.0, "back by 8.0 s"), (30.0, "forward by 20.0 s")])
def test_a_jump_of_the_clock_is_told_for_some_seconds(to: float, words: str) -> None:
    watch = TimeWatch(0.0)
    watch.look(0.0, 10 * SECOND)
    found = watch.look(0.2, round(to * SECOND))
    assert found is not None and words in found.words and watch.jumps == 1
    assert watch.look(0.4, round((to + 0.2) * SECOND)) == found
    assert watch.look(HOLD + 0.4, round((to + 0.4) * SECOND)) is None


def test_a_simulation_that_runs_ten_times_as_fast_does_not_jump() -> None:
    watch = TimeWatch(0.0)
    for look in range(1, 50):
        assert watch.look(look * LOOK, round(10 * look * LOOK * SECOND)) is None
    assert watch.jumps == 0


def test_time_that_has_not_begun_is_waited_for_and_then_a_warning() -> None:
    watch = TimeWatch(0.0)
    assert watch.look(1.0, 0) == Finding(Level.OK, "waits for time to begin")
    found = watch.look(GRACE + 1.0, 0)
    assert found is not None and found.level == Level.WARNING and "start a driver" in found.words


def test_the_worst_is_said_first_and_what_is_well_only_when_nothing_is_wrong() -> None:
    well, slow, blind = Finding(Level.OK, "well"), Finding(Level.WARNING, "slow"), Finding(Level.ERROR, "blind")
    assert (worst([]), say([])) == (Level.OK, "")
    assert say([well]) == "well"
    assert (worst([well, slow, blind]), say([well, slow, blind])) == (Level.ERROR, "blind; slow")


def test_a_node_that_hears_nobody_since_it_was_held_up_says_so_until_a_message_comes() -> None:
    watch = StallWatch(0.0)
    assert watch.look(0.2, 50) is None
    assert watch.look(3.4, 50) is None  # held up
    assert [watch.look(3.4 + 0.2 * step, 50) for step in range(1, 25)] == [None] * 24
    found = watch.look(8.6, 50)
    assert found is not None and found.words == "hears nobody since it was held up for 3 s: start it again"
    assert watch.look(8.8, 51) is None
    assert watch.look(9.0, 51) is None


def test_a_node_that_was_held_up_and_hears_again_or_never_heard_anybody_is_no_matter() -> None:
    watch, first = StallWatch(0.0), StallWatch(0.0)
    assert watch.look(0.2, 50) is None
    looks = [(3.4, 50), (3.6, 60), *((4.0 + 0.2 * step, 60) for step in range(50))]
    assert [watch.look(*look) for look in looks] == [None] * 52
    assert [first.look(now, 0) for now in (0.2, 3.4, *(3.6 + 0.2 * step for step in range(40)))] == [None] * 42
