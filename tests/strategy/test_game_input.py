from __future__ import annotations

from dataclasses import replace

import pytest

from tulip_strategy.game_controller import Packet, Player, Rejected, Reply, Team, TeamColour, decode_reply, encode
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.interface import GamePhase, GameState

SECOND = 10**9


def team(number: int, colour: TeamColour, players: int, score: int = 0) -> Team:
    return Team(number, colour, goal_colour=1, score=score, players=(Player(),) * players)


PACKET = Packet(
    version=7,
    players_per_team=2,
    state=3,
    first_half=1,
    kick_off=TeamColour.MAGENTA,
    secondary_state=1,
    drop_in_team=0,
    drop_in_time=-1,
    seconds_remaining=142,
    teams=(team(12, TeamColour.CYAN, 11, score=2), team(25, TeamColour.MAGENTA, 10, score=3)),
)


def test_state_is_seen_from_the_own_team_and_player() -> None:
    second = replace(PACKET.teams[1], players=(Player(), Player(5, 30), *[Player()] * 8))
    game = GameInput(GameInputParameters(team_number=25, player_number=2))
    assert game.receive(encode(replace(PACKET, teams=(PACKET.teams[0], second))), 7 * SECOND) is None
    assert game.state(8 * SECOND) == GameState(
        stamp=7 * SECOND,
        version=7,
        phase=GamePhase.PLAYING,
        first_half=True,
        kick_off=True,
        secondary_state=1,
        seconds_remaining=142,
        own_score=3,
        opponent_score=2,
        penalty=5,
        seconds_till_unpenalised=30,
        stale=False,
    )


def test_colour_tells_two_teams_with_one_number_apart() -> None:
    teams = (PACKET.teams[0], replace(PACKET.teams[1], number=12))
    game = GameInput(GameInputParameters(team_number=12, team_colour=TeamColour.MAGENTA))
    assert game.receive(encode(replace(PACKET, teams=teams)), 0) is None
    state = game.state(0)
    assert state is not None
    assert state.own_score == 3


def test_kick_off_of_the_other_team_and_drop_ball_are_not_ours() -> None:
    game = GameInput(GameInputParameters(team_number=25))
    for kick_off in (TeamColour.CYAN, TeamColour.DROP_BALL):
        assert game.receive(encode(replace(PACKET, kick_off=kick_off)), 0) is None
        state = game.state(0)
        assert state is not None
        assert not state.kick_off


def test_state_is_none_before_a_packet_and_stale_after_five_seconds_without_one() -> None:
    game = GameInput(GameInputParameters(team_number=25))
    assert game.state(0) is None
    game.receive(encode(PACKET), SECOND)
    fresh, stale = game.state(6 * SECOND), game.state(6 * SECOND + 1)
    assert fresh is not None
    assert stale is not None
    assert (fresh.stale, stale.stale) == (False, True)
    game.receive(encode(PACKET), 7 * SECOND)
    again = game.state(8 * SECOND)
    assert again is not None
    assert not again.stale


def test_a_rejected_packet_changes_nothing_and_says_why() -> None:
    game = GameInput(GameInputParameters(team_number=25))
    game.receive(encode(PACKET), 0)
    foreign = replace(PACKET, teams=(PACKET.teams[0], replace(PACKET.teams[1], number=9)))
    rejected = game.receive(encode(foreign), SECOND)
    assert isinstance(rejected, Rejected)
    assert "12" in rejected.reason
    assert "expected 25" in rejected.reason
    assert isinstance(game.receive(b"nonsense", SECOND), Rejected)
    state = game.state(SECOND)
    assert state is not None
    assert state.stamp == 0


def test_reply_carries_our_numbers() -> None:
    game = GameInput(GameInputParameters(team_number=25, player_number=3))
    assert decode_reply(game.reply()) == Reply(25, 3)


def test_parameters_out_of_range_are_named() -> None:
    with pytest.raises(ValueError, match=r"player_number is 0; expected 1 to 10"):
        GameInputParameters(player_number=0)
    with pytest.raises(ValueError, match="team_number is 300"):
        GameInputParameters(team_number=300)
    with pytest.raises(ValueError, match=r"stale_after is 0.0 s"):
        GameInputParameters(stale_after=0.0)
