"""Opponents: a marker in the other team's colour on a body that stands on the carpet.

The ground point below is found by following the body down from the marker, in a fan of vertical cuts,
until the carpet begins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.features import Feature, FeatureClass
from tulip_vision.findings import Findings, Refusal
from tulip_vision.patches import patches
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import Array, View, direction_of, fan_of

MARKERS = {"cyan": (Colour.CYAN, Colour.MAGENTA), "magenta": (Colour.MAGENTA, Colour.CYAN)}
"""Own marker colour and the opponents', by the own team's colour."""

MOST_CANDIDATES = 8
"""The largest patches in the marker's colour are looked at."""

NEAR_REACH = 0.5
"""[rad] half the angle that an opponent fills whose feet are below the picture: it is less than a metre away."""
NEAREST = 0.4
"""[m] along the ground to an opponent's nearest marker: closer, the robots touch."""
PARTLY_SEEN = 2.5
"""How many times less sure the place of an opponent is that the picture's edge or the own body hides in part."""
UPRIGHT_RADIUS = 0.15
"""[m] from the axis of a post or pole up to which what touches the carpet is its foot: the net's and a shadow's too."""
CARPET = Colour.GREEN | Colour.WHITE
FIRST_LOOK, SECOND_LOOK = (9, 3.0), (13, 2.0)
"""Number of cuts, and the distance between their samples [px]: the first look only says where to look closer."""
LEAST_HIDDEN = 4
"""[px] of carpet that a body hides, in height and in width: a foot 9 m away is twice that wide."""
MOST_DOWN = 480.0
"""[px] from a marker downwards."""


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


@dataclass(frozen=True)
class _Marker:
    left: float  # [rad]
    right: float
    low: float
    high: float
    area: float  # [px^2]
    pixel: tuple[float, float]

    @property
    def azimuth(self) -> float:
        return 0.5 * (self.left + self.right)


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
    markers = _markers([(points, area) for points, area in found if _compact(points, area)], view)
    opponents: list[Feature] = []
    reach: list[float] = []  # [rad] half the angle that each opponent fills
    refusals: list[Refusal] = []
    for marker in markers:
        if any(
            _angle(marker.azimuth, opponent.azimuth) < angle for opponent, angle in zip(opponents, reach, strict=True)
        ):
            continue  # another marker of an opponent already found
        result = _examine(marker, markers, uprights, segmentation, view, parameters)
        if isinstance(result, Feature) and any(_same(result, other, view, parameters) for other in opponents):
            result = "part of an opponent already found"
        if isinstance(result, str):
            refusals.append(Refusal(FeatureClass.OPPONENT, marker.pixel, result))
            continue
        opponents.append(result)
        if math.isnan(result.elevation):
            reach.append(NEAR_REACH)
        else:
            reach.append(1.2 * parameters.half_width * math.tan(-result.elevation) / view.height)
    return Findings(tuple(opponents), tuple(refusals))


def _same(one: Feature, other: Feature, view: View, parameters: OpponentParameters) -> bool:
    """Return whether two opponents would stand in one another."""
    if math.isnan(one.elevation) or math.isnan(other.elevation):
        return _angle(one.azimuth, other.azimuth) < NEAR_REACH
    ground = view.ground(np.stack([direction_of(each.azimuth, each.elevation) for each in (one, other)]))
    return float(np.linalg.norm(ground[0] - ground[1])) < 2.0 * parameters.half_width


def _compact(points: NDArray[np.int32], area: float) -> bool:
    """Return whether a patch is a marker and not a thin border where two other colours blend."""
    _, _, width, height = cv2.boundingRect(points)
    return bool(min(width, height) >= 3 and area >= 0.4 * width * height)


def _markers(found: list[tuple[NDArray[np.int32], float]], view: View) -> list[_Marker]:
    """Return the markers that patches, each with its area, are; worked on all at once."""
    if not found:
        return []
    lengths = [len(points) for points, _ in found]
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    points = np.concatenate([points for points, _ in found])
    azimuths, elevations = view.angles_at(points)
    reference = np.repeat(azimuths[starts], lengths)
    turned = (azimuths - reference + math.pi) % (2.0 * math.pi) - math.pi + reference  # no jump behind the robot
    left, right = np.maximum.reduceat(turned, starts).tolist(), np.minimum.reduceat(turned, starts).tolist()
    high, low = np.maximum.reduceat(elevations, starts).tolist(), np.minimum.reduceat(elevations, starts).tolist()
    middles = (np.add.reduceat(points, starts) / np.array(lengths)[:, None]).tolist()
    columns = zip(left, right, low, high, middles, strict=True)
    return [
        _Marker(one_left, one_right, lowest, highest, area, (u, v))
        for (one_left, one_right, lowest, highest, (u, v)), (_, area) in zip(columns, found, strict=True)
    ]


