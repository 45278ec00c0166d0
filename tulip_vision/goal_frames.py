"""Goals as wholes: which two posts belong together, and to which side of a lone post its goal lies.

Two posts are one goal where they stand as far apart as the rules say, and where the crossbar runs from one to the other
if the picture shows the place. A post whose foot is hidden stands somewhere on its ray; the width leaves two places,
of which the crossbar tells the right one. A crossbar that leaves a lone post on one side only makes it the goal's
left or right post.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import combinations
from math import nan

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import wrap_angle
from tulip_vision.features import Feature, FeatureClass
from tulip_vision.findings import Findings
from tulip_vision.goals import GoalParameters
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import Array, View, directions_of

LEFT, RIGHT = 1, -1
"""Values of `Feature.side`."""
TURNS = np.radians([0.0, -30.0, 30.0, -60.0, 60.0])
"""Of a lone post's crossbar against the line across the line of sight, at which it is looked for."""
BETWEEN = np.linspace(0.1, 0.9, 10)
"""Shares of the way from post to post at which a crossbar is looked for."""
BESIDE = np.linspace(0.15, 0.5, 6)
"""The same beside a lone post."""
LEAST_SEEN = 3
"""Of these places in the picture, for the crossbar to say anything."""
LEAST_BAR, MOST_BESIDE = 0.5, 0.2
"""Share of them that must be yellow for a bar, and that may be on the side where there is none."""
DEVIATIONS = 3.0
"""By how many standard deviations the width may be off."""


@dataclass(frozen=True)
class _Pair:
    """Two posts that may be one goal.

    Attributes:
        first, second: Indices of the posts.
        feet: (2, 2) where they would stand in base_footprint [m].
        sure: Whether both feet are seen.
        misfit: Between the distance of the feet and the goal's width [m]; 0 where a foot is hidden.
    """

    first: int
    second: int
    feet: Array
    sure: bool
    misfit: float


def find_goals(posts: Findings, segmentation: Segmentation, view: View, parameters: GoalParameters) -> Findings:
    """Return the posts again, now with their side and with the crossbar's confidence, and the goals.

    Args:
        posts: As `find_goal_posts` gives them.
        segmentation: Of the picture.
        view: Of the picture.
        parameters: How a goal looks.
    """
    found = list(posts.features)
    if not found:
        return posts
    azimuths, elevations = (np.array([getattr(post, name) for post in found]) for name in ("azimuth", "elevation"))
    feet = view.ground(directions_of(azimuths, elevations))  # NaN where hidden
    goals: list[Feature] = []
    lone = set(range(len(found)))
    for pair, bar in _candidates(found, feet, segmentation, view, parameters):
        if not {pair.first, pair.second} <= lone:
            continue
        lone -= {pair.first, pair.second}
        left, right = pair.first, pair.second
        if wrap_angle(found[left].azimuth - found[right].azimuth) < 0.0:
            left, right = right, left
        found[left], found[right] = _sided(found[left], LEFT, bar), _sided(found[right], RIGHT, bar)
        goals.append(_goal(found[left], found[right]))
    for index in sorted(lone):
        if not math.isnan(found[index].elevation):
            found[index] = _sided(found[index], *_beside(feet[index], segmentation, view, parameters))
    return Findings((*found, *goals), posts.refusals)


def _candidates(
    posts: list[Feature], feet: Array, segmentation: Segmentation, view: View, parameters: GoalParameters
) -> list[tuple[_Pair, float]]:
    """Return the pairs that may be goals, the likeliest first, each with the share of a crossbar."""
    pairs: list[_Pair] = []
    for first, second in combinations(range(len(posts)), 2):
        seen = [not math.isnan(posts[index].elevation) for index in (first, second)]
        if all(seen):
            both = feet[[first, second]]
            misfit = abs(float(np.linalg.norm(both[1] - both[0])) - parameters.width)
            spread = _length_spread((posts[first], posts[second]), both, view)
            if misfit <= parameters.width_error + DEVIATIONS * spread:
                pairs.append(_Pair(first, second, both, True, misfit))
        elif any(seen):
            known, hidden = (first, second) if seen[0] else (second, first)
            pairs += _by_width(known, hidden, feet[known], posts[hidden].azimuth, view, parameters)
    if not pairs:
        return []
    ends = np.array([pair.feet for pair in pairs])
    places = ends[:, :1] + BETWEEN[:, None] * (ends[:, 1:] - ends[:, :1])
    bars, in_picture = _yellow_bars(places, segmentation, view, parameters)
    kept = []
    for pair, bar, told in zip(pairs, bars.tolist(), (in_picture >= LEAST_SEEN).tolist(), strict=True):
        if bar >= LEAST_BAR if told else pair.sure:
            kept.append((pair, bar if told else 0.0))
    return sorted(kept, key=lambda each: (not each[0].sure, each[0].misfit - each[1]))


