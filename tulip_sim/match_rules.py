"""Rules and times of a match between two robots; docs/match.md says which are known and which are assumed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from tulip_sim.referee_packets import PLAYERS
from tulip_strategy.game_controller import TeamColour, layout_of

TEAMS = (0, 1)
COLOURS = (TeamColour.CYAN, TeamColour.MAGENTA)
"""Of the two teams, which never change. The first attacks the goal at +x of the world's map, the second that at -x."""
COLOUR_NAMES = ("cyan", "magenta")


class Role(Enum):
    """What a robot does in a trial."""

    STRIKER = "striker"
    KEEPER = "keeper"


NAMESPACES = ("striker", "keeper")
"""Of the two robots on topics: what each is in the first trial."""
STRATEGY_OF = {Role.STRIKER: "dribble_and_kick", Role.KEEPER: "goalkeeper"}
"""Names of the strategies that robots are told to play, unless others are chosen."""


@dataclass(frozen=True)
class MatchRules:
    """Times and rules of a match."""

    trials: int = 10  # five a side by the rules of 2013, in turns
    extra_pairs: int = 2  # of trials at most, one a side each, while the score is level
    initial_time: float = 1.5  # [s] of a trial, in which people put robots and ball down; a real game takes longer
    ready_time: float = 1.0  # [s] 30 in a real game
    set_time: float = 2.5  # [s] time enough to see the ball
    playing_time: float = 150.0  # [s] of a trial, by the rules of 2013
    finished_time: float = 3.5  # [s] between two trials: a kick that is under way ends
    packet_period: float = 0.5  # [s] 2 Hz, as the referee program sends
    lying_limit: float = 20.0  # [s] for a robot that fell to get up
    lying_tilt: float = 1.0  # [rad] of the trunk; no gait leans half as far
    hands_time: float = 1.0  # [s] for people to set a robot down; it is not judged meanwhile
    removal_time: float = 30.0  # [s] out of play
    most_removals: int = 1  # of the striker in one trial; the next one ends the trial
    leave_margin: float = 0.5  # [m] beyond the outer lines; a robot behind a ball at the line stands 0.3 m outside
    keeper_margin: float = 0.3  # [m] by which the keeper may leave its goal area before the ball has moved
    ball_moved: float = 0.15  # [m] from its place
    held_reach: float = 0.45  # [m] from the keeper to a ball that it holds
    held_speed: float = 0.05  # [m/s] of a ball that rests
    held_time: float = 10.0  # [s] of a ball at rest at the keeper's feet
    team_numbers: tuple[int, int] = (25, 12)
    player_number: int = 1  # of both robots
    version: int = 7  # of the packets; see docs/referee.md

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of its range.
        """
        for name in ("initial_time", "ready_time", "set_time", "finished_time", "hands_time"):
            if not 0.0 <= getattr(self, name) < 3600.0:
                raise ValueError(f"{name} is {getattr(self, name)} s; expected 0 to 3600")
        for name in ("playing_time", "packet_period", "lying_limit", "removal_time", "held_time"):
            if not 0.0 < getattr(self, name) < 36000.0:
                raise ValueError(f"{name} is {getattr(self, name)} s; expected > 0 and at most ten hours")
        for name in ("leave_margin", "keeper_margin", "ball_moved", "held_reach", "held_speed"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} is {getattr(self, name)}; expected a finite number > 0")
        if not 0.0 < self.lying_tilt < math.pi:
            raise ValueError(f"lying_tilt is {self.lying_tilt} rad; expected between 0 and pi")
        if self.trials < 1 or self.extra_pairs < 0 or self.most_removals < 0:
            raise ValueError(
                f"trials is {self.trials}, extra_pairs {self.extra_pairs}, most_removals {self.most_removals};"
                " expected at least 1, 0 and 0"
            )
        first, second = self.team_numbers
        if not (0 <= first <= 255 and 0 <= second <= 255 and first != second):
            raise ValueError(f"team_numbers is {self.team_numbers}; expected two different ones from 0 to 255")
        layout_of(self.version)  # refuses one that is not known
        if not 1 <= self.player_number <= min(PLAYERS):
            raise ValueError(f"player_number is {self.player_number}; expected 1 to {min(PLAYERS)}")


def striker_of(trial: int) -> int:
    """Return which team strikes in a trial, counted from 1: the first one in the odd trials."""
    return (trial - 1) % 2
