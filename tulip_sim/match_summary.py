"""What happened in a match, in numbers and words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from tulip_sim.match_report import MatchReport
from tulip_sim.match_rules import COLOUR_NAMES, TEAMS


@dataclass(frozen=True)
class MatchSummary:
    """The end of a match.

    Attributes:
        mode: "graph" or "lockstep", and what else is special.
        seed: Of all that is random.
        report: Of the referee.
        duration: Simulated time [s].
        localization_errors: Of both robots during play: RMS of the estimated position against the truth [m].
        real_time_factor: Simulated time by wall-clock time.
        recording: The MCAP file, or "".
    """

    mode: str
    seed: int
    report: MatchReport
    duration: float
    localization_errors: tuple[float, float]
    real_time_factor: float
    recording: str = ""

    @property
    def falls(self) -> int:
        """Of both robots in all trials."""
        return sum(sum(trial.falls) for trial in self.report.trials)

    @property
    def removals(self) -> int:
        """How often a robot was taken out."""
        return sum(trial.removals for trial in self.report.trials)

    def as_dict(self) -> dict[str, Any]:
        """Return everything for JSON; numbers that are not known are None."""
        return {
            "mode": self.mode,
            "seed": self.seed,
            "duration": self.duration,
            "falls": self.falls,
            "removals": self.removals,
            "localization_errors": [None if math.isnan(error) else error for error in self.localization_errors],
            "real_time_factor": self.real_time_factor,
            "recording": self.recording,
            "report": self.report.as_dict(),
        }

    def lines(self) -> list[tuple[str, str]]:
        """Return names and values for people."""
        goals = {team: [each for each in self.report.trials if each.striker == team] for team in TEAMS}
        told = [
            (
                f"{COLOUR_NAMES[team]} as striker",
                ", ".join(f"{each.result} {each.seconds:.0f} s" for each in trials) or "no trial",
            )
            for team, trials in goals.items()
        ]
        errors = " and ".join(f"{error:.2f} m" for error in self.localization_errors)
        return [
            *told,
            ("simulated time", f"{self.duration:.0f} s"),
            ("falls, removals", f"{self.falls}, {self.removals}"),
            ("localization error", f"{errors} (RMS)"),
            ("real-time factor", f"{self.real_time_factor:.2f}"),
            ("recording", self.recording or "none"),
        ]
