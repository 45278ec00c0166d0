from __future__ import annotations

import copy
import json
import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packet_bytes import OTHER, OWN, SIZES, write

from tulip_strategy.game_controller import (
    LAYOUTS,
    PACKET_MAGIC,
    Fault,
    Packet,
    Rejected,
    decode,
    encode,
    layout_of,
    make_packet,
)
from tulip_strategy.game_controller.meaning import MEANINGS
from tulip_strategy.game_controller.penalties import PENALTIES, code_of, penalty_of
from tulip_strategy.interface import Penalty

# Written by the RoboCup 2013 referee program itself; its "about" entry tells how.
GOLDEN: list[dict[str, Any]] = json.loads(
    (Path(__file__).parents[1] / "data" / "gamecontroller_v7_packets.json").read_text()
)["packets"]

HEADS = {7: 8, 12: 6}
"""Bytes of magic and version, where the version has more than one."""

versions = st.sampled_from(sorted(SIZES))


def golden_packet(**changes: int) -> bytearray:
    data = bytearray.fromhex(GOLDEN[0]["hex"])
    for position, value in changes.items():
        data[int(position.removeprefix("byte_"))] = value
    return data


def packet_of(data: bytes) -> Packet:
    packet = decode(data)
    assert isinstance(packet, Packet), packet
    return packet


@pytest.mark.parametrize("golden", GOLDEN)
def test_packets_of_the_2013_referee_program_decode_to_what_was_put_in(golden: dict[str, Any]) -> None:
    packet = packet_of(bytes.fromhex(golden["hex"]))
    for packet_name, golden_name in (
        ("players_per_team", "players_per_team"),
        ("state", "state"),
        ("first_half", "first_half"),
        ("kick_off", "kick_off_colour"),
        ("secondary_state", "secondary_state"),
        ("drop_in_team", "drop_in_team"),
        ("drop_in_time", "drop_in_time"),
        ("seconds_remaining", "seconds_remaining"),
        ("sub_time", "sub_time"),
    ):
        assert getattr(packet, packet_name) == golden[golden_name], packet_name
    assert packet.penalty_shots == tuple(golden["penalty_shots"])
    for team, expected in zip(packet.teams, golden["teams"], strict=True):
        assert (team.number, team.colour, team.goal_colour, team.score) == (
            expected["number"],
            expected["colour"],
            expected["goal_colour"],
            expected["score"],
        )
        given_players = [[player.penalty, player.seconds] for player in team.players]
        assert given_players[: len(expected["players_penalty_seconds"])] == expected["players_penalty_seconds"]


@pytest.mark.parametrize("golden", GOLDEN)
def test_golden_packets_encode_back_to_the_same_bytes(golden: dict[str, Any]) -> None:
    assert encode(packet_of(bytes.fromhex(golden["hex"]))).hex() == golden["hex"]


def test_every_version_has_the_length_of_its_format() -> None:
    assert {version: layout.size for version, layout in LAYOUTS.items()} == SIZES
    assert all(version == layout.version for version, layout in LAYOUTS.items())
    assert set(MEANINGS) == set(PENALTIES) == set(LAYOUTS)


@pytest.mark.parametrize("version", SIZES)
def test_packets_written_from_the_format_alone_decode_to_what_was_put_in(version: int) -> None:
    data = write(version, 3, penalty=14, seconds=27)
    packet = packet_of(data)
    assert len(data) == SIZES[version]
    assert (packet.version, packet.players_per_team, packet.state, packet.first_half) == (version, 1, 3, 1)
    assert packet.seconds_remaining == 142
    first, second = packet.teams
    assert (first.number, first.colour, first.score) == (OTHER, 0, 2)
    assert (second.number, second.colour, second.score) == (OWN, 1, 3)
    assert (second.players[0].penalty, second.players[0].seconds) == (14, 27)
    assert (first.players[0].penalty, second.players[1].penalty) == (0, 0)
    if version == 7:
        assert (packet.kick_off, packet.drop_in_time, packet.secondary_state) == (1, -1, 1)
        return
    assert packet.packet_number == 77
    assert packet.secondary_time == 30
    assert (second.penalty_shot, second.single_shots) == (4, 5)
    if version == 8:
        assert (packet.kick_off, packet.drop_in_time) == (1, -1)
        assert second.coach_message == b"\x01\0kick".ljust(40, b"\0")
        assert (second.coach_penalty, second.coach_seconds) == (9, 8)
    elif version == 12:
        assert (packet.kick_off, packet.game_type, packet.drop_in_team) == (OWN, 1, OTHER)
        assert second.coach_message == bytes(range(253))
        assert (second.coach_sequence, second.coach_penalty, second.coach_goalkeeper) == (6, 0, 5)
        assert [player.goalkeeper for player in second.players] == [0, 1, *[0] * 9]
        assert second.players[0].warnings == 1
    else:
        assert (packet.kick_off, packet.game_phase, packet.set_play) == (OWN, 1, 0)
        assert (second.goalkeeper_colour, second.goalkeeper, second.message_budget) == (5, 2, 1100)
    if version == 18:
        assert (packet.competition_phase, packet.competition_type) == (2, 0)
    if version >= 19:
        assert (packet.competition_type, packet.stopped) == (2, 0)
        assert second.players[0].cautions == {19: 2, 20: 3}[version]


@pytest.mark.parametrize("version", SIZES)
def test_every_byte_of_an_accepted_packet_comes_back(version: int) -> None:
    rng = random.Random(version)
    accepted = 0
    for _ in range(2000):
        data = bytearray(rng.randbytes(SIZES[version]))
        head = HEADS.get(version, 5)
        data[:head] = write(version, 0)[:head]
        packet = decode(bytes(data))
        if isinstance(packet, Packet):
            accepted += 1
            assert encode(packet) == bytes(data)
    assert accepted > 10  # of random states, 5 or 6 in 256 are known: about 40


