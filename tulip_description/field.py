"""The AdultSize field of 2013 as geometry: lines, crossings, goals, poles and the ball.

All positions are in the map frame: origin at the field's centre on the ground, x towards the goal that
the robot attacks, y to the left, z up. The values come from `field.yaml`, which says how sure each one is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

from tulip_description.yaml_file import read_yaml

FIELD_FILE = Path(__file__).with_name("field.yaml")
SURE = ("high", "medium", "low", "assumed")
COLOURS = ("yellow", "blue", "orange")


class FieldError(ValueError):
    """The field's description cannot be used; the message says what to change."""


class CrossingKind(Enum):
    """Shape of a place where lines meet."""

    L = "L"
    T = "T"
    X = "X"


@dataclass(frozen=True)
class LineSegment:
    """The middle of a straight painted line, in map.

    Attributes:
        start: x, y of one end [m].
        end: x, y of the other end [m].
    """

    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def length(self) -> float:
        """Distance between the ends [m]."""
        return math.dist(self.start, self.end)

    @property
    def direction(self) -> float:
        """Direction from start to end [rad]."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])


@dataclass(frozen=True)
class Circle:
    """The middle of a painted circle, in map.

    Attributes:
        x, y: Centre [m].
        radius: [m].
    """

    x: float
    y: float
    radius: float


@dataclass(frozen=True)
class Crossing:
    """A place where lines meet, in map.

    Attributes:
        kind: L, T or X.
        x, y: Where the middles of the lines meet [m].
        orientation: [rad] L: the direction halfway between its two arms; T: the direction of its stem;
            X: the direction of any of its four arms (known modulo a quarter turn).
    """

    kind: CrossingKind
    x: float
    y: float
    orientation: float


@dataclass(frozen=True)
class GoalPost:
    """An upright cylinder, in map.

    Attributes:
        x, y: Its axis on the ground [m].
        radius: [m].
        height: Ground to its upper end, the upper side of the crossbar [m].
        colour: Name of its colour.
    """

    x: float
    y: float
    radius: float
    height: float
    colour: str


@dataclass(frozen=True)
class Goal:
    """One goal, in map.

    Attributes:
        x: Goal line, on which the axes of the posts stand [m].
        outward: +1.0 where the net lies at greater x, -1.0 where at smaller x.
        width: Between the inner sides of the posts [m].
        height: Ground to the lower side of the crossbar [m].
        depth: Goal line to the back of the net [m].
        posts: The post at +y, then the one at -y.
    """

    x: float
    outward: float
    width: float
    height: float
    depth: float
    posts: tuple[GoalPost, GoalPost]

    @property
    def back(self) -> float:
        """Where the back of the net lies on the map's x axis [m]."""
        return self.x + self.outward * self.depth


@dataclass(frozen=True)
class Pole:
    """A landmark pole, in map.

    Attributes:
        x, y: Its axis on the ground [m].
        radius: [m].
        segment_height: Height of one coloured segment [m].
        colours: Names of the segments' colours from the ground upwards.
    """

    x: float
    y: float
    radius: float
    segment_height: float
    colours: tuple[str, ...]

    @property
    def height(self) -> float:
        """Ground to its upper end [m]."""
        return self.segment_height * len(self.colours)


