"""What the numbers of a packet stand for, in words that hold for every version."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tulip_strategy.game_controller.layout import Packet, Team
from tulip_strategy.interface import GamePhase, SecondaryState, SetPlay

PHASES: Mapping[int, GamePhase] = {phase.value: phase for phase in GamePhase}
# Standby comes before ready: robots stand and may look round, but a person's gesture (not understood here) or the
# packet of the ready state begins the game. It is told as the initial state, in which the robot stands.
PHASES_WITH_STANDBY: Mapping[int, GamePhase] = {**PHASES, 5: GamePhase.INITIAL}


@dataclass(frozen=True)
class Course:
    """How the game goes on.

    Attributes:
        kick_off: Whether a team has the kick-off or the set play.
        secondary: See `SecondaryState`.
        set_play: See `SetPlay`.
        stopped: Whether robots must not move, whatever the phase.
    """

    kick_off: bool
    secondary: SecondaryState
    set_play: SetPlay = SetPlay.NONE
    stopped: bool = False


@dataclass(frozen=True)
class Meaning:
    """How one version is read.

    Attributes:
        phases: By number of the packet's state.
        course: Tells the course of the game for a team.
        goalkeeper: Tells the number of a team's goalkeeper, 0 where the packet does not.
    """

    phases: Mapping[int, GamePhase]
    course: Callable[[Packet, Team], Course]
    goalkeeper: Callable[[Team], int]


_SECONDARY: Mapping[int, SecondaryState] = {state.value: state for state in SecondaryState}
_SET_PLAYS_12: Mapping[int, SetPlay] = {
    4: SetPlay.DIRECT_FREE_KICK,
    5: SetPlay.INDIRECT_FREE_KICK,
    6: SetPlay.PENALTY_KICK,
    7: SetPlay.CORNER_KICK,
    8: SetPlay.GOAL_KICK,
    9: SetPlay.THROW_IN,
}
_STILL_12 = frozenset({0, 2})  # of a set play: called, and about to be carried out; 1 is when robots take their places
_SET_PLAYS_18: Mapping[int, SetPlay] = {
    1: SetPlay.GOAL_KICK,
    2: SetPlay.DIRECT_FREE_KICK,  # for pushing
    3: SetPlay.CORNER_KICK,
    4: SetPlay.THROW_IN,
    5: SetPlay.PENALTY_KICK,
}
_SET_PLAYS_19: Mapping[int, SetPlay] = {
    1: SetPlay.DIRECT_FREE_KICK,
    2: SetPlay.INDIRECT_FREE_KICK,
    3: SetPlay.PENALTY_KICK,
    4: SetPlay.THROW_IN,
    5: SetPlay.GOAL_KICK,
    6: SetPlay.CORNER_KICK,
}


def _course_by_colour(packet: Packet, team: Team) -> Course:
    """Versions 7 and 8: a colour kicks off, and play is never interrupted."""
    return Course(packet.kick_off == team.colour, _secondary(packet.secondary_state))


def _course_12(packet: Packet, team: Team) -> Course:
    set_play = _SET_PLAYS_12.get(packet.secondary_state)
    if set_play is None:
        return Course(packet.kick_off == team.number, _secondary(packet.secondary_state))
    kicker, step, _, _ = packet.secondary_info
    return Course(kicker == team.number, SecondaryState.NORMAL, set_play, step in _STILL_12)


def _course_18(packet: Packet, team: Team) -> Course:
    set_play = _SET_PLAYS_18.get(packet.set_play, SetPlay.NONE)
    return Course(packet.kick_off == team.number, _secondary(packet.game_phase), set_play)


def _course_19(packet: Packet, team: Team) -> Course:
    set_play = _SET_PLAYS_19.get(packet.set_play, SetPlay.NONE)
    return Course(packet.kick_off == team.number, _secondary(packet.game_phase), set_play, packet.stopped != 0)


def _secondary(number: int) -> SecondaryState:
    return _SECONDARY.get(number, SecondaryState.NORMAL)


def _no_goalkeeper(team: Team) -> int:
    return 0


def _flagged_goalkeeper(team: Team) -> int:
    numbers = range(1, team.player_count + 1)
    return next((number for number in numbers if team.player(number).goalkeeper), 0)


def _told_goalkeeper(team: Team) -> int:
    return int(team.goalkeeper)


MEANINGS: dict[int, Meaning] = {
    7: Meaning(PHASES, _course_by_colour, _no_goalkeeper),
    8: Meaning(PHASES, _course_by_colour, _no_goalkeeper),
    12: Meaning(PHASES, _course_12, _flagged_goalkeeper),
    18: Meaning(PHASES_WITH_STANDBY, _course_18, _told_goalkeeper),
    19: Meaning(PHASES_WITH_STANDBY, _course_19, _told_goalkeeper),
    20: Meaning(PHASES_WITH_STANDBY, _course_19, _told_goalkeeper),
}
"""By version."""
