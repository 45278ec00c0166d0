from __future__ import annotations

import json
import random
from itertools import islice

import pytest

from tulip_sim.bench import referee
from tulip_strategy.game_controller import Packet, decode


def test_a_flood_of_packets_changes_nothing_that_it_should_not() -> None:
    row = referee.measure("flood", 20_000)
    for name in ("exceptions", "states changed by a rejected one", "taken but invalid", "rejected but valid"):
        assert row[name] == 0, name
    assert row["taken"] > 5_000
    kinds = ("magic", "size", "state", "team", "version")
    rejected = [row[f"rejected ({kind})"] for kind in kinds]
    assert min(rejected) > 100
    assert row["taken"] + sum(rejected) == 20_000


@pytest.mark.parametrize("version", referee.SIZES)
def test_the_flood_has_valid_and_invalid_packets_of_every_version(version: int) -> None:
    packets = [data for data in islice(referee.flood(random.Random(2)), 5_000) if data[4:5] == bytes([version])]
    valid = sum(referee.is_valid(data) for data in packets)
    assert 100 < valid < len(packets) - 100


def test_golden_packets_and_round_trips_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(referee, "ROUND_TRIPS", 200)
    rows = [referee.measure("golden", 0), *(referee.measure("round trip", version) for version in referee.SIZES)]
    rows.append(referee.measure("flood", 1_000))
    assert rows[0] == {"part": "golden", "packets": 8, "as put in": 8, "same bytes": 8}
    assert all(row["accepted"] == row["same bytes"] == 200 for row in rows[1:-1])
    text = "\n".join(referee.summarize(rows))
    assert "8 of 8 decode to what was put in, 8 encode back" in text
    assert "| exceptions | 0 |" in text


@pytest.mark.parametrize("name", ["state", "kick_off_colour", "seconds_remaining", "penalty_shots", "teams"])
def test_a_packet_of_2013_that_says_something_else_is_noticed(name: str) -> None:
    first, second = json.loads(referee.GOLDEN.read_text())["packets"][:2]
    packet = decode(bytes.fromhex(first["hex"]))
    assert isinstance(packet, Packet)
    assert referee._holds(packet, first)
    assert not referee._holds(packet, first | {name: second[name]})
