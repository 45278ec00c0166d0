"""The field from above: where robot, ball and opponents were, and where the robot believed them to be."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tulip_description.field import Field
from tulip_ros import topics
from tulip_view.ellipse import LARGEST, SIGMAS, TURN, ball_ellipse, robot_ellipse
from tulip_view.recording import Recording
from tulip_view.report.figures import (
    BLACK,
    BLUE,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    Array,
    Figure,
    LeftOut,
    Line,
    Section,
    thin,
)

TITLE = "The field"
ELLIPSE_PERIOD = 5.0  # [s] between two ellipses
WHITE = "#ffffff"
TURF = "#4a8f4a"
PALE_TURF = "#a9c9a4"
"""Of the diagram: dark lines can be told apart on it."""
RING = 0.07  # [m] radius
JUMP = 0.5  # [m] between two samples: somebody has set it down elsewhere, and no path leads there


def field_paths(recording: Recording, field: Field) -> Section:
    """Return the section.

    Raises:
        LeftOut: if the recording holds neither truth nor world state.
    """
    truth, world = recording.get(topics.GROUND_TRUTH), recording.get(topics.WORLD_STATE)
    if truth is None and world is None:
        raise LeftOut(TITLE, "neither ground_truth nor world_state is recorded")
    x, y = field.carpet_length / 2.0, field.carpet_width / 2.0
    figure = Figure("field", "Paths in the map", "x [m]", "y [m]", equal=True, time=False, height=760)
    figure.x_range, figure.y_range = (-x, x), (-y, y)
    figure.items += ground_lines(field, PALE_TURF)
    ends: list[Line] = []
    if truth is not None:
        poses = np.array([(m.robot.position.x, m.robot.position.y) for m in truth.messages])
        balls = np.array([(m.ball.position.x, m.ball.position.y) for m in truth.messages])
        keepers = np.array(
            [
                (m.keeper.position.x, m.keeper.position.y) if m.keeper_present else (np.nan, np.nan)
                for m in truth.messages
            ]
        )
        figure.items.append(path("robot, truth", poses, BLACK))
        figure.items.append(path("ball, truth", balls, ORANGE))
        if np.isfinite(keepers).any():
            figure.items.append(path("opponent, truth", keepers, PURPLE))
        for places, colour in ((poses, BLACK), (balls, ORANGE), (keepers, PURPLE)):
            known = places[np.isfinite(places).all(axis=1)]
            if len(known):  # where the path ends; of somebody who stands still it is all that there is
                ends.append(Line("", known[-1:, 0], known[-1:, 1], colour, points=True, width=10))
                ends.append(Line("", *_ring(known[0]), colour, width=2.0))
    if world is not None:
        estimate = np.array([m.robot_pose[:2] for m in world.messages])
        figure.items.append(path("robot, estimate", estimate, BLUE, dashed=True))
        balls = np.array([m.ball.position_in_map if m.ball_known else (np.nan, np.nan) for m in world.messages])
        figure.items.append(path("ball, estimate", balls, RED, dashed=True))
        seen = np.array([each.position_in_map for m in world.messages for each in m.opponents]).reshape(-1, 2)
        if len(seen):
            (sx, sy) = thin(seen[:, 0], seen[:, 1], most=600)
            figure.items.append(Line("opponent, estimate", sx, sy, SKY, points=True, width=3))
        figure.items += _ellipses(world.times, world.messages)
    figure.items += ends
    words = ["Rings: where the true paths begin. Dots: where they end."] if truth is not None else []
    if world is not None:
        words.append(
            f"Ellipses: {SIGMAS:g} sigma of the estimates, every {ELLIPSE_PERIOD:g} s; those larger than "
            f"{LARGEST:g} m are left out, and good estimates have some that are smaller than the lines."
        )
    return Section("fieldpaths", TITLE, words, [figure])


def _ring(centre: Array) -> tuple[Array, Array]:
    return centre[0] + RING * np.cos(TURN), centre[1] + RING * np.sin(TURN)


def ground_lines(field: Field, turf: str = TURF) -> list[Line]:
    """Return carpet, lines, circle, marks and goals."""
    x, y = field.carpet_length / 2.0, field.carpet_width / 2.0
    carpet = np.array([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)])
    xs: list[float] = []
    ys: list[float] = []
    for segment in field.line_segments:
        xs += [segment.start[0], segment.end[0], math.nan]
        ys += [segment.start[1], segment.end[1], math.nan]
    circle = field.centre_circle
    xs += [*(circle.x + circle.radius * np.cos(TURN)), math.nan]
    ys += [*(circle.y + circle.radius * np.sin(TURN)), math.nan]
    half = field.penalty_mark_size / 2.0
    for mark_x, mark_y in field.penalty_marks:
        xs += [mark_x - half, mark_x + half, math.nan, mark_x, mark_x, math.nan]
        ys += [mark_y, mark_y, math.nan, mark_y - half, mark_y + half, math.nan]
    goals_x: list[float] = []
    goals_y: list[float] = []
    for goal in (field.own_goal, field.opponent_goal):
        left, right = goal.posts
        goals_x += [goal.x, goal.back, goal.back, goal.x, math.nan]
        goals_y += [left.y, left.y, right.y, right.y, math.nan]
    return [
        Line("", carpet[:, 0], carpet[:, 1], turf, closed=True, width=0.5),
        Line("", np.array(xs), np.array(ys), WHITE, width=2.0),
        Line("", np.array(goals_x), np.array(goals_y), "#e6c700", width=3.0),
    ]


def path(name: str, points: Array, colour: str, dashed: bool = False) -> Line:
    """Return a path, (n, 2) [m], with gaps where it jumps."""
    x, y = (values.copy() for values in thin(points[:, 0], points[:, 1], most=3000))
    jumps = np.flatnonzero(np.hypot(np.diff(x), np.diff(y)) > JUMP) + 1
    x[jumps], y[jumps] = np.nan, np.nan
    return Line(name, x, y, colour, dashed=dashed, width=2.0 if dashed else 3.5)


def _ellipses(times: Array, messages: list[Any]) -> list[Line]:
    robots: list[Array] = []
    balls: list[Array] = []
    gap = np.full((1, 2), np.nan)
    due = -math.inf
    for time, message in zip(times, messages, strict=True):
        if time < due:
            continue
        due = time + ELLIPSE_PERIOD
        found = robot_ellipse(message)
        robots += [found, gap] if found is not None else []
        if message.ball_known:
            found = ball_ellipse(message)
            balls += [found, gap] if found is not None else []
    lines = []
    for name, pieces, colour in (("robot, 2 sigma", robots, BLUE), ("ball, 2 sigma", balls, RED)):
        if pieces:
            points = np.concatenate(pieces)
            lines.append(Line(name, points[:, 0], points[:, 1], colour, width=1.0))
    return lines
