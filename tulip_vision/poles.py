"""Landmark poles: three segments, yellow-blue-yellow or blue-yellow-blue."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from tulip_vision.features import Feature, FeatureClass
from tulip_vision.findings import Findings, Refusal
from tulip_vision.patches import patches
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.upright import Upright, axis_samples, find_uprights, foot_on_ground
from tulip_vision.view import Mask, View, direction_of

PATTERNS = {
    FeatureClass.POLE_YELLOW_BLUE_YELLOW: (Colour.YELLOW, Colour.BLUE, Colour.YELLOW),
    FeatureClass.POLE_BLUE_YELLOW_BLUE: (Colour.BLUE, Colour.YELLOW, Colour.BLUE),
}
"""Colours of the segments from the ground upwards."""

LEAST_SEGMENT = 8.0
"""[px^2] a blue segment covers 100 at 8 m, and a part of that behind something else."""
MOST_SEGMENTS = 12


@dataclass(frozen=True)
class PoleParameters:
    """How a pole is told from other yellow and blue things.

    Attributes:
        diameter: Of a pole [m].
        segment_height: Of one coloured segment [m].
        least_area: Smallest patch looked at [px^2].
        width_tolerance: Largest ratio, either way, between the seen width and the one that fits the place.
        least_match: Share of each visible segment's axis that must have the pattern's colour.
        farthest: Largest distance along the ground [m].
    """

    diameter: float = 0.20
    segment_height: float = 0.20
    least_area: float = 40.0  # [px^2] at 8 m a pole is 11 px wide and 30 px high
    width_tolerance: float = 1.6
    least_match: float = 0.55
    farthest: float = 9.0  # [m]

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for name in ("diameter", "segment_height", "least_area", "farthest"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected > 0")
        if self.width_tolerance <= 1.0:
            raise ValueError(f"width_tolerance is {self.width_tolerance}; expected > 1")
        if not 0.0 <= self.least_match <= 1.0:
            raise ValueError(f"least_match is {self.least_match}; expected 0 to 1")


def find_poles(segmentation: Segmentation, view: View, parameters: PoleParameters) -> Findings:
    """Return the landmark poles with the direction of their feet."""
    first = view.first_row()
    blue = segmentation.mask(Colour.BLUE, first) & view.below_horizon[first:]
    segments = [cv2.boundingRect(points) for points, _ in patches(blue, LEAST_SEGMENT, MOST_SEGMENTS, (0, first))]
    if not segments:
        return Findings()
    left, top = (min(segment[axis] for segment in segments) for axis in (0, 1))
    right, bottom = (max(segment[axis] + segment[axis + 2] for segment in segments) for axis in (0, 1))
    # Yellow segments lie at most one blue one above or below; with some slack for the view from above.
    width, height = (max(segment[axis] for segment in segments) for axis in (2, 3))
    corner = max(left - width, 0), max(top - 2 * height, 0)
    part = slice(corner[1], bottom + 2 * height), slice(corner[0], right + width)
    either = belongs(segmentation.classes[part], Colour.YELLOW | Colour.BLUE).view(np.uint8)
    # Where yellow meets blue the blend is neither: close gaps of up to four pixels, upwards only.
    mask: Mask = cv2.morphologyEx(either, cv2.MORPH_CLOSE, np.ones((5, 1), dtype=np.uint8))
    poles: list[Feature] = []
    refusals: list[Refusal] = []
    for upright in find_uprights(mask, segmentation, view, parameters.least_area, corner):
        result = _examine(upright, segmentation, view, parameters)
        if isinstance(result, Feature):
            poles.append(result)
        elif result:
            refusals.append(Refusal(FeatureClass.POLE_YELLOW_BLUE_YELLOW, upright.pixel, result))
    return Findings(tuple(poles), tuple(refusals))


def _examine(upright: Upright, segmentation: Segmentation, view: View, parameters: PoleParameters) -> Feature | str:
    """Return the pole, or why it is none; an empty reason where the colours do not even suggest one."""
    if not upright.foot_seen:
        return ""  # without its foot a pole cannot be told from a post or a shirt
    distance = upright.distance(view)
    if distance > parameters.farthest:
        return ""
    foot, elevation = foot_on_ground(view, upright.azimuth, upright.low, parameters.diameter / 2.0)
    height = 3.0 * parameters.segment_height
    heights = np.linspace(0.0, height, 32)[1:-1]
    part = heights % parameters.segment_height
    heights = heights[(part > 0.15 * parameters.segment_height) & (part < 0.85 * parameters.segment_height)]
    segments = (heights / parameters.segment_height).astype(np.intp)
    points = np.column_stack([np.tile(foot, (len(heights), 1)), heights])
    classes, inside = view.sample(segmentation.classes, view.pixels(points))
    if len(set(segments[inside])) < 2:
        return ""
    best, kind = 0.0, FeatureClass.POLE_YELLOW_BLUE_YELLOW
    for candidate, pattern in PATTERNS.items():
        wanted = np.array([int(colour) for colour in pattern], dtype=np.uint8)[segments]
        fits = ((classes & wanted) != 0) & inside
        parts = [inside & (segments == number) for number in range(len(pattern))]
        shares = [float(fits[part].sum() / part.sum()) for part in parts if part.any()]
        match = min(shares)  # every segment in the picture must fit: two of three could be a goal post
        if match > best:
            best, kind = match, candidate
    if best < parameters.least_match:
        blue = belongs(axis_samples(view, segmentation.classes, foot, heights), Colour.BLUE)
        return f"only {best:.0%} of the pattern fits" if blue.any() else ""
    fitting = parameters.diameter / distance
    slack = 2.5 * upright.pixel_angle * math.hypot(1.0, view.height / distance)
    smallest = 0.0 if upright.cut else fitting / parameters.width_tolerance - slack
    if not smallest <= upright.width <= fitting * parameters.width_tolerance + slack:
        return f"{upright.width * distance:.2f} m wide"
    doubt = 2.0 if upright.cut else 1.0
    azimuth_spread, elevation_spread = view.spreads(direction_of(upright.azimuth, elevation), doubt)
    return Feature(kind, upright.azimuth, elevation, azimuth_spread, elevation_spread, best)
