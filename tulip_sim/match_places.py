"""Where people put robots and ball in a match. All poses are in the world's map unless said otherwise.

Each team has a map of its own, in which it attacks the goal at +x. The first team's is the world's map, the second
team's is turned by half a circle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tulip_description.field import Field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_sim.truth import Truth
from tulip_sim.world import World

Point = tuple[float, float]
BEHIND = (0.8, 1.8)  # [m] from the striker to the ball
BEHIND_SPREAD = math.radians(60.0)  # to either side of straight behind
STRIKER_X, STRIKER_Y = (-1.5, -0.3), (-1.2, 1.2)  # [m] in its own map: in its own half, with room for the ball behind
HEADING_SPREAD = math.radians(20.0)  # to either side of the direction to the goal
BALL_MARGIN = 0.5  # [m] from the outer lines to the ball at least
KEEPER_AHEAD = 0.35  # [m] of the goal line: the heels of a robot that stands between the posts
OUTSIDE = 0.45  # [m] beyond the touch line, where a removed robot waits; the border is 0.7 m wide
CLEARANCE = 0.9  # [m] between two robots, or from a robot to a pole, where somebody puts one down
STEP = 0.3  # [m] along the line to the next place that is tried


def turned(pose: Pose2D) -> Pose2D:
    """Return a pose of one team's map in the other team's."""
    return Pose2D(-pose.x, -pose.y, wrap_angle(pose.yaw + math.pi))


def in_map_of(team: int, pose: Pose2D) -> Pose2D:
    """Return a pose in the map of team 0 or 1, given in the world's map; the other way round it is the same."""
    return pose if team == 0 else turned(pose)


def team_truth(world: World, team: int) -> Truth:
    """Return what really is about a team's robot, in the team's own map."""
    truth = world.truth(team)
    return truth if team == 0 else truth.turned()


def striker_and_ball(rng: np.random.Generator, team: int, field: Field) -> tuple[Pose2D, Point]:
    """Return where a trial's striker and its ball are put: the ball behind the robot, which looks to the goal.

    Args:
        rng: What is random; with the same draws both teams get the same start, each in its own map.
        team: Who strikes.
        field: Played on.
    """
    x, y = float(rng.uniform(*STRIKER_X)), float(rng.uniform(*STRIKER_Y))
    to_goal = math.atan2(-y, field.length / 2.0 - x)
    robot = Pose2D(x, y, wrap_angle(to_goal + float(rng.uniform(-HEADING_SPREAD, HEADING_SPREAD))))
    while True:  # straight behind, less than 1.8 m away, there is room everywhere
        distance = float(rng.uniform(*BEHIND))
        direction = robot.yaw + math.pi + float(rng.uniform(-BEHIND_SPREAD, BEHIND_SPREAD))
        ball = Pose2D(x + distance * math.cos(direction), y + distance * math.sin(direction), 0.0)
        if abs(ball.x) < field.length / 2.0 - BALL_MARGIN and abs(ball.y) < field.width / 2.0 - BALL_MARGIN:
            break
    ball = in_map_of(team, ball)
    return in_map_of(team, robot), (ball.x, ball.y)


def keeper_place(team: int, field: Field) -> Pose2D:
    """Return where a team's goalkeeper begins: in the middle of its goal, looking to the field."""
    return in_map_of(team, Pose2D(field.own_goal.x + KEEPER_AHEAD, 0.0, 0.0))


def beside_touch_line(x: float, y: float, outside: float, occupied: Sequence[Point], field: Field) -> Pose2D:
    """Return a free place beside the touch line, looking to the field.

    Args:
        x: Where the robot was [m].
        y: Of which the sign says which touch line is meant [m].
        outside: Beyond the line [m].
        occupied: What stands or lies about [m].
        field: Played on.
    """
    side = 1.0 if y >= 0.0 else -1.0
    limit = field.length / 2.0 - 1.0
    line = side * (field.width / 2.0 + outside)
    wanted = max(-limit, min(limit, x))
    things = [*occupied, *((pole.x, pole.y) for pole in field.poles)]
    tries = [wanted + sign * STEP * count for count in range(round(2.0 * limit / STEP)) for sign in (1.0, -1.0)]
    free = [place for place in tries if abs(place) <= limit and _is_free(place, line, things)]
    return Pose2D(free[0] if free else wanted, line, -side * math.pi / 2.0)


def _is_free(x: float, y: float, things: Sequence[Point]) -> bool:
    return all(math.dist((x, y), thing) >= CLEARANCE for thing in things)
