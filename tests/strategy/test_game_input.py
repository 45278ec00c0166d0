from __future__ import annotations

import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packet_bytes import OTHER, OWN, SIZES, write

from tulip_description.planar import Pose2D
from tulip_strategy.game_controller import Fault, Rejected, Reply, RobotStatus, TeamColour, decode_reply
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.interface import GamePhase, GameState, Penalty, SecondaryState, SetPlay

SECOND = 10**9
VERSIONS = sorted(SIZES)
PICK_UP = {7: 5, 8: 5, 12: 34, 18: 7, 19: 5, 20: 6}
GAME_PHASE, SET_PLAY, KICKER, STOPPED = 9, 11, 13, 8
"""Bytes of versions 18 to 20."""


def seen(data: bytes, parameters: GameInputParameters | None = None) -> GameState:
    game = GameInput(parameters or GameInputParameters())
    assert game.receive(data, 7 * SECOND) is None
    state = game.state(8 * SECOND)
    assert state is not None
    return state


def changed(data: bytes, **values: int) -> bytes:
    content = bytearray(data)
    for place, value in values.items():
        content[int(place.removeprefix("byte_"))] = value
    return bytes(content)


@pytest.mark.parametrize("version", VERSIONS)
def test_state_is_seen_from_the_own_team_and_player_in_every_version(version: int) -> None:
    assert seen(write(version, 3, PICK_UP[version], 30)) == GameState(
        stamp=7 * SECOND,
        version=version,
        phase=GamePhase.PLAYING,
        first_half=True,
        kick_off=True,
        secondary_state=SecondaryState.PENALTY_SHOOT,
        seconds_remaining=142,
        own_score=3,
        opponent_score=2,
        penalty=Penalty.PICK_UP,
        seconds_till_unpenalised=30,
        stale=False,
        stopped=False,
        set_play=SetPlay.NONE,
        goalkeeper=2 if version >= 12 else 0,
    )


@pytest.mark.parametrize("version", VERSIONS)
def test_another_player_of_the_team_is_not_penalised(version: int) -> None:
    state = seen(write(version, 3, PICK_UP[version], 30), GameInputParameters(player_number=2))
    assert (state.penalty, state.seconds_till_unpenalised) == (Penalty.NONE, 0)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_other_team_sees_it_the_other_way_round(version: int) -> None:
    state = seen(write(version, 3, PICK_UP[version]), GameInputParameters(team_number=OTHER))
    assert (state.own_score, state.opponent_score, state.penalty, state.kick_off) == (2, 3, Penalty.NONE, False)


@pytest.mark.parametrize("version", VERSIONS)
def test_kick_off_of_the_other_team_and_drop_ball_are_not_ours(version: int) -> None:
    assert not seen(write(version, 3, kicks_off=False)).kick_off
    place = {7: 11, 8: 9, 12: 11}.get(version, KICKER)
    data = write(version, 3)
    assert data[place] == (1 if version < 12 else OWN)
    assert not seen(changed(data, **{f"byte_{place}": 2 if version < 12 else 255})).kick_off


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("state", range(5))
def test_phases_are_those_of_2013(version: int, state: int) -> None:
    assert seen(write(version, state)).phase is GamePhase(state)


@pytest.mark.parametrize("version", [18, 19, 20])
def test_in_standby_the_robot_waits_as_in_the_initial_state(version: int) -> None:
    assert seen(write(version, 5)).phase is GamePhase.INITIAL


@pytest.mark.parametrize("version", VERSIONS)
def test_an_unknown_penalty_is_a_penalty(version: int) -> None:
    assert seen(write(version, 3, penalty=99)).penalty is Penalty.UNKNOWN


@pytest.mark.parametrize(
    ("number", "set_play"),
    [
        (4, SetPlay.DIRECT_FREE_KICK),
        (5, SetPlay.INDIRECT_FREE_KICK),
        (6, SetPlay.PENALTY_KICK),
        (7, SetPlay.CORNER_KICK),
        (8, SetPlay.GOAL_KICK),
        (9, SetPlay.THROW_IN),
    ],
)
def test_set_plays_of_version_12_tell_who_kicks_and_when_to_stand_still(number: int, set_play: SetPlay) -> None:
    for step, stopped in ((0, True), (1, False), (2, True)):
        ours = seen(changed(write(12, 3, kicks_off=False), byte_12=number, byte_13=OWN, byte_14=step))
        theirs = seen(changed(write(12, 3), byte_12=number, byte_13=OTHER, byte_14=step))
        assert (ours.set_play, ours.kick_off, ours.stopped) == (set_play, True, stopped)
        assert (theirs.set_play, theirs.kick_off) == (set_play, False)
        assert ours.secondary_state is SecondaryState.NORMAL


@pytest.mark.parametrize(
    ("version", "numbers"),
    [
        (18, (SetPlay.GOAL_KICK, SetPlay.DIRECT_FREE_KICK, SetPlay.CORNER_KICK, SetPlay.THROW_IN)),
        (19, (SetPlay.DIRECT_FREE_KICK, SetPlay.INDIRECT_FREE_KICK, SetPlay.PENALTY_KICK, SetPlay.THROW_IN)),
        (20, (SetPlay.DIRECT_FREE_KICK, SetPlay.INDIRECT_FREE_KICK, SetPlay.PENALTY_KICK, SetPlay.THROW_IN)),
    ],
)
def test_set_plays_of_later_versions(version: int, numbers: tuple[SetPlay, ...]) -> None:
    for number, set_play in enumerate(numbers, start=1):
        assert seen(changed(write(version, 3), **{f"byte_{SET_PLAY}": number})).set_play is set_play


