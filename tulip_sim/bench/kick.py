"""Kicking a resting ball from standing."""

from __future__ import annotations

import math

import numpy as np

from tulip_description.planar import Pose2D
from tulip_motion.interface import KickGoal, MotionMode, Side
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row
from tulip_strategy.parameters import StrategyParameters

SEEDS = 5  # for each foot
WANTED = 2.0  # [m/s]
PLACE_ERROR = 0.015  # [m] standard deviation of the ball's place, as strategy leaves it


def measure(side: Side, seed: int) -> Row:
    """Kick once, with the ball where strategy lines up to it."""
    strategy, rng = StrategyParameters(), np.random.default_rng([seed, side])
    lateral = strategy.kick_lateral if side is Side.LEFT else -strategy.kick_lateral
    ahead, sideways = rng.normal((strategy.kick_ahead, lateral), PLACE_ERROR)
    body = Body(10 * seed + side, Pose2D(), (float(ahead), float(sideways)))
    body.go(0.5)
    refusal = body.motion.start_kick(KickGoal(side, speed=strategy.kick_speed))
    body.go(5.0)
    return {
        "foot": side.name.lower(),
        "seed": seed,
        "refusal": refusal,
        "upright": body.motion.mode is MotionMode.STAND,
        "ball speed [m/s]": round(body.ball_speed, 2),
        "direction [deg]": round(math.degrees(body.ball_direction), 1),
        "greatest tilt [rad]": round(body.greatest_tilt, 3),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return what came out."""
    speeds = [row["ball speed [m/s]"] for row in rows]
    good = sum(row["upright"] and row["ball speed [m/s]"] >= WANTED for row in rows)
    directions = np.array([row["direction [deg]"] for row in rows])
    return [
        f"From standing, ball at the place where strategy lines up, +-{1000 * PLACE_ERROR:.0f} mm;"
        " randomised as for walking.",
        "",
        "| kicks | upright and ball at 2 m/s or more | ball speed: least, median | direction: RMS | tilt, greatest |",
        "| --- | --- | --- | --- | --- |",
        f"| {len(rows)}, both feet | {good} of {len(rows)} | {min(speeds):.1f}, {np.median(speeds):.1f} m/s"
        f" | {np.sqrt((directions**2).mean()):.1f} deg | {max(row['greatest tilt [rad]'] for row in rows):.2f} rad |",
    ]


BENCH = Bench("kick", "Kicking", [(side, seed) for side in Side for seed in range(SEEDS)], measure, summarize)
