"""Opponents: a marker in the other team's colour on a body that stands on the carpet.

Of one that is near while the camera looks down, only the legs are in the picture: whatever stands on the carpet and is
neither post nor pole counts, too, if the picture's upper edge cuts it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from tulip_vision.features import Feature, FeatureClass
from tulip_vision.findings import Findings, Refusal
from tulip_vision.opponent_body import carpet_beside, foot_below, hides_carpet, middle_of, painted_share
from tulip_vision.opponent_markers import Marker, angle_between, cut_bodies, is_compact, joined, markers_of
from tulip_vision.patches import patches
from tulip_vision.segmentation import Colour, Segmentation
from tulip_vision.view import View, direction_of

MARKERS = {"cyan": (Colour.CYAN, Colour.MAGENTA), "magenta": (Colour.MAGENTA, Colour.CYAN)}
"""Own marker colour and the opponents', by the own team's colour."""

MOST_CANDIDATES = 8
"""The largest patches in the marker's colour are looked at."""

NEAR_REACH = 0.5
"""[rad] half the angle that an opponent fills whose feet are below the picture: it is less than a metre away."""
NEAREST = 0.4
"""[m] along the ground to an opponent's nearest marker: closer, the robots touch."""
MIDDLE_SPREAD = 0.08
"""[m] standard deviation of a body's middle across the line of sight."""
LEAST_OF_LEGS = 0.25
"""[m] height above the ground at which the picture's upper edge cuts legs at least; lower things are no robots."""
PARTLY_SEEN = 2.5
"""How many times less sure the place of an opponent is that the picture's edge or the own body hides in part."""
WIDTH_OF_CUT = 0.2
"""[rad] half the width of a look below a marker that the edge of the picture cuts: of a body 1.5 m away."""


