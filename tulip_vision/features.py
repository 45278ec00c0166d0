"""What vision gives: features of one picture, each with two angles and their spread."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import nan

import numpy as np
from numpy.typing import NDArray


class FeatureClass(IntEnum):
    """What a feature is."""

    BALL = 0
    """Direction of the ball's centre."""
    GOAL_POST = 1
    """Direction of the post's foot on the ground; elevation is NaN where the foot is not in the picture."""
    OPPONENT = 2
    """Direction of the point on the ground below the opponent; elevation is NaN where it is hidden."""
    LINE = 3
    """A straight piece of line; bearing of one end, `end_azimuth` and `end_elevation` of the other."""
    CROSSING_L = 4
    CROSSING_T = 5
    CROSSING_X = 6
    POLE_YELLOW_BLUE_YELLOW = 7
    """Direction of the pole's foot, as for GOAL_POST."""
    POLE_BLUE_YELLOW_BLUE = 8
    PENALTY_MARK = 9
    CENTRE_CIRCLE = 10
    """Direction of the circle's middle on the ground, which need not be in the picture."""
    FIELD_BORDER = 11
    """A straight edge of the carpet, where green ends; both ends given, as for LINE."""
    GOAL = 12
    """Two posts that belong together: the foot of the left one, and that of the right one as the other end; each
    elevation is NaN where that foot is hidden."""


@dataclass(frozen=True)
class Feature:
    """One feature.

    Both angles describe the ray from the camera's optical centre, in the axes of base_footprint (level
    with the ground, x forward): the ray is (cos(el) cos(az), cos(el) sin(az), sin(el)).

    Attributes:
        kind: See `FeatureClass`.
        azimuth: [rad], positive to the left.
        elevation: [rad], positive up; NaN where it is not known.
        azimuth_spread, elevation_spread: Standard deviations [rad].
        confidence: 0 to 1.
        end_azimuth, end_elevation: Other end of a LINE, FIELD_BORDER or GOAL [rad], else NaN.
        angular_radius: Half the angle that a BALL fills [rad]; NaN where too little of its outline is seen,
            and for all other kinds.
        side: 1 for a GOAL_POST that is the left one of its goal as the camera sees it, -1 for the right one, else 0.
    """

    kind: FeatureClass
    azimuth: float
    elevation: float
    azimuth_spread: float
    elevation_spread: float
    confidence: float
    end_azimuth: float = nan
    end_elevation: float = nan
    angular_radius: float = nan
    side: int = 0


@dataclass(frozen=True)
class Features:
    """All features of one picture.

    Attributes:
        stamp: When the picture was taken [ns].
        camera_position: (3,) optical centre in base_footprint [m]; its z is the height above the ground.
        view: (4,) what the picture covers, for "should have been seen" reasoning: azimuth of the left and
            right edge, elevation of the lower and upper edge at the picture's middle [rad].
        features: Any number of them.
    """

    stamp: int
    camera_position: NDArray[np.float64]
    view: NDArray[np.float64]
    features: tuple[Feature, ...]
