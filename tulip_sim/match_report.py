"""What happened in a match: a log for people, and the same as data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from tulip_sim.match_rules import COLOUR_NAMES


@dataclass(frozen=True)
class LogLine:
    """One line of the referee's log.

    Attributes:
        time: Of the match [s].
        trial: Its number, from 1 on.
        text: What happened.
        score: Goals of the two teams after it.
    """

    time: float
    trial: int
    text: str
    score: tuple[int, int]

    def __str__(self) -> str:
        minutes, seconds = divmod(self.time, 60.0)
        return f"{int(minutes):02d}:{seconds:04.1f}  {self.score[0]}:{self.score[1]}  {self.text}"


@dataclass(frozen=True)
class TrialRecord:
    """The end of one trial.

    Attributes:
        number: From 1 on.
        striker: Which team struck, 0 or 1.
        result: As in `tulip_sim.referee.Result`.
        seconds: Played until then.
        score: Goals of the two teams after it.
        falls: Of the striker and of the goalkeeper.
        removals: Of both together.
        striker_touches: How often the striker met the ball.
        keeper_touches: How often the goalkeeper did.
    """

    number: int
    striker: int
    result: str
    seconds: float
    score: tuple[int, int]
    falls: tuple[int, int]
    removals: int
    striker_touches: int
    keeper_touches: int


@dataclass
class MatchReport:
    """A match so far.

    Attributes:
        score: Goals of the two teams.
        trials: Those that have ended.
        log: Everything that the referee said.
        winner: 0 or 1; None for a draw, or while the match goes on.
        decided_by: "goals", "extra trials", "fewer seconds to goal" or "draw"; "" while the match goes on.
    """

    score: tuple[int, int] = (0, 0)
    trials: list[TrialRecord] = field(default_factory=list)
    log: list[LogLine] = field(default_factory=list)
    winner: int | None = None
    decided_by: str = ""

    @property
    def finished(self) -> bool:
        """Whether the match is over."""
        return bool(self.decided_by)

    @property
    def verdict(self) -> str:
        """How it ended, in words."""
        if not self.finished:
            return f"unfinished at {self.score[0]}:{self.score[1]}"
        who = "nobody wins" if self.winner is None else f"{COLOUR_NAMES[self.winner]} wins"
        return f"{self.score[0]}:{self.score[1]}, {who} ({self.decided_by})"

    def as_dict(self) -> dict[str, Any]:
        """Return everything for JSON."""
        return {**asdict(self), "verdict": self.verdict}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> MatchReport:
        """Return what `as_dict` was made from."""
        return cls(
            score=_pair(values["score"]),
            trials=[
                TrialRecord(**{**each, "score": _pair(each["score"]), "falls": _pair(each["falls"])})
                for each in values["trials"]
            ],
            log=[LogLine(**{**each, "score": _pair(each["score"])}) for each in values["log"]],
            winner=values["winner"],
            decided_by=values["decided_by"],
        )


def decide(report: MatchReport, rules_trials: int, extra_pairs: int) -> tuple[int | None, str] | None:
    """Return who has won and how, or None if another trial is to be played.

    A level score after the regular trials is followed by pairs of extra trials, until a pair brings a decision. Still
    level after the last pair, the team wins that took fewer seconds for its goals, all together; without goals, or
    with equal times, nobody does.

    Args:
        report: So far.
        rules_trials: Regular trials.
        extra_pairs: Of extra trials at most.
    """
    played = len(report.trials)
    extra = played - rules_trials
    if extra < 0 or extra % 2 == 1:
        return None
    first, second = report.score
    if first != second:
        return (0 if first > second else 1), "extra trials" if extra > 0 else "goals"
    if extra < 2 * extra_pairs:
        return None
    spent = [
        round(sum(each.seconds for each in report.trials if each.striker == team and each.result == "goal"), 3)
        for team in (0, 1)
    ]
    if spent[0] != spent[1]:
        return (0 if spent[0] < spent[1] else 1), "fewer seconds to goal"
    return None, "draw"


def _pair(values: Sequence[int]) -> tuple[int, int]:
    first, second = values
    return first, second
