"""What counts of the emergency stop, in whatever order words arrive."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.emergency_stop import GREATEST, EmergencyStop, StopWord

LATER = 10**6


def after(*words: StopWord) -> EmergencyStop:
    """Return what somebody knows who has heard these words."""
    stop = EmergencyStop()
    for word in words:
        stop.hear(word, now=LATER)
    return stop


def test_nobody_is_stopped_at_first_and_there_is_nothing_to_release():
    stop = EmergencyStop()
    assert not stop.engaged
    with pytest.raises(ValueError, match="no emergency stop holds: there is nothing to release"):
        stop.release("menu", now=1)


def test_a_stop_holds_until_it_is_released_whatever_is_repeated():
    menu = EmergencyStop()
    stop = menu.engage("menu", "key l", now=1)
    user_input = after(stop)
    released = user_input.release("user_input", now=2)
    driver = after(stop)
    for word in (stop, stop):
        assert not driver.hear(word, now=3)
    assert driver.engaged and str(driver.word) == "emergency stop by menu (key l)"
    assert driver.hear(released, now=3) and not driver.engaged
    assert not driver.hear(stop, now=4) and not driver.engaged


@given(st.integers(0, 10**9), st.integers(-(10**9), 10**9))
def test_words_count_in_the_order_in_which_they_were_said_however_clocks_differ(begin: int, off: int):
    """Two computers, one with its clock off by `off`, answer each other: all orders of arrival come to the same."""
    here, there = EmergencyStop(), EmergencyStop()
    words = [here.engage("menu", "", now=begin)]
    there.hear(words[-1], now=begin + off)
    words.append(there.release("user_input", now=begin + off + 1))
    here.hear(words[-1], now=begin + 2)
    words.append(here.engage("page", "", now=begin + 3))
    for order in permutations(words):
        assert after(*order).word == words[-1]


def test_somebody_who_has_heard_nothing_yet_can_stop_the_robot():
    stop = after()
    stop.engage("menu", "", now=100)
    stop.release("user_input", now=200)
    assert stop.hear(EmergencyStop().engage("page", "", now=300), now=301) and stop.engaged


@pytest.mark.parametrize("sequence", [0, GREATEST + 1, 2**64 - 1])
def test_of_somebody_who_cannot_count_a_stop_is_new_and_a_release_is_none(sequence: int):
    stop = EmergencyStop()
    stop.engage("menu", "", now=5)
    assert not stop.hear(StopWord(False, "stranger", sequence=sequence), now=6) and stop.engaged
    stop.release("user_input", now=7)
    assert stop.hear(StopWord(True, "stranger", sequence=sequence), now=8) and stop.engaged
    assert 7 < stop.word.sequence < GREATEST  # so that the others can tell it from what was before


def test_of_two_words_with_one_number_the_stop_counts():
    stop, released = StopWord(True, "page", sequence=9), StopWord(False, "user_input", sequence=9)
    assert after(stop, released).engaged and after(released, stop).engaged


def test_a_stop_that_was_under_way_while_an_older_one_was_released_holds():
    user_input = EmergencyStop()
    user_input.engage("menu", "", now=100)
    page = EmergencyStop()
    page.hear(user_input.word, now=101)
    under_way = page.engage("page", "", now=110)
    released = user_input.release("user_input", now=111)
    assert user_input.hear(under_way, now=112) and user_input.engaged
    assert page.hear(released, now=112) and page.hear(user_input.word, now=113) and page.engaged


def test_an_old_stop_is_none_to_somebody_who_learns_of_its_release_first():
    menu = EmergencyStop()
    old = menu.engage("menu", "", now=100)
    released = after(old).release("user_input", now=200)
    restarted = after(released)
    assert not restarted.hear(old, now=300) and not restarted.engaged


def test_words_tell_who_and_why():
    assert str(StopWord()) == "no emergency stop"
    assert str(StopWord(True, "driver", "its stop button is pressed")) == (
        "emergency stop by driver (its stop button is pressed)"
    )
    assert str(replace(StopWord(by="user_input"), sequence=3)) == "emergency stop released by user_input"
