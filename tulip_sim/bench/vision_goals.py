"""Judges goals as wholes: were the posts that belong together paired, and is each post's side right?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import wrap_angle
from tulip_sim.bench.vision_truth import Thing
from tulip_vision.features import Feature, FeatureClass

Array = NDArray[np.float64]

MATCH = math.radians(2.0)
"""Between the azimuths of a feature and of the post that it shows."""
FARTHEST = 9.0  # [m]


@dataclass(frozen=True)
class GoalCounts:
    """What came out in some pictures.

    Attributes:
        there: Goals of which both posts are seen whole, up to FARTHEST away.
        paired: How many of them were given as a goal.
        false: Goals given whose ends are not the two posts of one goal.
        posts: Posts found.
        sided: Posts with a side.
        wrong: Those with the wrong one.
    """

    there: int = 0
    paired: int = 0
    false: int = 0
    posts: int = 0
    sided: int = 0
    wrong: int = 0

    def __add__(self, other: GoalCounts) -> GoalCounts:
        """Return the sum."""
        return GoalCounts(*(one + more for one, more in zip(vars(self).values(), vars(other).values(), strict=True)))


def count_goals(features: Sequence[Feature], posts: Sequence[Thing], camera: Array) -> GoalCounts:
    """Compare the goals and posts of a picture with the truth.

    Args:
        features: Of the picture.
        posts: Of the field, the two of a goal after each other, their places in base_footprint.
        camera: (3,) the true optical centre in base_footprint [m].
    """
    azimuths = [math.atan2(*(post.point[:2] - camera[:2])[::-1]) for post in posts]
    # The left one of the two is that from which it takes a turn to the right to look at the other.
    left = [wrap_angle(azimuths[index] - azimuths[index ^ 1]) > 0.0 for index in range(len(posts))]
    there = {
        goal
        for goal in range(len(posts) // 2)
        if all(post.whole and post.distance <= FARTHEST for post in posts[2 * goal : 2 * goal + 2])
    }
    paired, false, found, sided, wrong = set(), 0, 0, 0, 0
    for feature in features:
        if feature.kind is FeatureClass.GOAL:
            first, second = (_nearest(azimuth, azimuths) for azimuth in (feature.azimuth, feature.end_azimuth))
            if first is None or second is None or first // 2 != second // 2 or not left[first] or left[second]:
                false += 1
            else:
                paired.add(first // 2)
        elif feature.kind is FeatureClass.GOAL_POST:
            found += 1
            sided += feature.side != 0
            post = _nearest(feature.azimuth, azimuths)
            wrong += feature.side != 0 and (post is None or (feature.side > 0) != left[post])
    return GoalCounts(len(there), len(there & paired), false, found, sided, wrong)


def _nearest(azimuth: float, azimuths: Sequence[float]) -> int | None:
    off = [abs(wrap_angle(azimuth - each)) for each in azimuths]
    best = int(np.argmin(off))
    return best if off[best] < MATCH else None
