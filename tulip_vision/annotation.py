"""The debug picture: what vision found, and what it refused and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.features import Feature, FeatureClass, Features
from tulip_vision.findings import Refusal
from tulip_vision.goals import GoalParameters
from tulip_vision.lines import Lines
from tulip_vision.view import Array, View, direction_of, directions_of

Colour = tuple[int, int, int]

COLOURS: dict[FeatureClass, Colour] = {
    FeatureClass.BALL: (0, 80, 255),
    FeatureClass.GOAL_POST: (0, 255, 255),
    FeatureClass.OPPONENT: (255, 0, 255),
    FeatureClass.LINE: (255, 120, 0),
    FeatureClass.CROSSING_L: (255, 255, 0),
    FeatureClass.CROSSING_T: (255, 255, 0),
    FeatureClass.CROSSING_X: (255, 255, 0),
    FeatureClass.POLE_YELLOW_BLUE_YELLOW: (255, 200, 150),
    FeatureClass.POLE_BLUE_YELLOW_BLUE: (255, 200, 150),
    FeatureClass.PENALTY_MARK: (255, 255, 255),
    FeatureClass.CENTRE_CIRCLE: (200, 120, 120),
    FeatureClass.FIELD_BORDER: (0, 255, 120),
    FeatureClass.GOAL: (0, 200, 200),
}
"""BGR of each class."""

LABELS = {
    FeatureClass.BALL: "ball",
    FeatureClass.GOAL_POST: "post",
    FeatureClass.GOAL: "goal",
    FeatureClass.OPPONENT: "opponent",
    FeatureClass.CROSSING_L: "L",
    FeatureClass.CROSSING_T: "T",
    FeatureClass.CROSSING_X: "X",
    FeatureClass.POLE_YELLOW_BLUE_YELLOW: "pole YBY",
    FeatureClass.POLE_BLUE_YELLOW_BLUE: "pole BYB",
    FeatureClass.PENALTY_MARK: "mark",
    FeatureClass.CENTRE_CIRCLE: "circle",
}

REFUSED: Colour = (60, 60, 255)


def annotate(
    picture: NDArray[np.uint8],
    features: Features,
    view: View,
    outline: Array,
    lines: Lines,
    refusals: Sequence[Refusal],
) -> NDArray[np.uint8]:
    """Return a copy of a picture with features, the carpet's outline and refused candidates drawn into it.

    Args:
        picture: (height, width, 3) BGR.
        features: Found in it.
        view: Geometry of the picture.
        outline: (n, 2) upper edge of the carpet [px].
        lines: Pieces of line and the centre circle.
        refusals: Candidates that were refused.
    """
    drawn = picture.copy()
    if len(outline):
        _polyline(drawn, outline, (0, 200, 0))
    if lines.circle is not None:
        turn = np.linspace(0.0, 2.0 * math.pi, 49)
        radius = 0.75  # [m] drawn where it is believed; its size is the rule's
        around = lines.circle.centre + radius * np.column_stack([np.cos(turn), np.sin(turn)])
        _polyline(drawn, view.pixels_on_ground(around), (200, 120, 120))
    for refusal in refusals:
        u, v = (round(value) for value in refusal.pixel)
        cv2.drawMarker(drawn, (u, v), REFUSED, cv2.MARKER_TILTED_CROSS, 6, 1)
        _label(drawn, (u + 5, v + 3), f"{_name(refusal.kind)}? {refusal.reason}", REFUSED, 0.35)
    for feature in sorted(features.features, key=lambda each: each.kind != FeatureClass.LINE):
        _draw(drawn, feature, view)
    return drawn


def _name(kind: FeatureClass) -> str:
    return LABELS.get(kind, kind.name.lower())


def _draw(drawn: NDArray[np.uint8], feature: Feature, view: View) -> None:
    colour = COLOURS[feature.kind]
    if feature.kind == FeatureClass.GOAL:
        _draw_goal(drawn, feature, view)
        return
    if not math.isnan(feature.end_azimuth):
        share = np.linspace(0.0, 1.0, 12)[:, None]
        ends = np.stack(
            [direction_of(feature.azimuth, feature.elevation), direction_of(feature.end_azimuth, feature.end_elevation)]
        )
        ground = view.ground(ends)
        _polyline(drawn, view.pixels_on_ground(ground[0] + share * (ground[1] - ground[0])), colour)
        return
    if math.isnan(feature.elevation):
        elevations = np.linspace(math.radians(-60.0), math.radians(20.0), 30)
        _polyline(
            drawn,
            view.pixels_of_directions(np.stack([direction_of(feature.azimuth, each) for each in elevations])),
            colour,
        )
        return
    pixel = view.pixels_of_directions(direction_of(feature.azimuth, feature.elevation)[None])[0]
    if not np.isfinite(pixel).all():
        return
    u, v = round(float(pixel[0])), round(float(pixel[1]))
    which = {1: "left ", -1: "right "}.get(feature.side, "")
    text = f"{which}{_name(feature.kind)} {feature.confidence:.2f}"
    if feature.kind == FeatureClass.BALL and not math.isnan(feature.angular_radius):
        direction = direction_of(feature.azimuth, feature.elevation)
        cv2.circle(
            drawn, (u, v), round(feature.angular_radius / view.angle_per_pixel(direction)), colour, 1, cv2.LINE_AA
        )
    else:
        cv2.drawMarker(drawn, (u, v), colour, cv2.MARKER_CROSS, 12, 1)
    _label(drawn, (u + 8, v - 6), text, colour, 0.4)


def _draw_goal(drawn: NDArray[np.uint8], goal: Feature, view: View) -> None:
    """Draw what is believed of a goal: both posts and the bar where both feet are known, else only its name."""
    height = GoalParameters.height  # drawn where it is believed; its size is the rule's
    azimuths, elevations = np.array([[goal.azimuth, goal.end_azimuth], [goal.elevation, goal.end_elevation]])
    feet = view.ground(directions_of(azimuths, elevations))
    corners = np.column_stack([feet[[0, 0, 1, 1]], [0.0, height, height, 0.0]])
    share = np.linspace(0.0, 1.0, 12)[:, None]
    for start, end in pairwise(corners):
        _polyline(drawn, view.pixels(start + share * (end - start)), COLOURS[goal.kind])
    for foot in feet[np.isfinite(feet).all(axis=1)][:1]:
        u, v = view.pixels_on_ground(foot[None])[0]
        if math.isfinite(u):
            _label(
                drawn,
                (round(u) + 8, round(v) + 8),
                f"{_name(goal.kind)} {goal.confidence:.2f}",
                COLOURS[goal.kind],
                0.4,
            )


def _polyline(drawn: NDArray[np.uint8], points: Array, colour: Colour) -> None:
    """Draw the parts of a polyline whose points are in front of the camera."""
    with np.errstate(invalid="ignore"):
        good = np.abs(points).max(axis=1) < 10_000.0  # NaN is not
    for index in np.flatnonzero(good[:-1] & good[1:]):
        first, second = np.rint(points[index]).astype(int), np.rint(points[index + 1]).astype(int)
        cv2.line(drawn, (int(first[0]), int(first[1])), (int(second[0]), int(second[1])), colour, 1, cv2.LINE_AA)


def _label(drawn: NDArray[np.uint8], place: tuple[int, int], text: str, colour: Colour, size: float) -> None:
    (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    x = int(np.clip(place[0], 0, max(drawn.shape[1] - width - 1, 0)))
    y = int(np.clip(place[1], 10, drawn.shape[0] - 3))
    # The dark rim is the same text moved about: since OpenCV 5, thicker letters are also wider ones.
    for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        cv2.putText(drawn, text, (x + dx, y + dy), cv2.FONT_HERSHEY_SIMPLEX, size, (0, 0, 0), 1, cv2.LINE_AA)
    cv2.putText(drawn, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, size, colour, 1, cv2.LINE_AA)
