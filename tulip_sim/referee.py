"""The referee of a dribble-and-kick trial: judges from the ground truth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from tulip_description.field import Field
from tulip_sim.judging import SECOND, FallWatch, OutWatch, Verdict, in_goal, phase_after
from tulip_sim.referee_packets import PLAYERS, write_packet
from tulip_sim.situation import PlayerSituation, Removal, Situation, TeamSituation
from tulip_sim.truth import Truth
from tulip_strategy.game_controller import TeamColour, layout_of
from tulip_strategy.interface import GamePhase


@dataclass(frozen=True)
class RefereeParameters:
    """Times and rules of a trial."""

    initial_time: float = 1.0  # [s] short: nobody places robots by hand; a real game takes longer
    ready_time: float = 2.0  # [s] 30 in a real game
    set_time: float = 2.0  # [s] time enough to see the ball
    playing_time: float = 150.0  # [s] of a trial, by the rules of 2013
    packet_period: float = 0.5  # [s] 2 Hz, as the referee program sends
    ends_when_ball_is_out: bool = True  # as in dribble and kick; else the ball is expected to be put back
    lying_limit: float = 30.0  # [s] a robot that lies this long does not get up any more
    lying_tilt: float = 1.0  # [rad] of the trunk; no gait leans half as far
    team_number: int = 25
    player_number: int = 1
    team_colour: TeamColour = TeamColour.CYAN
    opponent_number: int = 12
    version: int = 7  # of the packets: 7, 8, 12, 18, 19 or 20

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of its range.
        """
        for name in ("initial_time", "ready_time", "set_time"):
            if not 0.0 <= getattr(self, name) < 3600.0:
                raise ValueError(f"{name} is {getattr(self, name)} s; expected 0 to 3600")
        for name in ("playing_time", "packet_period", "lying_limit"):
            if not 0.0 < getattr(self, name) < 36000.0:
                raise ValueError(f"{name} is {getattr(self, name)} s; expected > 0 and at most ten hours")
        if not 0.0 < self.lying_tilt < math.pi:
            raise ValueError(f"lying_tilt is {self.lying_tilt} rad; expected between 0 and pi")
        for name in ("team_number", "opponent_number"):
            if not 0 <= getattr(self, name) <= 255:
                raise ValueError(f"{name} is {getattr(self, name)}; expected 0 to 255")
        if self.team_number == self.opponent_number:
            raise ValueError(f"team_number and opponent_number are both {self.team_number}; expected two numbers")
        if not 1 <= self.player_number <= min(PLAYERS):
            raise ValueError(f"player_number is {self.player_number}; expected 1 to {min(PLAYERS)}")
        layout_of(self.version)  # refuses one that is not known
        if self.team_colour not in (TeamColour.CYAN, TeamColour.MAGENTA):
            raise ValueError(f"team_colour is {self.team_colour}; expected CYAN or MAGENTA")


class Result(Enum):
    """How a trial ended."""

    GOAL = "goal"
    OWN_GOAL = "own goal"
    OUT = "out"
    TIME = "time"
    FALLEN = "fallen"
    LEFT = "striker left the field"
    HELD = "held"


@dataclass(frozen=True)
class Outcome:
    """The end of a trial.

    Attributes:
        result: See `Result`.
        seconds: Played until then [s].
        foot_touches: How often a foot met the ball.
        body_touches: How often another part of the robot did.
        keeper_touches: How often the keeper did.
        falls: How often the robot went from upright to lying.
    """

    result: Result
    seconds: float
    foot_touches: int
    body_touches: int
    keeper_touches: int
    falls: int


