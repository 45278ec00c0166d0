"""A referee's view of the game as the packet of a protocol version."""

from __future__ import annotations

from tulip_sim.situation import PlayerSituation, Removal, Situation, TeamSituation
from tulip_strategy.game_controller import Packet, Penalty, Player, Team, encode

PLAYERS = (11, 10)
"""Of the two teams in a packet of version 7."""
PENALTY_SHOOT = 1  # secondary state: the nearest that version 7 has to dribble and kick
YELLOW_GOAL = 1
MOST_TRIALS = 5  # a side, one bit each

PENALTIES = {
    Removal.NONE: Penalty.NONE,
    Removal.INACTIVE: Penalty.PICKUP_REQUEST,
    Removal.LEFT_FIELD: Penalty.PICKUP_REQUEST,
    Removal.MANUAL: Penalty.MANUAL,
}


def write_packet(situation: Situation) -> bytes:
    """Return the packet of version 7 that tells a situation."""
    striker = situation.teams[situation.striker]
    first, second = (_team(team, count) for team, count in zip(situation.teams, PLAYERS, strict=True))
    return encode(
        Packet(
            version=7,
            players_per_team=1,
            state=situation.phase,
            first_half=int(situation.first_half),
            kick_off=striker.colour,
            secondary_state=PENALTY_SHOOT,
            drop_in_team=striker.colour,
            drop_in_time=-1,
            seconds_remaining=situation.seconds_remaining,
            teams=(first, second),
            penalty_shots=(_shots(situation.teams[0]), _shots(situation.teams[1])),
            sub_time=situation.phase_seconds,
        )
    )


def _team(team: TeamSituation, players: int) -> Team:
    known = [_player(each) for each in team.players]
    return Team(
        team.number, team.colour, YELLOW_GOAL, team.score & 0xFF, (*known, *[Player()] * (players - len(known)))
    )


def _player(player: PlayerSituation) -> Player:
    return Player(PENALTIES[player.removal], player.seconds)


def _shots(team: TeamSituation) -> int:
    """Return one bit a trial, set where it scored; trials beyond the fifth share the last bit."""
    bits = 0
    for index, scored in enumerate(team.scored_trials):
        bits |= scored << min(index, MOST_TRIALS - 1)
    return bits