@pytest.mark.parametrize("version", [19, 20])
def test_a_stopped_game_is_told(version: int) -> None:
    state = seen(changed(write(version, 3), **{f"byte_{STOPPED}": 1}))
    assert (state.stopped, state.halted, state.phase) == (True, True, GamePhase.PLAYING)


@pytest.mark.parametrize(("version", "place"), [(7, 12), (8, 10), (12, 12), (18, 9), (19, 9), (20, 9)])
def test_a_timeout_halts_the_robot_in_every_version(version: int, place: int) -> None:
    state = seen(changed(write(version, 3), **{f"byte_{place}": 3}))
    assert (state.secondary_state, state.halted) == (SecondaryState.TIMEOUT, True)
    assert not seen(changed(write(version, 3), **{f"byte_{place}": 0})).halted


def test_colour_tells_two_teams_with_one_number_apart() -> None:
    data = write(7, 3, own=OTHER)
    magenta = GameInputParameters(team_number=OTHER, team_colour=TeamColour.MAGENTA)
    cyan = GameInputParameters(team_number=OTHER, team_colour=TeamColour.CYAN)
    assert (seen(data, magenta).own_score, seen(data, cyan).own_score) == (3, 2)


@pytest.mark.parametrize("version", VERSIONS)
def test_state_is_stale_after_five_seconds_without_a_packet_and_keeps_the_last(version: int) -> None:
    game = GameInput(GameInputParameters())
    assert game.state(0) is None
    game.receive(write(version, 3), SECOND)
    fresh, stale = game.state(6 * SECOND), game.state(6 * SECOND + 1)
    assert fresh is not None
    assert stale == replace(fresh, stale=True)
    assert not fresh.stale
    assert fresh.phase is GamePhase.PLAYING
    game.receive(write(version, 3), 7 * SECOND)
    again = game.state(8 * SECOND)
    assert again is not None
    assert not again.stale


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    ("wrong", "fault"),
    [
        (lambda version: b"nonsense", Fault.MAGIC),
        (lambda version: write(version, 4)[:-1], Fault.SIZE),
        (lambda version: write(version, 6), Fault.STATE),
        (lambda version: write(version, 4)[:4] + b"\x0b" + write(version, 4)[5:], Fault.VERSION),
        (lambda version: write(version, 4, own=9), Fault.TEAM),
    ],
)
def test_a_rejected_packet_changes_nothing_and_says_why(version: int, wrong: object, fault: Fault) -> None:
    game = GameInput(GameInputParameters())
    game.receive(write(version, 3), 0)
    before = game.state(SECOND)
    assert callable(wrong)
    rejected = game.receive(wrong(version), SECOND)
    assert isinstance(rejected, Rejected)
    assert rejected.fault is fault
    assert game.state(SECOND) == before


def test_a_packet_of_another_game_is_named_with_its_teams() -> None:
    rejected = GameInput(GameInputParameters()).receive(write(20, 3, own=9, other=8), 0)
    assert isinstance(rejected, Rejected)
    assert rejected.reason == "packet is for teams 8 (colour 0) and 9 (colour 1); expected 25"


@given(st.binary(max_size=700))
def test_any_bytes_leave_the_state_as_it_was_unless_they_are_taken(data: bytes) -> None:
    game = GameInput(GameInputParameters())
    game.receive(write(12, 3), 0)
    before = game.state(1)
    for content in (data, write(12, 3)[:5] + data, b"RGme" + data):
        assert game.receive(content, 1) is None or game.state(1) == before


@pytest.mark.parametrize("version", VERSIONS)
def test_the_answer_is_the_reply_of_the_version_to_its_port(version: int) -> None:
    game = GameInput(GameInputParameters(player_number=3))
    status = RobotStatus(True, Pose2D(-1.5, 0.25, 0.5), (2.0, -0.5), 1.5)
    assert game.answer(status) is None  # nobody asked yet
    game.receive(write(version, 3), 0)
    answer = game.answer(status)
    assert answer is not None
    reply = {7: 1, 8: 2, 12: 2}.get(version, 4)
    assert answer.port == (3838 if version < 12 else 3939)
    assert decode_reply(answer.data) == Reply(OWN, 3, version=reply, status=status if reply == 4 else None)


def test_an_answer_that_tells_the_status_waits_until_it_is_known() -> None:
    game = GameInput(GameInputParameters())
    game.receive(write(7, 3), 0)
    assert not game.needs_status
    assert game.answer() is not None
    game.receive(write(18, 3), 0)
    assert game.needs_status
    assert game.answer() is None
    answer = game.answer(RobotStatus(False, Pose2D()))
    assert answer is not None
    assert struct.unpack_from("<B", answer.data, 7) == (0,)


def test_parameters_out_of_range_are_named() -> None:
    with pytest.raises(ValueError, match=r"player_number is 0; expected 1 to 10"):
        GameInputParameters(player_number=0)
    with pytest.raises(ValueError, match="team_number is 300"):
        GameInputParameters(team_number=300)
    with pytest.raises(ValueError, match=r"stale_after is 0.0 s"):
        GameInputParameters(stale_after=0.0)
