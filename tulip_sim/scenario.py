"""What stands where when a trial begins."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tulip_description.field import Field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_sim.keeper import Keeper


@dataclass(frozen=True)
class Scenario:
    """The start of a trial, in map. The robot attacks the goal at +x.

    Attributes:
        robot: Pose of the robot's base_footprint.
        ball: x, y of the ball on the ground [m].
        keeper: The opponent's goalkeeper, or None.
        poles: Whether the field's landmark poles stand.
        obstacles: Where figures like the keeper's stand for the robot to go round, in map.
        others: Poses of further robots, each with a body of its own.
    """

    robot: Pose2D
    ball: tuple[float, float]
    keeper: Keeper | None = None
    poles: bool = True
    obstacles: tuple[Pose2D, ...] = ()
    others: tuple[Pose2D, ...] = ()

    def __post_init__(self) -> None:
        """Check that the numbers are finite.

        Raises:
            ValueError: if one is not.
        """
        others = tuple(("others", (pose.x, pose.y, pose.yaw)) for pose in self.others)
        for name, values in (("robot", (self.robot.x, self.robot.y, self.robot.yaw)), ("ball", self.ball), *others):
            if not all(math.isfinite(value) for value in values):
                raise ValueError(f"{name} is {values}; expected finite numbers")


BALL_DISTANCE = (0.5, 3.0)  # [m] from the robot
HEADING_SPREAD = math.radians(45.0)  # to either side of the direction to the goal
LINE_MARGIN = 0.3  # [m] the ball starts this far inside the outer lines at least
THROW_IN_INSIDE = 0.1  # [m] of the touchline, where the ball is set down
THROW_IN_ROOM = 1.0  # [m] from a pole: there has to be room for a robot behind the ball
COURSE = (-1.0, 0.8, 2.6)  # [m] x of the obstacles in map
KEEPER_AHEAD = 0.3  # [m] in front of the goal line
KEEPER_HALF_WIDTH = 0.3  # [m] of the figure
KEEPER_OFF_CENTRE = (0.25, 0.75)  # [m] to either side


def random_trial(rng: np.random.Generator, field: Field) -> Scenario:
    """Return a random start of a dribble-and-kick trial.

    The robot stands in its own half, turned at most 45 degrees away from the opponent's goal; the ball lies 0.5 to 3 m
    away in any direction, inside the field; the keeper stands off-centre before the goal at +x.
    """
    x = rng.uniform(-field.length / 2 + 1.0, -0.5)
    y = rng.uniform(-field.width / 2 + 1.0, field.width / 2 - 1.0)
    to_goal = math.atan2(-y, field.length / 2 - x)
    robot = Pose2D(x, y, wrap_angle(to_goal + rng.uniform(-HEADING_SPREAD, HEADING_SPREAD)))
    while True:  # a ball in front of the robot always fits, so this ends
        distance, direction = rng.uniform(*BALL_DISTANCE), rng.uniform(-math.pi, math.pi)
        ball = (x + distance * math.cos(direction), y + distance * math.sin(direction))
        if abs(ball[0]) < field.length / 2 - LINE_MARGIN and abs(ball[1]) < field.width / 2 - LINE_MARGIN:
            break
    side = 1.0 if rng.random() < 0.5 else -1.0
    keeper_y = side * rng.uniform(*KEEPER_OFF_CENTRE)
    keeper = Keeper(Pose2D(field.opponent_goal.x - KEEPER_AHEAD, keeper_y, -math.pi))
    return Scenario(robot, ball, keeper, poles=bool(field.poles))


def trial_against_moving_keeper(rng: np.random.Generator, field: Field) -> Scenario:
    """Return a random trial whose keeper follows the ball along the goal line, from post to post."""
    trial = random_trial(rng, field)
    assert trial.keeper is not None
    return replace(trial, keeper=replace(trial.keeper, follows=0.5 * field.goal_width - KEEPER_HALF_WIDTH))


def open_play(rng: np.random.Generator, field: Field) -> Scenario:
    """Return the robot in its own half with the ball a metre before it, and no opponent."""
    return Scenario(Pose2D(-2.0, 0.0, 0.0), (-1.0, 0.0), poles=bool(field.poles))


def throw_in(rng: np.random.Generator, field: Field) -> Scenario:
    """Return the technical challenge: the ball beside a touchline, the robot somewhere in the field, nobody else."""
    side = 1.0 if rng.random() < 0.5 else -1.0
    ball = (rng.uniform(-2.0, 2.0), side * (0.5 * field.width - THROW_IN_INSIDE))
    while any(math.dist(ball, (pole.x, pole.y)) < THROW_IN_ROOM for pole in field.poles):
        ball = (rng.uniform(-2.0, 2.0), ball[1])
    robot = Pose2D(ball[0] + rng.uniform(-1.5, 1.5), side * rng.uniform(0.0, 1.0), side * math.pi / 2.0)
    return Scenario(robot, ball, poles=bool(field.poles))


def dribble_course(rng: np.random.Generator, field: Field) -> Scenario:
    """Return the technical challenge: three obstacles, one after the other, between the ball and the goal."""
    obstacles = []
    for x in COURSE:
        obstacles.append(Pose2D(x, rng.uniform(-0.8, 0.8), math.pi))
    return Scenario(Pose2D(-3.4, 0.0, 0.0), (-2.6, 0.0), poles=bool(field.poles), obstacles=tuple(obstacles))


SCENARIOS: dict[str, Callable[[np.random.Generator, Field], Scenario]] = {
    "trial": random_trial,
    "trial_moving_keeper": trial_against_moving_keeper,
    "open": open_play,
    "throw_in": throw_in,
    "dribble_course": dribble_course,
}
"""Scenarios by name."""


def make_scenario(name: str, rng: np.random.Generator, field: Field) -> Scenario:
    """Return a scenario by name, drawn from rng.

    Raises:
        ValueError: if there is none of that name.
    """
    if name not in SCENARIOS:
        raise ValueError(f"scenario is {name!r}; expected one of {', '.join(SCENARIOS)}")
    return SCENARIOS[name](rng, field)
