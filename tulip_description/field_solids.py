"""The solid parts of the field: goal frames, nets and poles as cylinders and boxes, for physics engines.

All positions are in the map frame. A net is modelled as walls, since threads are too thin for a ball in steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from tulip_description.field import Field, Goal
from tulip_description.robot import Box, Vector

NET_THICKNESS = 0.10  # [m] thick enough that a ball of 10 m/s does not pass through it between two steps
CARPET_THICKNESS = 0.02  # [m] of carpets that are boxes; an engine with planes has no use for it


@dataclass(frozen=True)
class Pipe:
    """A cylinder that stands upright or lies along y.

    Attributes:
        name: Unique on the field.
        centre: Its middle in map [m].
        radius: [m].
        length: [m].
        upright: Whether its axis is z, else y.
        colour: Name of its colour.
    """

    name: str
    centre: Vector
    radius: float
    length: float
    upright: bool
    colour: str


def carpet_box(field: Field) -> Box:
    """Return the carpet as a box whose upper side is the ground."""
    size = (field.carpet_length, field.carpet_width, CARPET_THICKNESS)
    return Box(size, (0.0, 0.0, -CARPET_THICKNESS / 2), "green", True)


def goal_name(goal: Goal) -> str:
    """Return "opponent_goal" for the goal at +x, "own_goal" for the other."""
    return "opponent_goal" if goal.outward > 0.0 else "own_goal"


def goal_frame(goal: Goal) -> tuple[Pipe, Pipe, Pipe]:
    """Return the left post, the right post and the crossbar, which ends flush with the posts."""
    name, radius, height = goal_name(goal), goal.posts[0].radius, goal.posts[0].height
    left, right = (
        Pipe(f"{name}_{side}_post", (post.x, post.y, height / 2), radius, height, True, post.colour)
        for side, post in zip(("left", "right"), goal.posts, strict=True)
    )
    bar = Pipe(
        f"{name}_bar", (goal.x, 0.0, goal.height + radius), radius, bar_length(goal), False, goal.posts[0].colour
    )
    return left, right, bar


def bar_length(goal: Goal) -> float:
    """Length of the crossbar over the outer sides of the posts [m]."""
    return goal.width + 4.0 * goal.posts[0].radius


def net_walls(goal: Goal) -> tuple[Box, Box, Box, Box]:
    """Return back, left side, right side and roof of the net, in map; their inner sides are where the net hangs."""
    half = NET_THICKNESS / 2
    height, length = goal.posts[0].height, bar_length(goal)
    middle, depth = (goal.x + goal.back) / 2, goal.depth
    side = goal.posts[0].y + goal.posts[0].radius + half
    return (
        Box((NET_THICKNESS, length, height), (goal.back + goal.outward * half, 0.0, height / 2), "net", True),
        Box((depth, NET_THICKNESS, height), (middle, side, height / 2), "net", True),
        Box((depth, NET_THICKNESS, height), (middle, -side, height / 2), "net", True),
        Box((depth, length, NET_THICKNESS), (middle, 0.0, height + half), "net", True),
    )


def pole_segments(field: Field) -> tuple[Pipe, ...]:
    """Return the coloured segments of the landmark poles, from the ground upwards."""
    return tuple(
        Pipe(
            f"pole_{number}_{level}",
            (pole.x, pole.y, (level + 0.5) * pole.segment_height),
            pole.radius,
            pole.segment_height,
            True,
            colour,
        )
        for number, pole in enumerate(field.poles)
        for level, colour in enumerate(pole.colours)
    )


@dataclass(frozen=True)
class Strip:
    """A painted strip on the carpet.

    Attributes:
        x, y: Its middle in map [m].
        yaw: Direction of its length [rad].
        length, width: [m].
    """

    x: float
    y: float
    yaw: float
    length: float
    width: float


CIRCLE_STRIPS = 48  # of the centre circle: the chords are within 2 mm of the arcs


def painted_strips(field: Field) -> tuple[Strip, ...]:
    """Return all painted lines as straight strips."""
    width = field.line_width
    strips = [
        Strip(
            (line.start[0] + line.end[0]) / 2,
            (line.start[1] + line.end[1]) / 2,
            line.direction,
            line.length + width,  # so that corners are closed
            width,
        )
        for line in field.line_segments
    ]
    strips += [
        Strip(x, y, yaw, field.penalty_mark_size, width) for x, y in field.penalty_marks for yaw in (0.0, math.pi / 2)
    ]
    radius = field.centre_circle.radius
    for number in range(CIRCLE_STRIPS):
        angle = 2.0 * math.pi * number / CIRCLE_STRIPS
        length = 2.0 * (radius + width / 2) * math.tan(math.pi / CIRCLE_STRIPS)
        strips.append(Strip(radius * math.cos(angle), radius * math.sin(angle), angle + math.pi / 2, length, width))
    return tuple(strips)
