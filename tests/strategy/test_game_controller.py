from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_strategy.game_controller import (
    LAYOUTS,
    VERSION_7,
    Packet,
    Player,
    Rejected,
    Reply,
    ReplyMessage,
    Team,
    decode,
    decode_reply,
    encode,
    encode_reply,
)

# Written by the RoboCup 2013 referee program itself; its "about" entry tells how.
GOLDEN: list[dict[str, Any]] = json.loads(
    (Path(__file__).parents[1] / "data" / "gamecontroller_v7_packets.json").read_text()
)["packets"]

byte = st.integers(0, 0xFF)
word = st.integers(0, 0xFFFF)
signed_word = st.integers(-0x8000, 0x7FFF)


def teams(players: int) -> st.SearchStrategy[Team]:
    player = st.builds(Player, word, word)
    return st.builds(Team, byte, byte, byte, byte, st.lists(player, min_size=players, max_size=players).map(tuple))


packets = st.builds(
    Packet,
    version=st.just(7),
    players_per_team=byte,
    state=st.integers(0, 4),
    first_half=byte,
    kick_off=byte,
    secondary_state=byte,
    drop_in_team=byte,
    drop_in_time=signed_word,
    seconds_remaining=st.integers(-(2**31), 2**31 - 1),
    teams=st.tuples(teams(11), teams(10)),
    penalty_shots=st.tuples(byte, byte),
    sub_time=signed_word,
)


def golden_packet(**changes: int) -> bytearray:
    data = bytearray.fromhex(GOLDEN[0]["hex"])
    for position, value in changes.items():
        data[int(position.removeprefix("byte_"))] = value
    return data


@pytest.mark.parametrize("golden", GOLDEN)
def test_packets_of_the_2013_referee_program_decode_to_what_was_put_in(golden: dict[str, Any]) -> None:
    packet = decode(bytes.fromhex(golden["hex"]))
    assert isinstance(packet, Packet)
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
    packet = decode(bytes.fromhex(golden["hex"]))
    assert isinstance(packet, Packet)
    assert encode(packet).hex() == golden["hex"]


def test_version_7_has_116_bytes() -> None:
    assert VERSION_7.size == 116


@given(packets)
def test_decode_of_encode_gives_the_packet_back(packet: Packet) -> None:
    assert decode(encode(packet)) == packet


@given(st.binary(max_size=300))
def test_any_bytes_decode_to_a_packet_or_a_reason(data: bytes) -> None:
    assert isinstance(decode(data), Rejected | Packet)
    assert isinstance(decode_reply(data), Rejected | Reply)


@given(st.binary(min_size=112, max_size=112), st.integers(0, 255))
def test_any_content_behind_the_magic_decodes_to_a_packet_or_a_reason(data: bytes, version: int) -> None:
    assert isinstance(decode(b"RGme" + bytes([version]) + data[1:]), Rejected | Packet)


@given(st.integers(0, 115))
def test_every_truncation_is_rejected(length: int) -> None:
    assert isinstance(decode(bytes(golden_packet())[:length]), Rejected)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "0 bytes"),
        (b"RGrt" + bytes(112), "RGme"),
        (bytes(golden_packet(byte_4=8)), "version is 8"),
        (bytes(golden_packet(byte_5=1)), "version is 263"),
        (bytes(golden_packet()[:-1]), "115 bytes"),
        (bytes(golden_packet()) + b"\0", "117 bytes"),
        (bytes(golden_packet(byte_9=5)), "state is 5"),
    ],
)
def test_rejection_names_what_is_wrong(data: bytes, words: str) -> None:
    rejected = decode(data)
    assert isinstance(rejected, Rejected)
    assert words in rejected.reason


def test_encode_refuses_values_that_do_not_fit() -> None:
    packet = decode(bytes(golden_packet()))
    assert isinstance(packet, Packet)
    fields = {name: getattr(packet, name) for name in packet.__dataclass_fields__}
    with pytest.raises(ValueError, match="version 7"):
        encode(Packet(**(fields | {"players_per_team": 256})))
    with pytest.raises(ValueError, match="version is 99"):
        encode(Packet(**(fields | {"version": 99})))
    with pytest.raises(ValueError, match="11 players; version 7 has 10"):
        encode(Packet(**(fields | {"teams": (packet.teams[0], packet.teams[0])})))


def test_reply_has_the_bytes_of_2013() -> None:
    assert encode_reply(Reply(25, 1)).hex() == "52477274" + "01000000" + "1900" + "0100" + "02000000"


@given(word, word, st.sampled_from(ReplyMessage))
def test_replies_survive_the_round_trip(team: int, player: int, message: ReplyMessage) -> None:
    reply = Reply(team, player, message)
    assert decode_reply(encode_reply(reply)) == reply


def test_every_layout_is_filed_under_its_own_version() -> None:
    assert all(version == layout.version for version, layout in LAYOUTS.items())
