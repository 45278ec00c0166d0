"""The bench of transports: its table, and the profile that it compares with."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from tulip_sim.bench import transport


def row(number: int, way: str, flowing: float, lost: int) -> dict[str, object]:
    restarts = {f"{node} matched [s]": [1.0, 1.2] for node in ("head", "user_input")}
    restarts |= {f"{node} joined [s]": [0.9, 0.9] for node in ("head", "user_input")}
    restarts |= {f"{node} flowing [s]": [flowing, flowing + 0.5] for node in ("head", "user_input")}
    pictures: dict[str, object] = {}
    for when in ("", " after the kill"):
        pictures |= {f"sent{when}": 240, f"lost{when}": lost, f"most{when} [ms]": 20.0}
        pictures |= {f"median{when} [ms]": 2.0, f"99 %{when} [ms]": 8.0, f"longest sending{when} [ms]": 5.0}
    cores = {"sender [core]": 0.03, "receiver [core]": 0.07}
    known = {"round": number, "transport": way, "profile": "udp"}
    return {**known, **restarts, **pictures, **cores}


def test_each_transport_makes_one_line_of_all_its_rounds() -> None:
    rows = [row(1, "udp", 1.5, 0), row(2, "udp", 2.5, 3), row(1, "auto", 1.5, 0)]
    text, _, head, rule, *lines = transport.summarize(rows)
    assert "2 rounds" in text
    columns = head.count("|")
    assert [line.count("|") for line in (rule, *lines)] == [columns] * 3
    assert lines[0] == (
        "| UDP by loopback | 1.10 (1.20) s | 2.25 (3.00) s | 1.35 (2.10) s"
        " | 1.10 (1.20) s | 2.25 (3.00) s | 1.35 (2.10) s | 2.0 ms | 8.0 ms | 20 ms"
        " | 3 of 480 | 0.10 | 3 of 480 | 5 (5) ms |"
    )
    assert lines[1].startswith("| auto: here udp |")


def test_every_round_has_each_transport_once_and_begins_with_another() -> None:
    rounds = [[way for number, way in transport.BENCH.trials if number == each + 1] for each in range(transport.ROUNDS)]
    assert all(sorted(ways) == sorted(transport.WAYS) for ways in rounds)
    assert all(first[0] != second[0] for first, second in pairwise(rounds))


def test_fewer_rounds_are_a_part_of_all_and_other_options_are_refused() -> None:
    assert transport.choose({"rounds": "2"}) == transport.trials()[: 2 * len(transport.WAYS)]
    for options in ({"rounds": "0"}, {"rounds": "-1"}, {"round": "2"}):
        with pytest.raises(ValueError, match="expected rounds, a number > 0"):
            transport.choose(options)


def test_the_small_segment_is_the_same_profile_without_its_sizes(tmp_path: Path) -> None:
    own = transport.transport.profile_path("shared_memory").read_text()
    small = transport._small(tmp_path).read_text()
    sizes = ("<segment_size>16777216</segment_size>", "<maxMessageSize>4194304</maxMessageSize>")
    for size in sizes:
        assert size in own and size not in small
        own = own.replace(size, "")
    assert small == own