class Referee:
    """Runs one trial after the other and keeps the score. Give it the truth at every control tick."""

    def __init__(self, parameters: RefereeParameters, field: Field) -> None:
        self._parameters = parameters
        self._field = field
        self._score = [0, 0]
        self._scored: list[bool] = []
        self._packets = 0
        self._begin: int | None = None
        self.restart()

    def restart(self) -> None:
        """Begin a new trial with the next truth; the score stays. Its stamps may begin anew."""
        self._begin = None
        self._now = 0
        self._next_packet = 0
        self._told: GamePhase | None = None
        self._outcome: Outcome | None = None
        self._fall_watch = FallWatch(self._parameters.lying_tilt)
        self._out_watch = OutWatch(self._field)
        self._penalty: tuple[Removal, int] | None = None

    @property
    def outcome(self) -> Outcome | None:
        """How the trial ended, None while it runs."""
        return self._outcome

    @property
    def score(self) -> tuple[int, int]:
        """Goals of the striker's team and of the other."""
        return self._score[0], self._score[1]

    @property
    def outs(self) -> int:
        """How often the ball left the field during play."""
        return self._out_watch.count

    @property
    def falls(self) -> int:
        """How often the robot fell since the trial's start."""
        return self._fall_watch.falls

    @property
    def lying(self) -> bool:
        """Whether the robot lies on the ground."""
        return self._fall_watch.since is not None

    @property
    def phase(self) -> GamePhase:
        """The game's phase at the last truth."""
        if self._outcome is not None:
            return GamePhase.FINISHED
        p = self._parameters
        return phase_after(self._elapsed(), p.initial_time, p.ready_time, p.set_time)

    @property
    def played(self) -> float:
        """Time since the beginning of play [s]; what it was at the end once the trial is over."""
        return self._outcome.seconds if self._outcome is not None else self._playing_time()

    def verdict(self) -> Verdict:
        """Return what there is to say about the robot now."""
        outcome = "" if self._outcome is None else self._outcome.result.value
        return Verdict(outcome, self.score, self.lying, self.falls, self.played)

    def remove(self, reason: Removal, seconds: float) -> None:
        """Take the striker out of play for a time [s]; `Removal.NONE` sets it back in."""
        self._penalty = None if reason is Removal.NONE else (reason, self._now + round(seconds * SECOND))

    def update(self, truth: Truth) -> bytes | None:
        """Judge what is, and return the packet that is due, if one is."""
        if self._begin is None:
            self._begin = self._next_packet = truth.stamp
        self._now = truth.stamp
        if self._penalty is not None and self._now >= self._penalty[1]:
            self._penalty = None
        self._fall_watch.see(truth.base_orientation, truth.stamp)
        if self.phase is GamePhase.PLAYING:
            self._judge(truth)
        if self._now < self._next_packet and self.phase is self._told:
            return None
        self._told = self.phase
        while self._next_packet <= self._now:
            self._next_packet += round(self._parameters.packet_period * SECOND)
        packet = write_packet(self.situation(), self._parameters.version)
        self._packets += 1
        return packet

    def situation(self) -> Situation:
        """Return the game as it is now."""
        parameters = self._parameters
        own = TeamColour(parameters.team_colour)
        other = TeamColour.CYAN if own is TeamColour.MAGENTA else TeamColour.MAGENTA
        players = [PlayerSituation()] * parameters.player_number
        if self._penalty is not None:
            reason, until = self._penalty
            players[-1] = PlayerSituation(reason, math.ceil((until - self._now) / SECOND))
        return Situation(
            phase=self.phase,
            first_half=True,
            striker=0,
            seconds_remaining=math.ceil(parameters.playing_time - self.played),
            phase_seconds=math.ceil(self._phase_left()),
            teams=(
                TeamSituation(parameters.team_number, own, self._score[0], tuple(players), tuple(self._scored)),
                TeamSituation(parameters.opponent_number, other, self._score[1], (PlayerSituation(),)),
            ),
            packet_number=self._packets,
        )

    def _elapsed(self) -> float:
        return 0.0 if self._begin is None else (self._now - self._begin) / SECOND

    def _preparation(self) -> float:
        return self._parameters.initial_time + self._parameters.ready_time + self._parameters.set_time

    def _playing_time(self) -> float:
        return max(0.0, self._elapsed() - self._preparation())

    def _phase_left(self) -> float:
        """Time left of the ready or set phase [s], else 0."""
        parameters, phase = self._parameters, self.phase
        if phase is GamePhase.READY:
            return parameters.initial_time + parameters.ready_time - self._elapsed()
        return self._preparation() - self._elapsed() if phase is GamePhase.SET else 0.0

    def _judge(self, truth: Truth) -> None:
        """End the trial if the rules do now."""
        ball, field = truth.ball_position, self._field
        if in_goal(ball, field.opponent_goal, field):
            self._score[0] += 1
            self._end(Result.GOAL, truth)
        elif in_goal(ball, field.own_goal, field):
            self._score[1] += 1
            self._end(Result.OWN_GOAL, truth)
        elif self._out_watch.leaves(ball) and self._parameters.ends_when_ball_is_out:
            self._end(Result.OUT, truth)
        elif self._fall_watch.lying_for(truth.stamp) >= self._parameters.lying_limit:
            self._end(Result.FALLEN, truth)
        elif self._playing_time() >= self._parameters.playing_time:
            self._end(Result.TIME, truth)

    def _end(self, result: Result, truth: Truth) -> None:
        self._outcome = Outcome(
            result,
            self._playing_time(),
            sum(truth.foot_touches),
            truth.body_touches,
            truth.keeper_touches,
            self.falls,
        )
        self._scored.append(result is Result.GOAL)