@dataclass(frozen=True)
class Field:
    """Measures of the field, and the geometry that follows from them.

    Attributes:
        length, width: Of the field along x and y, between the middles of the outer lines [m].
        border: Carpet beyond the outer lines [m].
        line_width: [m].
        centre_circle_diameter: [m].
        penalty_mark_distance: From the goal line [m].
        penalty_mark_size: Length of the two bars of the mark [m].
        goal_area_depth, goal_area_width: Along x and y [m].
        goal_width: Between the inner sides of the posts [m].
        goal_height: Ground to the lower side of the crossbar [m].
        goal_post_diameter: Of posts and crossbar [m].
        goal_depth: Goal line to the back of the net [m].
        goal_colour: Name of the colour of posts and crossbars.
        ball_radius: [m].
        ball_colour: Name of its colour.
        poles: Landmark poles; empty on a field without them.
    """

    length: float
    width: float
    border: float
    line_width: float
    centre_circle_diameter: float
    penalty_mark_distance: float
    penalty_mark_size: float
    goal_area_depth: float
    goal_area_width: float
    goal_width: float
    goal_height: float
    goal_post_diameter: float
    goal_depth: float
    goal_colour: str
    ball_radius: float
    ball_colour: str
    poles: tuple[Pole, ...]

    def __post_init__(self) -> None:
        """Check that the measures are lengths and fit into each other.

        Raises:
            FieldError: if they do not.
        """
        for name, value in vars(self).items():
            if isinstance(value, float) and not (math.isfinite(value) and value > 0.0):
                raise FieldError(f"{name} is {value} m; expected a finite length > 0")
        fits = (
            ("line_width", self.line_width, self.border, "the border"),
            ("goal_depth", self.goal_depth, self.border, "the border, on which the net stands"),
            ("goal_area_depth", self.goal_area_depth, self.length / 2.0, "half the field's length"),
            ("goal_area_width", self.goal_area_width, self.width, "the field's width"),
            ("penalty_mark_distance", self.penalty_mark_distance, self.length / 2.0, "half the field's length"),
            ("centre_circle_diameter", self.centre_circle_diameter, self.width, "the field's width"),
            ("goal_width", self.goal_width + 2.0 * self.goal_post_diameter, self.width, "the field's width"),
        )
        for name, value, limit, what in fits:
            if value >= limit:
                raise FieldError(f"{name} needs {value:g} m; expected less than {limit:g} m, {what}")
        for pole in self.poles:
            if not (abs(pole.x) < self.carpet_length / 2.0 and abs(pole.y) < self.carpet_width / 2.0):
                raise FieldError(f"a pole stands at ({pole.x:g}, {pole.y:g}) m; expected a place on the carpet")
            if abs(pole.x) < self.length / 2.0 and abs(pole.y) < self.width / 2.0:
                raise FieldError(f"a pole stands at ({pole.x:g}, {pole.y:g}) m; expected a place outside the lines")

    def without_poles(self) -> Field:
        """Return the same field without landmark poles."""
        return replace(self, poles=())

    def turned(self) -> Field:
        """Return the same field as the other team sees it: its map is turned by half a circle."""
        return replace(self, poles=tuple(replace(pole, x=-pole.x, y=-pole.y) for pole in self.poles))

    @property
    def carpet_length(self) -> float:
        """Of the carpet with its border, along x [m]."""
        return self.length + 2.0 * self.border

    @property
    def carpet_width(self) -> float:
        """Of the carpet with its border, along y [m]."""
        return self.width + 2.0 * self.border

    @property
    def line_segments(self) -> tuple[LineSegment, ...]:
        """Middles of all straight lines except the bars of the penalty marks: 11 segments."""
        x, y = self.length / 2.0, self.width / 2.0
        area_y = self.goal_area_width / 2.0
        segments = [
            LineSegment((-x, y), (x, y)),
            LineSegment((-x, -y), (x, -y)),
            LineSegment((-x, -y), (-x, y)),
            LineSegment((x, -y), (x, y)),
            LineSegment((0.0, -y), (0.0, y)),
        ]
        for side in (-1.0, 1.0):
            front = side * (x - self.goal_area_depth)
            segments += [
                LineSegment((side * x, -area_y), (front, -area_y)),
                LineSegment((side * x, area_y), (front, area_y)),
                LineSegment((front, -area_y), (front, area_y)),
            ]
        return tuple(segments)

    @property
    def centre_circle(self) -> Circle:
        """The middle of the painted centre circle."""
        return Circle(0.0, 0.0, self.centre_circle_diameter / 2.0)

    @property
    def crossings(self) -> tuple[Crossing, ...]:
        """All places where lines meet: 8 L, 6 T, and 2 X (circle and halfway line)."""
        x, y = self.length / 2.0, self.width / 2.0
        area_y = self.goal_area_width / 2.0
        radius = self.centre_circle.radius
        found = []
        for sx in (-1.0, 1.0):
            towards_middle = math.pi if sx > 0.0 else 0.0
            front = sx * (x - self.goal_area_depth)
            for sy in (-1.0, 1.0):
                found.append(Crossing(CrossingKind.L, sx * x, sy * y, math.atan2(-sy, -sx)))
                found.append(Crossing(CrossingKind.L, front, sy * area_y, math.atan2(-sy, sx)))
                found.append(Crossing(CrossingKind.T, sx * x, sy * area_y, towards_middle))
        for sy in (-1.0, 1.0):
            found.append(Crossing(CrossingKind.T, 0.0, sy * y, -sy * math.pi / 2.0))
            found.append(Crossing(CrossingKind.X, 0.0, sy * radius, 0.0))
        return tuple(found)

    @property
    def penalty_marks(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Centres of the marks: own half, then the opponent's [m]."""
        x = self.length / 2.0 - self.penalty_mark_distance
        return (-x, 0.0), (x, 0.0)

    @property
    def own_goal(self) -> Goal:
        """The goal that the robot defends, at -x."""
        return self._goal(-1.0)

    @property
    def opponent_goal(self) -> Goal:
        """The goal that the robot attacks, at +x."""
        return self._goal(1.0)

    @property
    def goal_posts(self) -> tuple[GoalPost, GoalPost, GoalPost, GoalPost]:
        """Own goal's posts at +y and -y, then the opponent goal's."""
        return (*self.own_goal.posts, *self.opponent_goal.posts)

    def _goal(self, outward: float) -> Goal:
        x = outward * self.length / 2.0
        radius = self.goal_post_diameter / 2.0
        y = self.goal_width / 2.0 + radius
        height = self.goal_height + self.goal_post_diameter
        left, right = (GoalPost(x, side * y, radius, height, self.goal_colour) for side in (1.0, -1.0))
        return Goal(x, outward, self.goal_width, self.goal_height, self.goal_depth, (left, right))


def load_field(path: Path | str | None = None) -> Field:
    """Read a field from a YAML file with the layout of `field.yaml`.

    Args:
        path: The file; None for the project's own AdultSize field of 2013.

    Raises:
        FieldError: if the file cannot be read, lacks an entry, has an unknown one, or does not fit together.
    """
    file = FIELD_FILE if path is None else Path(path)
    content = read_yaml(file, FieldError)
    try:
        return _build(content)
    except FieldError as error:
        raise FieldError(f"{file}: {error}") from error


FIELD_LENGTHS = (
    "length", "width", "border", "line_width", "centre_circle_diameter",
    "penalty_mark_distance", "penalty_mark_size", "goal_area_depth", "goal_area_width",
)  # fmt: skip


def _build(content: Any) -> Field:
    top = _section(content, "the file", ("field", "goal", "ball", "poles"))
    lines = _section(top["field"], "field", FIELD_LENGTHS)
    goal = _section(top["goal"], "goal", ("width", "height", "post_diameter", "depth", "colour"))
    ball = _section(top["ball"], "ball", ("radius", "colour"))
    poles = _section(top["poles"], "poles", ("diameter", "segment_height", "list"))
    if not isinstance(poles["list"], list):
        raise FieldError(f"poles.list is {poles['list']!r}; expected a list ([] for a field without poles)")
    radius = _length(poles["diameter"], "poles.diameter") / 2.0
    segment_height = _length(poles["segment_height"], "poles.segment_height")
    return Field(
        **{name: _length(lines[name], f"field.{name}") for name in FIELD_LENGTHS},
        goal_width=_length(goal["width"], "goal.width"),
        goal_height=_length(goal["height"], "goal.height"),
        goal_post_diameter=_length(goal["post_diameter"], "goal.post_diameter"),
        goal_depth=_length(goal["depth"], "goal.depth"),
        goal_colour=_colour(_value(goal["colour"], "goal.colour"), "goal.colour"),
        ball_radius=_length(ball["radius"], "ball.radius"),
        ball_colour=_colour(_value(ball["colour"], "ball.colour"), "ball.colour"),
        poles=tuple(
            _pole(entry, f"poles.list[{index}]", radius, segment_height) for index, entry in enumerate(poles["list"])
        ),
    )


def _section(content: Any, name: str, keys: tuple[str, ...]) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise FieldError(f"{name} is {content!r}; expected entries {', '.join(keys)}")
    missing = [key for key in keys if key not in content]
    unknown = [str(key) for key in content if key not in keys]
    if missing or unknown:
        problem = f"lacks {', '.join(missing)}" if missing else f"has unknown {', '.join(unknown)}"
        raise FieldError(f"{name} {problem}; expected exactly {', '.join(keys)}")
    return content


def _value(content: Any, name: str) -> Any:
    entry = _section(content, name, ("value", "sure"))
    _check_sure(entry["sure"], name)
    return entry["value"]


def _check_sure(sure: Any, name: str) -> None:
    if sure not in SURE:
        raise FieldError(f"{name}.sure is {sure!r}; expected one of {', '.join(SURE)}")


def _length(content: Any, name: str) -> float:
    value = _number(_value(content, name), name)
    if value <= 0.0:
        raise FieldError(f"{name} is {value:g} m; expected > 0")
    return value


def _number(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise FieldError(f"{name} is {value!r}; expected a finite number of metres")
    return float(value)


def _colour(value: Any, name: str) -> str:
    if value not in COLOURS:
        raise FieldError(f"{name} is {value!r}; expected one of {', '.join(COLOURS)}")
    return str(value)


def _pole(content: Any, name: str, radius: float, segment_height: float) -> Pole:
    entry = _section(content, name, ("x", "y", "colours", "sure"))
    _check_sure(entry["sure"], name)
    colours = entry["colours"]
    if not isinstance(colours, list) or not colours:
        raise FieldError(f"{name}.colours is {colours!r}; expected a list of colours from the ground upwards")
    return Pole(
        _number(entry["x"], f"{name}.x"),
        _number(entry["y"], f"{name}.y"),
        radius,
        segment_height,
        tuple(_colour(colour, f"{name}.colours") for colour in colours),
    )