def _by_width(
    known: int, hidden: int, foot: Array, azimuth: float, view: View, parameters: GoalParameters
) -> list[_Pair]:
    """Return the pairs of a post with a foot, (2,), and one on a ray [rad], a goal's width apart."""
    ray = np.array([math.cos(azimuth), math.sin(azimuth)])
    offset = foot - view.position[:2]
    nearest = float(ray @ offset)
    aside = float(offset @ offset) - nearest**2
    half = math.sqrt(max(parameters.width**2 - aside, 0.0))
    if aside > (parameters.width + parameters.width_error) ** 2:
        return []
    places = [reach for reach in {nearest - half, nearest + half} if 0.0 < reach <= parameters.farthest]
    return [
        _Pair(known, hidden, np.array([foot, view.position[:2] + reach * ray]), False, 0.0) for reach in sorted(places)
    ]


def _beside(foot: Array, segmentation: Segmentation, view: View, parameters: GoalParameters) -> tuple[int, float]:
    """Return which post of its goal a lone one is (0: not known), and the share of the crossbar that is seen.

    Which way the goal faces is not known: the bar is looked for across the line of sight, within 60 deg.
    """
    offset = foot - view.position[:2]
    ahead = offset / max(math.hypot(*offset), 1e-6)
    across = np.array([-ahead[1], ahead[0]])  # to the left
    ways = np.cos(TURNS)[:, None] * across + np.sin(TURNS)[:, None] * ahead  # (5, 2)
    leftwards = foot + ways[:, None] * (BESIDE[:, None] * parameters.width)  # (5, 6, 2)
    places = np.concatenate([leftwards, 2.0 * foot - leftwards])
    bars, seen = _yellow_bars(places, segmentation, view, parameters)
    bars = np.where(seen >= LEAST_SEEN, bars, 0.0).reshape(2, -1).max(axis=1)
    left, right = bars.tolist()
    bar = max(left, right)
    if bar < LEAST_BAR or min(left, right) > MOST_BESIDE:
        return 0, bar
    return (RIGHT if left > right else LEFT), bar


def _yellow_bars(
    places: Array, segmentation: Segmentation, view: View, parameters: GoalParameters
) -> tuple[Array, NDArray[np.intp]]:
    """Read the picture at a crossbar's height above places on the ground.

    Args:
        places: (k, n, 2) in base_footprint [m], k bars.
        segmentation: Of the picture.
        view: Of the picture.
        parameters: How a goal looks.

    Returns:
        (k,) yellow share of what is in the picture, and (k,) how many places are.
    """
    points = np.empty((*places.shape[:2], 3))
    points[..., :2], points[..., 2] = places, parameters.height
    classes, inside = view.sample(segmentation.classes, view.pixels(points.reshape(-1, 3)))
    yellow = np.count_nonzero(belongs(classes, Colour.YELLOW).reshape(places.shape[:2]), axis=1)
    seen = np.count_nonzero(inside.reshape(places.shape[:2]), axis=1)
    return yellow / np.maximum(seen, 1), seen


def _length_spread(posts: tuple[Feature, Feature], feet: Array, view: View) -> float:
    """Return the standard deviation of the distance between two feet, (2, 2) [m]."""
    way = (feet[1] - feet[0]) / max(float(np.linalg.norm(feet[1] - feet[0])), 1e-6)
    variance = 0.0
    for post, foot in zip(posts, feet, strict=True):
        offset = foot - view.position[:2]
        reach = max(math.hypot(*offset), 1e-6)
        ahead = float(way @ offset) / reach
        along = (reach**2 + view.height**2) / view.height * post.elevation_spread
        variance += (ahead * along) ** 2 + (1.0 - ahead**2) * (reach * post.azimuth_spread) ** 2
    return math.sqrt(variance)


def _sided(post: Feature, side: int, bar: float) -> Feature:
    """Return a post that is more credible by a share of crossbar, 0 to 1."""
    return replace(post, side=side, confidence=min(1.0, post.confidence * (1.0 + bar / 3.0)))


def _goal(left: Feature, right: Feature) -> Feature:
    elevation_spreads = [each.elevation_spread for each in (left, right) if not math.isnan(each.elevation_spread)]
    return Feature(
        FeatureClass.GOAL,
        left.azimuth,
        left.elevation,
        max(left.azimuth_spread, right.azimuth_spread),
        max(elevation_spreads, default=nan),
        min(left.confidence, right.confidence),
        right.azimuth,
        right.elevation,
    )
