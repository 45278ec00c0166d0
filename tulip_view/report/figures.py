"""Figures as data, drawn by plotly in the page and by matplotlib on paper."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST_POINTS = 4000
"""Longer lines are thinned out to so many points."""

# Colours that people who do not see red or green can tell apart (Okabe and Ito).
BLUE, ORANGE, GREEN, RED, PURPLE, SKY, GREY, BLACK = (
    "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#999999", "#222222",
)  # fmt: skip

SYMBOLS = {"diamond": "D", "circle": "o", "x": "X", "star": "*", "triangle-up": "^"}
"""Of marks: plotly's names, and matplotlib's."""


@dataclass(frozen=True)
class Line:
    """A line, or points.

    Attributes:
        name: For the legend; "" keeps it out of it.
        x, y: (n,); NaN leaves a gap.
        colour: As in "#0072b2".
        dashed: Dashed instead of drawn through.
        points: Points instead of a line.
        width: Of the line, or size of the points [px].
        closed: Filled with its colour, faintly.
        choice: Shown only while this one of the figure's choices is chosen; "" always.
    """

    name: str
    x: Array
    y: Array
    colour: str
    dashed: bool = False
    points: bool = False
    width: float = 1.5
    closed: bool = False
    choice: str = ""


@dataclass(frozen=True)
class Band:
    """The space between two lines: (n,) x, low and high."""

    name: str
    x: Array
    low: Array
    high: Array
    colour: str
    choice: str = ""


@dataclass(frozen=True)
class Span:
    """A piece of time in a lane of a timeline, from begin to end [s]."""

    lane: str
    label: str
    begin: float
    end: float
    colour: str


@dataclass(frozen=True)
class Mark:
    """An instant in a lane of a timeline [s]; `kind` and `symbol` (a key of SYMBOLS) are the same for all of a sort."""

    lane: str
    label: str
    time: float
    colour: str
    kind: str
    symbol: str


@dataclass
class Figure:
    """One diagram.

    Attributes:
        key: Unique in the report, letters only.
        title: Above it.
        x_label, y_label: With units.
        items: What is drawn, in this order.
        equal: Both axes have the same scale.
        time: The x axis is time [s]: the replay's cursor moves in it.
        choices: What can be chosen; the first is shown at first.
        height: In the page [px].
        half: Two such stand side by side.
        x_range, y_range: First shown; None for all.
    """

    key: str
    title: str
    x_label: str
    y_label: str
    items: list[Line | Band | Span | Mark] = field(default_factory=list)
    equal: bool = False
    time: bool = True
    choices: tuple[str, ...] = ()
    height: int = 300
    half: bool = False
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None


@dataclass
class Still:
    """A camera picture: JPEG and what to write below it, and when it was taken [s]."""

    jpeg: bytes
    caption: str
    time: float


@dataclass
class Section:
    """One part of a report.

    Attributes:
        key: Unique, letters only.
        title: Its heading.
        words: Paragraphs.
        facts: The most important numbers, each with its name.
        figures: Diagrams.
        header, rows: A table; none without rows.
        row_times: Of each row, if rows are events [s].
        stills: Camera pictures.
        replay: Data of the 3D replay; see `replay`.
    """

    key: str
    title: str
    words: list[str] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)
    header: tuple[str, ...] = ()
    rows: list[tuple[str, ...]] = field(default_factory=list)
    row_times: list[float] = field(default_factory=list)
    facts: list[tuple[str, str]] = field(default_factory=list)
    stills: list[Still] = field(default_factory=list)
    replay: dict[str, Any] | None = None


@dataclass
class LeftOut(Exception):  # noqa: N818  (it is no error: the report goes on without the section)
    """A section cannot be made, because the recording lacks a topic."""

    title: str
    why: str


def thin(*columns: Array, most: int = MOST_POINTS) -> tuple[Array, ...]:
    """Return every k-th of (n,) values, so that at most `most` are left."""
    step = max(1, -(-len(columns[0]) // most))
    return tuple(column[::step] for column in columns)


def peaks(times: Array, values: Array, most: int = MOST_POINTS) -> tuple[Array, Array]:
    """Return a line with fewer points that still shows its peaks and its gaps.

    Of each piece of the line, the least and the greatest value are kept, and the first NaN.

    Args:
        times: (n,) [s].
        values: (n,), NaN in gaps.
        most: How many points may be left, gaps not counted.
    """
    count = len(values)
    if count <= most:
        return times, values
    size = -(-2 * count // most)
    padded = np.full((-(-count // size), size), np.inf)
    padded.ravel()[:count] = values
    gaps = np.isnan(padded)
    starts = size * np.arange(len(padded))
    low = np.where(gaps, np.inf, padded).argmin(axis=1)
    high = np.where(gaps | np.isinf(padded), -np.inf, padded).argmax(axis=1)
    broken = gaps.any(axis=1)
    kept = np.unique(np.concatenate((starts + low, starts + high, (starts + gaps.argmax(axis=1))[broken])))
    return times[kept], values[kept]


def spans_of(lane: str, times: Array, labels: list[str], end: float, colours: dict[str, str]) -> list[Span]:
    """Return the pieces of time in which a label stays the same.

    Args:
        lane: Where they are drawn.
        times: (n,) since when each label holds [s].
        labels: n of them; "" leaves a gap.
        end: Until when the last one holds [s].
        colours: By label; labels without one are grey.
    """
    found = []
    begin = 0
    for index in range(1, len(labels) + 1):
        if index == len(labels) or labels[index] != labels[begin]:
            until = end if index == len(labels) else float(times[index])
            if labels[begin]:
                found.append(Span(lane, labels[begin], float(times[begin]), until, colours.get(labels[begin], GREY)))
            begin = index
    return found


def ink_on(colour: str) -> str:
    """Return black or white, whichever reads better on a colour like "#0072b2"."""
    red, green, blue = (int(colour[place : place + 2], 16) / 255.0 for place in (1, 3, 5))
    return "#ffffff" if 0.3 * red + 0.59 * green + 0.11 * blue < 0.5 else "#1a222b"
