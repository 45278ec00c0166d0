from __future__ import annotations

from tulip_strategy.complaints import FORGET, MOST, Complaints

SECOND = 10**9


def test_a_reason_is_named_once_however_long_it_goes_on() -> None:
    complaints = Complaints()
    named = [complaints.is_new("version 9", stamp * SECOND // 2) for stamp in range(1000)]
    assert named == [True] + [False] * 999


def test_each_reason_is_named() -> None:
    complaints = Complaints()
    assert [complaints.is_new(reason, 0) for reason in ("size", "team", "size", "team")] == [True, True, False, False]


def test_a_reason_that_comes_again_after_a_long_pause_is_named_again() -> None:
    complaints = Complaints()
    assert complaints.is_new("size", 0)
    assert not complaints.is_new("size", FORGET - 1)
    assert complaints.is_new("size", 2 * FORGET - 1)


def test_a_flood_of_reasons_is_not_remembered_without_end() -> None:
    complaints = Complaints()
    assert sum(complaints.is_new(f"{number} bytes", number) for number in range(10_000)) == MOST
