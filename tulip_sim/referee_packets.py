"""A referee's view of the game as the packet of a protocol version."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from tulip_sim.situation import PlayerSituation, Removal, Situation, TeamSituation
from tulip_strategy.game_controller import PACKET_MAGIC, encode, layout_of, make_packet
from tulip_strategy.game_controller.penalties import code_of
from tulip_strategy.interface import Penalty

PLAYERS = (11, 10)
"""Of the two teams in a packet of version 7; no version has fewer."""
ADULT_SIZE = 1  # game type in version 12
LARGE = 2  # competition type in versions 19 and 20
YELLOW_GOAL = 1
WITH_SUBSTITUTES = 18  # from this version on, players who do not take part are told as substitutes
NO_DROP_IN = -1  # time since the last one
MOST_REMAINING = 0x7FFF  # [s] in versions after 7; a longer trial is told as this long
MOST_PENALTY = {7: 0xFFFF, 8: 0xFF, 12: 0xFF, 18: 0xFF, 19: 0xFF, 20: 0xFF}  # [s] by version, told likewise
MOST_TRIALS = 5  # a side, one bit each

PENALTY_NAMES: Mapping[Removal, tuple[Penalty, ...]] = {
    Removal.NONE: (Penalty.NONE,),
    Removal.INACTIVE: (Penalty.INACTIVE, Penalty.PICK_UP),
    Removal.LEFT_FIELD: (Penalty.LEFT_FIELD, Penalty.PICK_UP),
    Removal.MANUAL: (Penalty.MANUAL, Penalty.PICK_UP),
}
"""What a removal is told as: the first that the version has."""

Fields = dict[str, Any]


def write_packet(situation: Situation, version: int = 7) -> bytes:
    """Return the packet of a version that tells a situation.

    Dribble and kick is told as a penalty shoot-out, the nearest that any version has.

    Raises:
        ValueError: if the version is not known, or has no room for a player or a number.
    """
    layout = layout_of(version)
    fields, team = _WRITERS[version]
    teams = [team(each, version) for each in situation.teams]
    if version >= WITH_SUBSTITUTES:
        absent = {"penalty": code_of(version, Penalty.SUBSTITUTE)}
        for each, room in zip(teams, layout.players, strict=True):
            each["players"] += [absent] * (room - len(each["players"]))
    return encode(make_packet(layout, PACKET_MAGIC, _common(situation) | fields(situation), teams))


def _common(situation: Situation) -> Fields:
    return {
        "players_per_team": 1,
        "state": situation.phase.value,
        "first_half": int(situation.first_half),
        "seconds_remaining": min(situation.seconds_remaining, MOST_REMAINING),
    }


def _head_7(situation: Situation) -> Fields:
    striker = situation.teams[situation.striker]
    return {
        "kick_off": striker.colour,
        "secondary_state": situation.secondary.value,
        "seconds_remaining": situation.seconds_remaining,
        "drop_in_team": striker.colour,
        "drop_in_time": NO_DROP_IN,
        "penalty_shots": [_shots(team) for team in situation.teams],
        "sub_time": situation.phase_seconds,
    }


def _head_8(situation: Situation) -> Fields:
    striker = situation.teams[situation.striker]
    return {
        "packet_number": situation.packet_number % 256,
        "kick_off": striker.colour,
        "secondary_state": situation.secondary.value,
        "drop_in_team": striker.colour,
        "drop_in_time": NO_DROP_IN,
        "secondary_time": situation.phase_seconds,
    }


def _head_12(situation: Situation) -> Fields:
    number = situation.teams[situation.striker].number
    return _head_8(situation) | {"game_type": ADULT_SIZE, "kick_off": number, "drop_in_team": number}


def _head_18(situation: Situation) -> Fields:
    return {
        "packet_number": situation.packet_number % 256,
        "game_phase": situation.secondary.value,
        "kick_off": situation.teams[situation.striker].number,
        "secondary_time": situation.phase_seconds,
    }


def _head_19(situation: Situation) -> Fields:
    return _head_18(situation) | {"competition_type": LARGE, "stopped": int(situation.stopped)}


def _team(team: TeamSituation, version: int) -> Fields:
    """What every version tells of a team."""
    return {
        "number": team.number,
        "colour": team.colour,
        "score": team.score & 0xFF,
        "players": [_player(player, version) for player in team.players],
    }


def _team_7(team: TeamSituation, version: int) -> Fields:
    return _team(team, version) | {"goal_colour": YELLOW_GOAL}


def _team_8(team: TeamSituation, version: int) -> Fields:
    return _team(team, version) | {"penalty_shot": len(team.scored_trials), "single_shots": _shots(team)}


def _team_12(team: TeamSituation, version: int) -> Fields:
    fields = _team_8(team, version)
    if 1 <= team.goalkeeper <= len(team.players):
        fields["players"][team.goalkeeper - 1]["goalkeeper"] = 1
    return fields


def _team_18(team: TeamSituation, version: int) -> Fields:
    return _team_8(team, version) | {"goalkeeper_colour": team.colour, "goalkeeper": team.goalkeeper}


_WRITERS: Mapping[int, tuple[Callable[[Situation], Fields], Callable[[TeamSituation, int], Fields]]] = {
    7: (_head_7, _team_7),
    8: (_head_8, _team_8),
    12: (_head_12, _team_12),
    18: (_head_18, _team_18),
    19: (_head_19, _team_18),
    20: (_head_19, _team_18),
}


def _player(player: PlayerSituation, version: int) -> Fields:
    return {
        "penalty": code_of(version, *PENALTY_NAMES[player.removal]),
        "seconds": min(player.seconds, MOST_PENALTY[version]),
    }


def _shots(team: TeamSituation) -> int:
    """Return one bit a trial, set where it scored; trials beyond the fifth share the last bit."""
    bits = 0
    for index, scored in enumerate(team.scored_trials):
        bits |= scored << min(index, MOST_TRIALS - 1)
    return bits