def _examine(
    marker: _Marker,
    markers: list[_Marker],
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
        if marker.area * (pixel * farthest) ** 2 < parameters.smallest_marker:
            return "too high above the ground"
    width = marker.left - marker.right
    # First look: as wide as the markers at the same height together, which is enough to hit a foot or a leg.
    group = _joined(marker, markers, 2.0 * (marker.high - marker.low))
    half = max(0.6 * (group.left - group.right), width) + 2.0 * pixel
    if not _hides_carpet(marker, 1.5 * min(half, NEAR_REACH) / pixel, segmentation):
        return "no body that stands on the carpet below the marker"
    low = _contact(group, min(half, NEAR_REACH), FIRST_LOOK, uprights, segmentation, view, pixel)
    if low is None:
        return "no body that stands on the carpet below the marker"
    if math.isnan(low):
        return _without_feet(marker, markers, view, parameters)
    if low > -1e-3 or view.height / math.tan(-low) > parameters.farthest:
        return "stands beyond the carpet"
    # Second look, with the width that a body has at this range.
    distance = view.height / math.tan(-low)
    again = _contact(group, parameters.half_width / distance, SECOND_LOOK, uprights, segmentation, view, pixel)
    if again is not None and math.isnan(again):
        return _without_feet(marker, markers, view, parameters)
    low = low if again is None else again
    distance = view.height / math.tan(-low)
    marker_height = view.height + distance * math.tan(0.5 * (marker.low + marker.high))
    if not parameters.lowest_marker <= marker_height <= parameters.highest_marker:
        return f"marker {marker_height:.2f} m above the ground"
    if _painted(marker, low, segmentation, view) > 0.25:
        return "yellow or blue below the marker: a pole"
    area = marker.area * (pixel * math.hypot(distance, view.height)) ** 2
    if not parameters.smallest_marker <= area <= parameters.largest_marker:
        return f"marker of {area:.3f} m^2"
    marker = _joined(marker, markers, 2.0 * parameters.half_width / distance)
    if (
        _carpet_beside(marker.azimuth, low, parameters.half_width / distance, segmentation, view, pixel)
        < low + 3 * pixel
    ):
        return "the carpet ends beside it, too: it stands behind the carpet"
    azimuth, whole = _middle(marker, low, distance, segmentation, view, parameters)
    elevation = -math.atan2(view.height, distance + parameters.depth)
    spread_azimuth, spread_elevation = view.spreads(direction_of(azimuth, elevation), 2.0)
    # Arms and legs make the middle of a body uncertain by 5 cm; of one seen in part, the rest may be on either side,
    # and the foot that is seen need not be the nearer one.
    unsure = 1.0 if whole else PARTLY_SEEN
    across = unsure * 0.05 / distance  # [rad]
    along = unsure * parameters.depth_spread * view.height / (view.height**2 + distance**2)
    return Feature(
        FeatureClass.OPPONENT,
        azimuth,
        elevation,
        math.hypot(spread_azimuth, across),
        math.hypot(spread_elevation, along),
        confidence=min(1.0, 0.6 + 0.4 * marker.area / (20.0 * parameters.least_area)),
    )


def _hides_carpet(marker: _Marker, reach: float, segmentation: Segmentation) -> bool:
    """Return whether something hides a bit of the carpet below a marker: no look at those behind the carpet's edge.

    Args:
        marker: Of the candidate.
        reach: How far to either side to look [px].
        segmentation: Of the picture.
    """
    u, v = marker.pixel
    step = 1 + int(reach) // 40  # of what is large and close, some of the pixels tell enough
    part = slice(max(int(v), 0), None, step), slice(max(int(u - reach), 0), max(int(u + reach) + 2, 0), step)
    bare = segmentation.classes[part] & np.uint8(CARPET | Colour.ORANGE | Colour.YELLOW | Colour.BLUE) == 0
    bare &= segmentation.on_carpet[part] != 0
    hidden = cv2.reduce(bare.view(np.uint8), 0, cv2.REDUCE_SUM, dtype=cv2.CV_32S)
    return int(np.count_nonzero(hidden >= LEAST_HIDDEN)) >= LEAST_HIDDEN


def _without_feet(marker: _Marker, markers: list[_Marker], view: View, parameters: OpponentParameters) -> Feature | str:
    """Return an opponent so close that its feet are below the picture: its azimuth only."""
    if marker.area < 40.0 * parameters.least_area:
        return "feet out of the picture and the marker small"
    if marker.low + marker.high > 0.2:
        return "feet out of the picture and the marker high up"
    # As wide as a body whose markers are so high: shirts of people beyond the field may be at the same height.
    whole = _joined(marker, markers, min(2.0 * (marker.high - marker.low), NEAR_REACH))
    spread, _ = view.spreads(direction_of(whole.azimuth, whole.low), 3.0)
    return Feature(FeatureClass.OPPONENT, whole.azimuth, nan, math.hypot(spread, 0.05), nan, confidence=0.4)


def _joined(marker: _Marker, markers: list[_Marker], reach: float) -> _Marker:
    """Return a marker together with the others of the same opponent.

    Those are the ones within `reach` [rad] to either side that are at the same height.
    """
    same = [
        other
        for other in markers
        if other is marker
        or (_angle(other.azimuth, marker.azimuth) < reach and other.low < marker.high and other.high > marker.low)
    ]
    return replace(
        marker,
        left=max(other.left for other in same),
        right=min(other.right for other in same),
        low=min(other.low for other in same),
        high=max(other.high for other in same),
    )


def _contact(
    marker: _Marker,
    half: float,
    look: tuple[int, float],
    uprights: Sequence[Feature],
    segmentation: Segmentation,
    view: View,
    pixel: float,
) -> float | None:
    """Return the elevation at which the body's lowest point meets the carpet [rad].

    NaN means that the body goes on below the picture, or behind the own body; None that no body stands on the carpet
    there.

    Args:
        marker: Where to start.
        half: Half the angle of the fan [rad].
        look: Number of cuts, and the distance between their samples [px].
        uprights: Goal posts and poles.
        segmentation: Of the picture.
        view: Of the picture.
        pixel: Angle of one pixel [rad].
    """
    azimuths = np.linspace(marker.azimuth - half, marker.azimuth + half, look[0])
    step = look[1] * pixel
    bottom = view.lowest_elevation - 3.0 * step
    elevations = np.arange(0.5 * (marker.low + marker.high), bottom, -step)[: int(MOST_DOWN / look[1])]
    if len(elevations) < 4:
        return None  # the marker touches the lower edge of the picture
    pixels = view.pixels_of_directions(fan_of(azimuths, elevations))
    images = (segmentation.classes, segmentation.on_carpet, segmentation.own_body)
    (classes, on_carpet, own_body), inside = view.sample_all(images, pixels)
    shape = (len(elevations), len(azimuths))
    own = (own_body != 0).reshape(shape)
    # A ball at the feet is no part of the body.
    carpet = (belongs(classes, CARPET | Colour.ORANGE) & (on_carpet != 0)).reshape(shape)
    seen = inside.reshape(shape) & ~own
    # The carpet begins where three samples in a row are carpet; a single one is noise. What the own body hides, and
    # all below it, tells nothing.
    begins = carpet[:-2] & carpet[1:-1] & carpet[2:] & ~np.logical_or.accumulate(own, axis=0)[:-2]
    has = begins.any(axis=0)
    first = begins.argmax(axis=0)
    starts_on_body = ~carpet[0] & seen[0]
    # A body hides carpet: above its foot the picture shows something else inside the carpet's outline.
    painted = belongs(classes, Colour.YELLOW | Colour.BLUE)
    hides = ~carpet & (on_carpet != 0).reshape(shape) & ~painted.reshape(shape) & ~own
    hidden = np.array([np.count_nonzero(hides[: first[column], column]) for column in range(len(azimuths))])
    standing = has & starts_on_body & (hidden >= 2)
    standing &= ~_on_upright(azimuths, elevations[np.minimum(first, len(elevations) - 1)], uprights, view, pixel)
    hidden_below = np.count_nonzero(hides, axis=0)
    if np.count_nonzero(starts_on_body & ~has & (hidden_below >= 2)) >= 2:
        return nan  # some cuts leave the picture on the body: its lowest point is not seen
    if np.count_nonzero(standing) < 2:
        return None
    rows = np.sort(first[standing])
    return float(elevations[rows[-2]]) + 0.25 * step  # the second lowest: one cut may follow a ball or a shadow


def _carpet_beside(
    azimuth: float, low: float, half: float, segmentation: Segmentation, view: View, pixel: float
) -> float:
    """Return the elevation up to which there is carpet beside a body [rad], the mean of both sides.

    A body that stands on the carpet hides some of it. What is seen of people behind the carpet seems to stand where
    the carpet ends, but there it ends beside them too. What the picture does not show counts as carpet.

    Args:
        azimuth: Of the body's middle [rad].
        low: Elevation of its lowest point [rad].
        half: Half the angle that it fills [rad].
        segmentation: Of the picture.
        view: Of the picture.
        pixel: Angle of one pixel [rad].
    """
    beside = half * np.array([1.3, 1.7, 2.1, 2.5])
    azimuths = np.concatenate([azimuth - beside, azimuth + beside])
    elevations = low + pixel * np.arange(20.0, -4.0, -1.0)
    pixels = view.pixels_of_directions(fan_of(azimuths, elevations))
    images = (segmentation.classes, segmentation.on_carpet, segmentation.own_body)
    (classes, on_carpet, own_body), inside = view.sample_all(images, pixels)
    carpet = (belongs(classes, CARPET) & (on_carpet != 0)) | ~inside | (own_body != 0)
    carpet = carpet.reshape(len(elevations), len(azimuths))
    begins = carpet[:-1] & carpet[1:]  # a single sample is noise
    tops = np.where(begins.any(axis=0), elevations[begins.argmax(axis=0)], elevations[-1])
    return 0.5 * float(tops[: len(beside)].max() + tops[len(beside) :].max())


def _on_upright(
    azimuths: Array, lows: Array, uprights: Sequence[Feature], view: View, pixel: float
) -> NDArray[np.bool_]:
    """Return (n,) whether places where something meets the carpet, as angles (n,), are feet of goal posts or poles."""
    found = np.zeros(len(azimuths), dtype=np.bool_)
    for upright in uprights:
        if not math.isnan(upright.elevation):
            half = UPRIGHT_RADIUS * math.tan(-upright.elevation) / view.height + 2.0 * pixel
            apart = np.abs((azimuths - upright.azimuth + math.pi) % (2.0 * math.pi) - math.pi)
            found |= (apart < half) & (np.abs(lows - upright.elevation) < half)
    return found


def _painted(marker: _Marker, low: float, segmentation: Segmentation, view: View) -> float:
    """Return the share of yellow and blue between the marker's middle and the foot."""
    elevations = np.linspace(low, 0.5 * (marker.low + marker.high), 24)
    azimuths = np.linspace(marker.right, marker.left, 5)
    classes, inside = view.sample(segmentation.classes, view.pixels_of_directions(fan_of(azimuths, elevations)))
    return float(belongs(classes, Colour.YELLOW | Colour.BLUE)[inside].mean()) if inside.any() else 0.0


def _middle(
    marker: _Marker, low: float, distance: float, segmentation: Segmentation, view: View, parameters: OpponentParameters
) -> tuple[float, bool]:
    """Return the azimuth of the body's middle, and whether all of the body is in view.

    The middle is that of what is not carpet between the feet and the carpet's far edge.
    """
    half = 1.3 * parameters.half_width / distance
    azimuths = np.linspace(marker.azimuth - half, marker.azimuth + half, 41)
    elevations = np.linspace(low + 0.02 / distance, min(marker.high, low + 0.9 / distance), 12)
    pixels = view.pixels_of_directions(fan_of(azimuths, elevations))
    images = (segmentation.classes, segmentation.on_carpet, segmentation.own_body)
    (classes, on_carpet, own_body), inside = view.sample_all(images, pixels)
    inside &= own_body == 0
    shape = (len(elevations), len(azimuths))
    other = Colour.ORANGE | Colour.YELLOW | Colour.BLUE
    body = (~belongs(classes, CARPET | other) & inside & (on_carpet != 0)).reshape(shape)
    complete = (inside & (on_carpet != 0)).reshape(shape).all(axis=1)
    rows = complete & body.any(axis=1) & (body.mean(axis=1) < 0.8)
    if np.count_nonzero(rows) < 2:
        return marker.azimuth, bool(inside.all())
    left = np.array([azimuths[row].max() for row in body[rows]])
    right = np.array([azimuths[row].min() for row in body[rows]])
    middle = float(np.median(0.5 * (left + right)))
    # Legs and marker agree on most bodies; where they do not, the truth is between them.
    return 0.5 * (middle + marker.azimuth), bool(inside.all())


def _angle(first: float, second: float) -> float:
    return abs((first - second + math.pi) % (2.0 * math.pi) - math.pi)
