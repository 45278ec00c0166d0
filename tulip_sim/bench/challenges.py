"""The two technical challenges, with camera and vision in lockstep: dribbling past obstacles, and the throw-in."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tulip_description.field import load_field
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.match_lockstep import play_lockstep
from tulip_sim.referee import RefereeParameters
from tulip_sim.scenario import make_scenario
from tulip_strategy.interface import UserRequest
from tulip_strategy.parameters import StrategyParameters

SEEDS = range(1, 21)
COURSE, THROW_IN = "dribble_course", "throw_in"
PATIENCE = 60.0  # [s] for a throw-in
AT_REST = 0.05  # [m/s]


def measure(part: str, seed: int) -> Row:
    """Try one of the challenges once."""
    return _dribble(seed) if part == COURSE else _throw_in(seed)


def _dribble(seed: int) -> Row:
    summary = play_lockstep(seed, COURSE, strategy=COURSE)
    return {
        "part": COURSE,
        "seed": seed,
        "outcome": summary.outcome,
        "time [s]": round(summary.time, 1),
        "touches": summary.touches,
        "falls": summary.falls,
    }


def _throw_in(seed: int) -> Row:
    field = load_field()
    scenario = make_scenario(THROW_IN, np.random.default_rng(seed), field)
    settings = Settings(referee=RefereeParameters(ends_when_ball_is_out=False))  # the ball begins at the line
    trial = Lockstep(scenario, seed, settings)
    kicked = rests = False
    try:
        trial.ask(UserRequest.PLAY, THROW_IN)
        while trial.referee.played < PATIENCE and not (kicked and rests):
            trial.step()
            kicked = "thrown in" in trial.doing
            rests = float(np.linalg.norm(trial.world.truth().ball_linear_velocity)) < AT_REST
        ball, played = trial.world.truth().ball_position, trial.referee.played
        falls = trial.referee.falls
    finally:
        trial.close()
    p = StrategyParameters()
    target = (p.throw_target_x, p.throw_target_y)
    return {
        "part": THROW_IN,
        "seed": seed,
        "time [s]": round(played, 1),
        "way [m]": round(math.dist(scenario.ball, target), 2),
        "miss [m]": round(math.dist(ball[:2], target), 2) if kicked else None,
        "falls": falls,
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return the figures of both."""
    lines = ["Camera, vision, localization, strategy and referee run as in the graph."]
    course = [row for row in rows if row["part"] == COURSE]
    if course:
        lines += ["", *_course(course)]
    throws = [row for row in rows if row["part"] == THROW_IN]
    if throws:
        lines += ["", *_throws(throws)]
    return lines


def _course(rows: Sequence[Row]) -> list[str]:
    times = [row["time [s]"] for row in rows if row["outcome"] == "goal"]
    ends = ", ".join(f"{row['outcome']} (seed {row['seed']})" for row in rows if row["outcome"] != "goal")
    middle = f", after {np.median(times):.0f} s (median)" if times else ""
    return [
        "Dribbling: three figures stand one after the other between ball and goal, each up to 0.8 m aside.",
        "",
        f"- goals: {len(times)} of {len(rows)}{middle}; other ends: {ends or 'none'}",
        f"- falls: {sum(row['falls'] for row in rows)}",
    ]


def _throws(rows: Sequence[Row]) -> list[str]:
    misses = [row["miss [m]"] for row in rows if row["miss [m]"] is not None]
    ways = [row["way [m]"] for row in rows]
    figures = "none"
    if misses:
        figures = f"median {np.median(misses):.2f} m, 90 % {np.percentile(misses, 90):.2f} m"
    return [
        "Throw-in: the ball lies at the touch line and shall come to rest in the middle of the field,"
        f" {min(ways):.1f} to {max(ways):.1f} m away. One kick.",
        "",
        f"- kicked: {len(misses)} of {len(rows)}; distance from the target at rest: {figures}",
        f"- falls: {sum(row['falls'] for row in rows)}",
    ]


TRIALS = [*((COURSE, seed) for seed in SEEDS), *((THROW_IN, seed) for seed in SEEDS)]
BENCH = Bench("challenges", "Technical challenges", TRIALS, measure, summarize)
