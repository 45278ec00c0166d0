"""Shots at the own goal, of which each would go in if nobody stood there, and what becomes of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tulip_description.field import Field, load_field
from tulip_description.planar import Pose2D
from tulip_sim.keeper import Keeper
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.parameters import WorldParameters
from tulip_sim.referee import Result
from tulip_sim.scenario import Scenario
from tulip_sim.timing import TICK
from tulip_sim.world import World
from tulip_strategy.interface import UserCommand, UserRequest

DISTANCE = 3.0  # [m] from the middle of the goal
ASIDE = math.radians(40.0)  # to either side of straight before the goal
SPEED = (1.0, 2.0)  # [m/s]
INSIDE = 0.1  # [m] beside the post, for the middle of a ball that is shot at a goal
BEFORE = 10.0  # [s] of play before the shot, for the keeper to find ball and place
AFTER = 6.0  # [s] until a shot of 1 m/s has come to rest
AWAY = Pose2D(30.0, 20.0, 0.0)  # where a robot that has no part stands
IN_GOAL = Pose2D(-4.2, 0.0, 0.0)  # where the keeper is put down


@dataclass(frozen=True)
class Shot:
    """One shot.

    Attributes:
        ball: Where the ball lies before [m], in map.
        velocity: Given to it [m/s].
    """

    ball: tuple[float, float]
    velocity: tuple[float, float]


def draw_shot(seed: int) -> Shot:
    """Return a random shot that goes in on an empty field: slower ones stop before the line and are drawn again."""
    rng, field = np.random.default_rng([seed, 5]), load_field()
    goal = field.own_goal
    while True:
        aside = rng.uniform(-ASIDE, ASIDE)
        ball = (goal.x + DISTANCE * math.cos(aside), DISTANCE * math.sin(aside))
        most = 0.5 * goal.width - field.ball_radius - INSIDE
        way = (goal.x - ball[0], rng.uniform(-most, most) - ball[1])
        speed = rng.uniform(*SPEED) / math.hypot(*way)
        shot = Shot(ball, (speed * way[0], speed * way[1]))
        if goes_in(shot, field, seed, None):
            return shot


def goes_in(shot: Shot, field: Field, seed: int, figure: Pose2D | None) -> bool:
    """Tell whether a shot ends in the goal, with nobody there or with a figure that stands still."""
    keeper = None if figure is None else Keeper(figure)
    world = World(Scenario(AWAY, shot.ball, keeper, poles=False), WorldParameters(), seed, field)
    try:
        world.place_ball(*shot.ball, *shot.velocity)
        world.advance(round(1000 * AFTER))
        return is_in(world.truth().ball_position, field)
    finally:
        world.close()


def is_in(ball: np.ndarray, field: Field) -> bool:
    """Tell whether the ball, (3,) in map [m], lies in the own goal."""
    goal = field.own_goal
    beyond = goal.outward * (float(ball[0]) - goal.x)
    return beyond > field.ball_radius and abs(float(ball[1])) < 0.5 * goal.width


def keep(shot: Shot, seed: int, settings: Settings | None = None) -> tuple[bool, bool, int]:
    """Let the goalkeeper play, then shoot; return whether the ball was kept out, whether it fell, and its touches."""
    trial = Lockstep(Scenario(IN_GOAL, shot.ball), seed, settings)
    trial.user = UserCommand(0, UserRequest.PLAY, "goalkeeper")
    try:
        for _ in range(round(1000 * BEFORE) // TICK):
            trial.step()
        trial.world.place_ball(*shot.ball, *shot.velocity)
        for _ in range(round(1000 * AFTER) // TICK):
            trial.step()
            if trial.referee.outcome is not None:
                break
        outcome = trial.referee.outcome
        truth = trial.world.truth()
        touches = sum(truth.foot_touches) + truth.body_touches
        kept = outcome is None or outcome.result is not Result.OWN_GOAL
        return kept, trial.referee.falls > 0, touches
    finally:
        trial.close()