@dataclass(frozen=True)
class OpponentParameters:
    """How an opponent is recognised.

    Attributes:
        team_colour: Of our own team: "cyan" or "magenta"; opponents wear the other.
        least_area: Smallest marker patch looked at [px^2].
        lowest_marker, highest_marker: Height of markers above the ground [m].
        smallest_marker, largest_marker: Area of one marker, as seen [m^2].
        half_width: Of a body [m].
        depth: From the near edge of the feet to the point below the body [m].
        depth_spread: Standard deviation of that depth [m].
        farthest: Largest distance along the ground [m].
    """

    team_colour: str = "cyan"
    least_area: float = 10.0  # [px^2] at 9 m a marker of 0.18 m is 9 px wide
    lowest_marker: float = 0.15
    highest_marker: float = 1.25
    smallest_marker: float = 0.004  # [m^2] an arm's marker seen from the front, half hidden
    largest_marker: float = 0.25  # [m^2]
    half_width: float = 0.30
    depth: float = 0.17  # nearest corner of two feet, 0.22 m long and 0.14 m to either side
    depth_spread: float = 0.07  # [m] feet of 0.2 m seen from any side
    farthest: float = 11.0  # [m]

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        if self.team_colour not in MARKERS:
            raise ValueError(f"team_colour is {self.team_colour!r}; expected {' or '.join(MARKERS)}")
        for name in ("least_area", "half_width", "farthest"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected > 0")
        if not 0.0 <= self.lowest_marker < self.highest_marker:
            raise ValueError(
                f"markers from {self.lowest_marker} m to {self.highest_marker} m; expected 0 <= lowest < highest"
            )
        if not 0.0 <= self.smallest_marker < self.largest_marker:
            raise ValueError(
                f"markers of {self.smallest_marker} to {self.largest_marker} m^2; expected 0 <= smallest < largest"
            )
        if self.depth < 0.0 or self.depth_spread < 0.0:
            raise ValueError(f"depth is {self.depth} m, depth_spread {self.depth_spread} m; expected >= 0 m")


def find_opponents(
    uprights: Sequence[Feature], segmentation: Segmentation, view: View, parameters: OpponentParameters
) -> Findings:
    """Return opponents: direction of the ground below each; elevation NaN where the feet are not in view.

    Args:
        uprights: Goal posts and poles of the same picture: they stand on the carpet, but are no feet.
        segmentation: Of the picture.
        view: Of the picture.
        parameters: How an opponent is recognised.
    """
    colour = MARKERS[parameters.team_colour][1]
    above = max(parameters.highest_marker - view.height, 0.0)
    top = view.first_row(above / math.hypot(above, NEAREST))
    found = patches(segmentation.mask(colour, top), parameters.least_area, MOST_CANDIDATES, (0, top))
    markers = markers_of([(points, area) for points, area in found if is_compact(points, area)], view)
    found_so_far = _Found(view, parameters)
    for marker in markers:
        if not found_so_far.covers(marker):
            found_so_far.take(marker, _examine(marker, markers, uprights, segmentation, view, parameters))
    legs = [
        (body, _examine_legs(body, uprights, segmentation, view, parameters))
        for body in cut_bodies(segmentation, view)
        if not found_so_far.covers(body)
    ]
    for body, result in sorted(legs, key=lambda pair: _lowest(pair[1])):  # arms seem to stand behind the legs
        if not found_so_far.covers(body):
            found_so_far.take(body, result)
    return found_so_far.findings()


class _Found:
    """The opponents of one picture so far."""

    def __init__(self, view: View, parameters: OpponentParameters) -> None:
        self._view, self._parameters = view, parameters
        self._opponents: list[Feature] = []
        self._reach: list[float] = []  # [rad] half the angle that each fills
        self._refusals: list[Refusal] = []

    def covers(self, marker: Marker) -> bool:
        """Return whether a marker is another one of an opponent already found."""
        known = zip(self._opponents, self._reach, strict=True)
        return any(angle_between(marker.azimuth, opponent.azimuth) < angle for opponent, angle in known)

    def take(self, marker: Marker, result: Feature | str) -> None:
        """Take what the examination of a marker gave."""
        if isinstance(result, Feature) and any(self._same(result, other) for other in self._opponents):
            result = "part of an opponent already found"
        if isinstance(result, str):
            self._refusals.append(Refusal(FeatureClass.OPPONENT, marker.pixel, result))
            return
        self._opponents.append(result)
        if math.isnan(result.elevation):
            self._reach.append(NEAR_REACH)
        else:
            half_width = self._parameters.half_width
            self._reach.append(1.2 * half_width * math.tan(-result.elevation) / self._view.height)

    def findings(self) -> Findings:
        """Return all opponents and refusals."""
        return Findings(tuple(self._opponents), tuple(self._refusals))

    def _same(self, one: Feature, other: Feature) -> bool:
        """Return whether two opponents would stand in one another."""
        if math.isnan(one.elevation) or math.isnan(other.elevation):
            return angle_between(one.azimuth, other.azimuth) < NEAR_REACH
        ground = self._view.ground(np.stack([direction_of(each.azimuth, each.elevation) for each in (one, other)]))
        return float(np.linalg.norm(ground[0] - ground[1])) < 2.0 * self._parameters.half_width


def _lowest(result: Feature | str) -> float:
    """Return what sorts the nearest first: those whose feet are below the picture, then by elevation."""
    if isinstance(result, str):
        return math.inf
    return -math.inf if math.isnan(result.elevation) else result.elevation


def _examine(
    marker: Marker,
    markers: list[Marker],
    uprights: Sequence[Feature],
    segmentation: Segmentation,
    view: View,
    parameters: OpponentParameters,
) -> Feature | str:
    pixel = view.angle_per_pixel(direction_of(marker.azimuth, marker.low))
    middle = math.tan(0.5 * (marker.low + marker.high))
    if middle > 0.0:
        # Seen above the camera's height, a marker of allowed height is close, and so it is large in the picture.
        farthest = max(parameters.highest_marker - view.height, 0.0) / middle
        if marker.area * (pixel * farthest) ** 2 < parameters.smallest_marker and not marker.cut:
            return "too high above the ground"
    width = marker.left - marker.right
    # First look: as wide as the markers at the same height together, which is enough to hit a foot or a leg.
    group = joined(marker, markers, 2.0 * (marker.high - marker.low))
    least = WIDTH_OF_CUT if marker.cut else 0.0
    half = max(0.6 * (group.left - group.right), width, least) + 2.0 * pixel
    if not hides_carpet(marker, 1.5 * min(half, NEAR_REACH) / pixel, segmentation):
        return "no body that stands on the carpet below the marker"
    low = foot_below(group, min(half, NEAR_REACH), parameters.half_width, least, uprights, segmentation, view, pixel)
    if low is None:
        return "no body that stands on the carpet below the marker"
    if math.isnan(low):
        return _without_feet(marker, markers, view, parameters)
    distance = view.height / math.tan(-low)
    if distance > parameters.farthest:
        return "stands beyond the carpet"
    marker_height = view.height + distance * math.tan(0.5 * (marker.low + marker.high))
    if not parameters.lowest_marker <= marker_height <= parameters.highest_marker:
        return f"marker {marker_height:.2f} m above the ground"
    if painted_share(marker, low, segmentation, view) > 0.25:
        return "yellow or blue below the marker: a pole"
    area = marker.area * (pixel * math.hypot(distance, view.height)) ** 2
    if area > parameters.largest_marker or (area < parameters.smallest_marker and not marker.cut):
        return f"marker of {area:.3f} m^2"
    marker = joined(marker, markers, 2.0 * parameters.half_width / distance)
    if (
        carpet_beside(marker.azimuth, low, parameters.half_width / distance, segmentation, view, pixel)
        < low + 3 * pixel
    ):
        return "the carpet ends beside it, too: it stands behind the carpet"
    confidence = min(1.0, 0.6 + 0.4 * marker.area / (20.0 * parameters.least_area))
    return _standing(marker, low, confidence, segmentation, view, parameters)


def _examine_legs(
    body: Marker,
    uprights: Sequence[Feature],
    segmentation: Segmentation,
    view: View,
    parameters: OpponentParameters,
) -> Feature | str:
    """Return who stands below the place where the picture's upper edge cuts a body: its marker is above the picture."""
    pixel = view.angle_per_pixel(direction_of(body.azimuth, body.low))
    half = 0.5 * (body.left - body.right) + 2.0 * pixel
    if half > NEAR_REACH:
        return "no leg is so wide"
    low = foot_below(body, half, parameters.half_width, WIDTH_OF_CUT, uprights, segmentation, view, pixel)
    if low is None:
        return "nothing that stands on the carpet"
    if math.isnan(low):
        spread, _ = view.spreads(direction_of(body.azimuth, body.low), 3.0)
        return Feature(FeatureClass.OPPONENT, body.azimuth, nan, math.hypot(spread, half), nan, confidence=0.4)
    distance = view.height / math.tan(-low)
    height = view.height + distance * math.tan(body.low)
    if not LEAST_OF_LEGS <= height <= parameters.highest_marker:
        return f"cut {height:.2f} m above the ground"
    if painted_share(body, low, segmentation, view) > 0.25:
        return "yellow or blue: a post or a pole"
    return _standing(body, low, 0.5, segmentation, view, parameters)


def _standing(
    marker: Marker,
    low: float,
    confidence: float,
    segmentation: Segmentation,
    view: View,
    parameters: OpponentParameters,
) -> Feature:
    """Return an opponent whose lowest point is seen, at elevation `low` [rad]."""
    distance = view.height / math.tan(-low)
    azimuth, whole = middle_of(marker, low, distance, parameters.half_width, segmentation, view)
    elevation = -math.atan2(view.height, distance + parameters.depth)
    spread_azimuth, spread_elevation = view.spreads(direction_of(azimuth, elevation), 2.0)
    # With bent knees a robot's feet, legs and markers are up to 0.12 m from one another, to a side that its heading
    # decides. Of one seen in part, the rest may be on either side, and the foot that is seen need not be the nearer.
    unsure = 1.0 if whole else PARTLY_SEEN
    across = unsure * MIDDLE_SPREAD / distance  # [rad]
    along = unsure * parameters.depth_spread * view.height / (view.height**2 + distance**2)
    return Feature(
        FeatureClass.OPPONENT,
        azimuth,
        elevation,
        math.hypot(spread_azimuth, across),
        math.hypot(spread_elevation, along),
        confidence=confidence,
    )


def _without_feet(marker: Marker, markers: list[Marker], view: View, parameters: OpponentParameters) -> Feature | str:
    """Return an opponent so close that its feet are below the picture: its azimuth only."""
    if marker.area < 40.0 * parameters.least_area:
        return "feet out of the picture and the marker small"
    if marker.low + marker.high > 0.2:
        return "feet out of the picture and the marker high up"
    # As wide as a body whose markers are so high: shirts of people beyond the field may be at the same height.
    whole = joined(marker, markers, min(2.0 * (marker.high - marker.low), NEAR_REACH))
    spread, _ = view.spreads(direction_of(whole.azimuth, whole.low), 3.0)
    return Feature(FeatureClass.OPPONENT, whole.azimuth, nan, math.hypot(spread, 0.05), nan, confidence=0.4)
