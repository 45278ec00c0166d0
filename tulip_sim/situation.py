"""The game as a referee sees it, whatever protocol tells the robots of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

from tulip_strategy.game_controller import TeamColour
from tulip_strategy.interface import GamePhase, SecondaryState


class Removal(Enum):
    """Why a robot is out of play."""

    NONE = auto()
    INACTIVE = auto()
    """It fell and did not get up."""
    LEFT_FIELD = auto()
    MANUAL = auto()
    """By the referee's hand, for a reason that the rules here do not know."""


@dataclass(frozen=True)
class PlayerSituation:
    """One robot.

    Attributes:
        removal: See `Removal`.
        seconds: Until it may play again, rounded up [s].
    """

    removal: Removal = Removal.NONE
    seconds: int = 0


@dataclass(frozen=True)
class TeamSituation:
    """One team.

    Attributes:
        number: The team's own number.
        colour: Of its markers.
        score: Goals.
        players: In order of their numbers, from 1 on.
        scored_trials: One entry a finished trial as striker: whether it scored.
        goalkeeper: Player number of the goalkeeper, 0 for none.
    """

    number: int
    colour: TeamColour
    score: int
    players: tuple[PlayerSituation, ...]
    scored_trials: tuple[bool, ...] = ()
    goalkeeper: int = 0


@dataclass(frozen=True)
class Situation:
    """One instant of a game of dribble and kick.

    Attributes:
        phase: See `GamePhase`.
        first_half: Whether it is the first half.
        striker: Which of the two teams has the kick-off, 0 or 1.
        seconds_remaining: Of the trial [s].
        phase_seconds: Of the ready or set phase, else 0 [s].
        teams: The two teams, in an order that never changes.
        packet_number: Of packets sent before this one.
        secondary: What kind of game it is told as; a penalty shoot-out is the nearest to dribble and kick.
        stopped: The game is interrupted: robots must not move. Versions 19 and 20 alone tell it.
    """

    phase: GamePhase
    first_half: bool
    striker: int
    seconds_remaining: int
    phase_seconds: int
    teams: tuple[TeamSituation, TeamSituation]
    packet_number: int = 0
    secondary: SecondaryState = SecondaryState.PENALTY_SHOOT
    stopped: bool = False