@given(versions, st.integers(0, 4), st.data())
def test_random_content_survives_the_round_trip(version: int, state: int, data: st.DataObject) -> None:
    content = bytearray(data.draw(st.binary(min_size=SIZES[version], max_size=SIZES[version])))
    head = HEADS.get(version, 5)
    content[:head] = write(version, state)[:head]
    place = encode(make_packet(layout_of(version), PACKET_MAGIC, {"state": 255})).index(255)
    content[place] = state
    packet = packet_of(bytes(content))
    assert packet.state == state
    assert encode(packet) == bytes(content)
    assert decode(encode(packet)) == packet


@given(st.binary(max_size=800))
def test_any_bytes_decode_to_a_packet_or_a_reason(data: bytes) -> None:
    assert isinstance(decode(data), Rejected | Packet)


@given(versions, st.lists(st.tuples(st.integers(0, 115), st.integers(0, 255)), max_size=6))
def test_mutated_packets_are_rejected_or_come_back_unchanged(version: int, changes: list[tuple[int, int]]) -> None:
    data = bytearray(write(version, 3))
    for place, value in changes:
        data[place] = value
    packet = decode(bytes(data))
    assert isinstance(packet, Rejected) or encode(packet) == bytes(data)


@given(versions, st.integers(0, 687))
def test_every_truncation_is_rejected(version: int, length: int) -> None:
    rejected = decode(write(version, 3)[: length % SIZES[version]])
    assert isinstance(rejected, Rejected)
    assert rejected.fault is Fault.SIZE


@pytest.mark.parametrize(
    ("data", "fault", "words"),
    [
        (b"", Fault.SIZE, "0 bytes"),
        (b"RGrt" + bytes(112), Fault.MAGIC, "RGme"),
        (bytes(golden_packet(byte_4=9)), Fault.VERSION, "version is 9; expected one of: 7, 8, 12, 18, 19, 20"),
        (bytes(golden_packet(byte_4=8)), Fault.SIZE, "version 8 is 116 bytes long; expected 158"),
        (bytes(golden_packet(byte_5=1)), Fault.VERSION, "version is 263"),
        (write(12, 3)[:5] + b"\1" + write(12, 3)[6:], Fault.VERSION, "version is 268"),
        (bytes(golden_packet()[:-1]), Fault.SIZE, "115 bytes"),
        (bytes(golden_packet()) + b"\0", Fault.SIZE, "117 bytes"),
        (bytes(golden_packet(byte_9=5)), Fault.STATE, "state is 5; expected 0 to 4"),
        (write(20, 6), Fault.STATE, "state is 6; expected 0 to 5"),
    ],
)
def test_rejection_names_what_is_wrong(data: bytes, fault: Fault, words: str) -> None:
    rejected = decode(data)
    assert isinstance(rejected, Rejected)
    assert rejected.fault is fault
    assert words in rejected.reason


def test_encode_refuses_values_that_do_not_fit() -> None:
    def made(fields: dict[str, Any], teams: list[dict[str, Any]] | None = None, version: int = 7) -> Packet:
        return make_packet(layout_of(version), PACKET_MAGIC, fields, teams or [])

    with pytest.raises(ValueError, match="does not fit version 7"):
        encode(made({"players_per_team": 256}))
    with pytest.raises(ValueError, match="version is 99; expected one of: 7, 8, 12, 18, 19, 20"):
        layout_of(99)
    with pytest.raises(ValueError, match="11 players; version 7 has 10"):
        made({}, [{}, {"players": [{}] * 11}])
    with pytest.raises(ValueError, match="version 18 has no field 'stopped'"):
        made({"stopped": 1}, version=18)
    with pytest.raises(ValueError, match="coach_message is 41 bytes long; version 8 has room for 40"):
        made({}, [{"coach_message": bytes(41)}], version=8)
    with pytest.raises(ValueError, match="penalty_shots has 3 values; version 7 has 2"):
        made({"penalty_shots": (1, 2, 3)})


def test_a_name_that_a_version_does_not_have_is_an_error_that_lists_the_names() -> None:
    with pytest.raises(AttributeError, match="there is no 'stopped' here; expected one of: magic, version, packet_n"):
        _ = packet_of(write(18, 3)).stopped


def test_packets_are_values_that_compare_and_can_be_copied() -> None:
    packet = packet_of(write(12, 3))
    assert copy.copy(packet) == packet
    assert packet != packet_of(write(12, 2))
    assert len({packet, packet_of(write(12, 3)), packet_of(write(20, 3))}) == 2


@pytest.mark.parametrize("version", SIZES)
def test_every_code_of_a_penalty_is_one_and_unknown_codes_are_too(version: int) -> None:
    assert penalty_of(version, 0) is Penalty.NONE
    assert all(penalty_of(version, code) is not Penalty.NONE for code in range(1, 256))
    assert penalty_of(version, 99) is Penalty.UNKNOWN
    for penalty in set(PENALTIES[version].values()):
        assert penalty_of(version, code_of(version, penalty)) is penalty


def test_a_penalty_that_a_version_lacks_is_named() -> None:
    with pytest.raises(ValueError, match="version 7 has no penalty STANCE or SENT_OFF"):
        code_of(7, Penalty.STANCE, Penalty.SENT_OFF)
    assert code_of(7, Penalty.INACTIVE, Penalty.PICK_UP) == 5
