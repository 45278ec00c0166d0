"""Goal posts: yellow uprights that reach above the horizon."""

from __future__ import annotations

import math
from dataclasses import dataclass
from math import nan

import numpy as np

from tulip_description.planar import wrap_angle
from tulip_vision.features import Feature, FeatureClass
from tulip_vision.findings import Findings, Refusal
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.upright import Upright, axis_samples, find_uprights, foot_on_ground
from tulip_vision.view import View, direction_of

WITHOUT_BAR = 0.75
"""Confidence in a post of which no crossbar is seen yet."""


@dataclass(frozen=True)
class GoalParameters:
    """How a goal post is told from other yellow things.

    Attributes:
        diameter: Of a post [m].
        height: Of the crossbar's middle above the ground [m].
        width: Between the middles of the two posts [m].
        width_error: By which two posts may stand otherwise [m], beside the spread of their places.
        least_area: Smallest yellow patch looked at [px^2].
        width_tolerance: Largest ratio, either way, between the seen width and the one that fits the place.
        width_slack: Difference of width that is always allowed [px].
        least_yellow: Share of the post's visible axis that must be yellow.
        farthest: Largest distance along the ground [m].
    """

    diameter: float = 0.11
    height: float = 1.855
    width: float = 2.71
    width_error: float = 0.1
    least_area: float = 20.0  # [px^2] at 11 m a post is 4 px wide and 45 px high below the horizon
    width_tolerance: float = 1.7
    width_slack: float = 2.5  # [px]
    least_yellow: float = 0.55  # a keeper or the ball may hide a part
    farthest: float = 12.5  # [m] across the whole carpet

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for name in ("diameter", "height", "width", "width_error", "least_area", "farthest"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected > 0")
        if self.width_tolerance <= 1.0 or self.width_slack < 0.0:
            raise ValueError(
                f"width_tolerance is {self.width_tolerance}, width_slack {self.width_slack} px; expected > 1, >= 0 px"
            )
        if not 0.0 <= self.least_yellow <= 1.0:
            raise ValueError(f"least_yellow is {self.least_yellow}; expected 0 to 1")


def find_goal_posts(segmentation: Segmentation, view: View, parameters: GoalParameters) -> Findings:
    """Return the goal posts: azimuth always, elevation of the foot where it is seen on the carpet."""
    posts: list[Feature] = []
    refusals: list[Refusal] = []
    top = view.first_row()
    yellow = segmentation.mask(Colour.YELLOW, top)
    uprights = find_uprights(yellow, segmentation, view, parameters.least_area, (0, top))
    # Those with a foot first: a part of the same post higher up must not take its place.
    for upright in sorted(uprights, key=lambda each: (not each.foot_seen, each.low)):
        result = _examine(upright, segmentation, view, parameters)
        if isinstance(result, str):
            refusals.append(Refusal(FeatureClass.GOAL_POST, upright.pixel, result))
        elif any(abs(wrap_angle(post.azimuth - result.azimuth)) < max(upright.width, 0.01) for post in posts):
            refusals.append(Refusal(FeatureClass.GOAL_POST, upright.pixel, "part of a post already found"))
        else:
            posts.append(result)
    return Findings(tuple(posts), tuple(refusals))


def _examine(upright: Upright, segmentation: Segmentation, view: View, parameters: GoalParameters) -> Feature | str:
    pixel = upright.pixel_angle
    distance = upright.distance(view)
    if upright.blue_above:
        return "blue above it: a pole"
    if upright.foot_seen and distance <= parameters.farthest:
        foot, elevation = foot_on_ground(view, upright.azimuth, upright.low, parameters.diameter / 2.0)
        slant = math.hypot(distance, view.height)
        fitting = parameters.diameter / distance
        slack = parameters.width_slack * pixel * slant / distance
        smallest = 0.0 if upright.cut else fitting / parameters.width_tolerance - slack
        if not smallest <= upright.width <= fitting * parameters.width_tolerance + slack:
            return f"{upright.width * distance:.2f} m wide"
        heights = np.linspace(0.15, parameters.height - 0.15, 18)
        along = axis_samples(view, segmentation.classes, foot, heights)
        if len(along) < 3:
            return "too little of it in the picture"  # the lowest segment of a pole would look the same
        yellow = float(belongs(along, Colour.YELLOW).mean())
        if yellow < parameters.least_yellow:
            return f"only {yellow:.0%} of the axis is yellow"
        if float(belongs(along, Colour.BLUE).mean()) > 0.12:
            return "blue above it: a pole"
        direction = direction_of(upright.azimuth, elevation)
        azimuth_spread, elevation_spread = view.spreads(direction, 2.0 if upright.cut else 1.0)
        confidence = WITHOUT_BAR * min(1.0, yellow / 0.9)
        return Feature(FeatureClass.GOAL_POST, upright.azimuth, elevation, azimuth_spread, elevation_spread, confidence)
    if upright.foot_seen:
        return f"foot {distance:.1f} m away"
    if not upright.on_carpet:
        return "not on the carpet"
    if not upright.reaches_up:
        return "no carpet below, and it ends below the horizon"
    if upright.cut:
        return "foot hidden and cut by the picture's edge"
    height_seen = upright.high - upright.low
    if height_seen < 3.0 * upright.width:
        return "foot hidden and not slender"
    if upright.width < parameters.diameter / parameters.farthest:
        return "foot hidden and too thin"
    azimuth_spread, _ = view.spreads(direction_of(upright.azimuth, 0.5 * (upright.low + upright.high)), 1.5)
    return Feature(FeatureClass.GOAL_POST, upright.azimuth, nan, azimuth_spread, nan, confidence=0.5)
