"""What a batch plays: a job is one parameter set and one seed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tulip_sim.batch.parameter_sets import make_match_settings, make_settings
from tulip_sim.lockstep import Settings
from tulip_sim.match_lockstep import play_lockstep
from tulip_sim.match_rules import COLOUR_NAMES
from tulip_sim.match_settings import MatchSettings
from tulip_sim.perception import PerceptionParameters
from tulip_sim.play_lockstep_match import play_lockstep_match
from tulip_sim.referee import Result
from tulip_sim.robot_stack import RobotSettings

Row = dict[str, Any]
"""Figures of one job by name; text, numbers, truth values or None."""


@dataclass(frozen=True)
class Play:
    """A kind of game that a batch can play.

    Attributes:
        run: Plays once, given seed, scenario and settings; returns its figures. A function of a module, so that other
            processes can call it.
        base: Makes the settings that parameter sets change, of a perception without pictures, or of None for cameras.
        change: Returns settings with some parameters changed, given by node and name; BadInputError if they do not fit.
        rates: Columns of truth values, by the words that the summary has for them.
        means: Columns of numbers, by those words; each with a column of truth values that a row must have set to count,
            or "" for all rows.
        has_scenario: Whether it begins as one of the scenarios says; else its own rules do.
    """

    run: Callable[[int, str, Any], Row]
    base: Callable[[PerceptionParameters | None], Any]
    change: Callable[[Mapping[str, Mapping[str, Any]], Any], Any]
    rates: Mapping[str, str] = field(default_factory=dict)
    means: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    has_scenario: bool = True


@dataclass(frozen=True)
class Job:
    """One game to play.

    Attributes:
        parameters: Name of the parameter set.
        seed: Of the scenario and of all noise.
    """

    parameters: str
    seed: int


@dataclass(frozen=True)
class Batch:
    """What all jobs have in common, and what tells them apart.

    Attributes:
        play: One of `PLAYS`.
        scenario: Name of the scenario, or "" for a play without.
        sets: Settings of the play, by the name of the parameter set.
        seeds: That each set plays with.
    """

    play: str
    scenario: str
    sets: Mapping[str, Any]
    seeds: Sequence[int]

    def jobs(self) -> list[Job]:
        """Return all jobs; sets take turns, so that a batch that was stopped has as many of each."""
        return [Job(name, seed) for seed in self.seeds for name in self.sets]

    def fingerprint(self) -> dict[str, Any]:
        """Return what results of the same batch have in common: not the seeds, so that more can be added."""
        sets = {name: hashlib.sha256(repr(settings).encode()).hexdigest()[:16] for name, settings in self.sets.items()}
        return {"play": self.play, "scenario": self.scenario, "sets": sets}


def play_trial(seed: int, scenario: str, settings: Settings) -> Row:
    """Play one trial of dribble and kick against the scenario's figure."""
    summary = play_lockstep(seed, scenario, settings)
    values = summary.as_dict()
    return {
        "outcome": summary.outcome,
        "scored": summary.scored,
        "fell": summary.falls > 0,
        **{
            name: values[name]
            for name in (
                "time",
                "touches",
                "falls",
                "distance_walked",
                "localization_error",
                "heading_error",
                "real_time_factor",
            )
        },
    }


def play_match(seed: int, scenario: str, settings: MatchSettings) -> Row:
    """Play one match of two robots."""
    summary = play_lockstep_match(seed, settings)
    report, errors = summary.report, summary.localization_errors
    goals = [trial for trial in report.trials if trial.result == Result.GOAL.value]
    return {
        "result": report.verdict,
        "decided_by": report.decided_by,
        **{f"{name}_goals": report.score[team] for team, name in enumerate(COLOUR_NAMES)},
        **{f"{name}_won": report.winner == team for team, name in enumerate(COLOUR_NAMES)},
        "trials": len(report.trials),
        "trials_with_goal": len(goals),
        "time_of_goals": sum(trial.seconds for trial in goals) / len(goals) if goals else None,
        "falls": summary.falls,
        "removals": summary.removals,
        "simulated_time": summary.duration,
        **{f"{name}_localization_error": errors[team] for team, name in enumerate(COLOUR_NAMES)},
        "real_time_factor": summary.real_time_factor,
    }


PLAYS: dict[str, Play] = {
    "trial": Play(
        play_trial,
        base=lambda perception: Settings(perception=perception),
        change=make_settings,
        rates={"goals": "scored", "trials with a fall": "fell"},
        means={
            "time to goal [s]": ("time", "scored"),
            "distance walked [m]": ("distance_walked", ""),
            "localization error [m]": ("localization_error", ""),
            "heading error [deg]": ("heading_error", ""),
            "real-time factor": ("real_time_factor", ""),
        },
    ),
    "match": Play(
        play_match,
        base=lambda perception: MatchSettings(robots=(RobotSettings(perception=perception),) * 2),
        change=make_match_settings,
        rates={f"matches won by {name}": f"{name}_won" for name in COLOUR_NAMES},
        means={
            **{f"goals of {name}": (f"{name}_goals", "") for name in COLOUR_NAMES},
            "trials": ("trials", ""),
            "time to goal, mean of a match [s]": ("time_of_goals", ""),
            "falls": ("falls", ""),
            "removals": ("removals", ""),
            **{f"localization error of {name} [m]": (f"{name}_localization_error", "") for name in COLOUR_NAMES},
            "real-time factor": ("real_time_factor", ""),
        },
        has_scenario=False,
    ),
}
"""What a batch can play, by name."""


def run_job(play: str, scenario: str, settings: Any, job: Job) -> Row:
    """Play one job and return its row; called in the processes that work."""
    return {"set": job.parameters, "seed": job.seed, **PLAYS[play].run(job.seed, scenario, settings)}
