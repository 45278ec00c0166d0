"""Messages of one instant."""

from __future__ import annotations

import pytest

from tulip_ros.matching import KEEP, SameStamp


def test_instant_is_complete_with_the_last_of_its_messages_in_the_order_of_names():
    same = SameStamp("a", "b", "c")
    assert same.add("c", 4, "c4") is None
    assert same.add("a", 4, "a4") is None
    assert same.add("a", 8, "a8") is None
    assert same.add("b", 4, "b4") == ("a4", "b4", "c4")


def test_older_incomplete_instants_are_dropped_and_counted():
    same = SameStamp("a", "b")
    same.add("a", 4, 0)
    assert same.add("a", 8, 1) is None
    assert same.add("b", 8, 2) == (1, 2)
    assert same.dropped == 1
    assert same.add("b", 4, 3) is None  # late: nobody may go back in time


def test_waiting_instants_stay_few():
    same = SameStamp("a", "b")
    for stamp in range(100):
        same.add("a", stamp, None)
    assert same.dropped == 100 - KEEP


def test_unknown_name_is_refused():
    with pytest.raises(ValueError, match="expected one of a, b"):
        SameStamp("a", "b").add("c", 0, None)
