"""The body of an opponent: followed down from its marker, in a fan of vertical cuts, until the carpet begins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from math import nan

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.body_growth import lowest_of_body
from tulip_vision.features import Feature
from tulip_vision.opponent_markers import NO_BODY, Marker
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import Array, View, fan_of

HORIZON = -1e-3
"""[rad] elevation above which nothing stands on the carpet: it would be a kilometre away."""
UPRIGHT_RADIUS = 0.15
"""[m] from the axis of a post or pole up to which what touches the carpet is its foot: the net's and a shadow's too."""
CARPET = Colour.GREEN | Colour.WHITE
LEAST_HIDDEN = 4
"""[px] of carpet that a body hides, in height and in width: a foot 9 m away is twice that wide."""
MOST_DOWN = 480.0
"""[px] from a marker downwards."""

FIRST_LOOK, CLOSE_LOOK = (9, 3.0), (13, 2.0)
"""Number of cuts, and the distance between their samples [px]: the first look only says where to look closer."""
SPREADS = {cuts: np.linspace(-1.0, 1.0, cuts) for cuts, _ in (FIRST_LOOK, CLOSE_LOOK)}
MOST_LOOKS = 3
"""Closer ones."""


def hides_carpet(marker: Marker, reach: float, segmentation: Segmentation) -> bool:
    """Return whether something hides a bit of the carpet below a marker: no look at those behind the carpet's edge.

    Args:
        marker: Of the candidate.
        reach: How far to either side to look [px].
        segmentation: Of the picture.
    """
    u, v = marker.pixel
    step = 1 + int(reach) // 40  # of what is large and close, some of the pixels tell enough
    part = slice(max(int(v), 0), None, step), slice(max(int(u - reach), 0), max(int(u + reach) + 2, 0), step)
    bare = ~belongs(segmentation.classes[part], NO_BODY)
    bare &= segmentation.on_carpet[part] != 0
    hidden = cv2.reduce(bare.view(np.uint8), 0, cv2.REDUCE_SUM, dtype=cv2.CV_32S)
    return int(np.count_nonzero(hidden >= LEAST_HIDDEN)) >= LEAST_HIDDEN


def foot_below(
    marker: Marker,
    half: float,
    half_width: float,
    least: float,
    uprights: Sequence[Feature],
    segmentation: Segmentation,
    view: View,
    pixel: float,
) -> float | None:
    """Return the elevation at which the lowest point of the body below a marker meets the carpet [rad], below 0.

    NaN means that the lowest point is not in view; None that no body stands on the carpet there.

    Args:
        marker: Where to start.
        half: Half the angle of the first look [rad].
        half_width: Of a body [m].
        least: Half the angle of a closer look at least [rad].
        uprights: Goal posts and poles.
        segmentation: Of the picture.
        view: Of the picture.
        pixel: Angle of one pixel [rad].
    """
    low = _contact(marker, half, FIRST_LOOK, uprights, segmentation, view, pixel)
    if low is None or math.isnan(low):
        return low
    if low > HORIZON:
        return None
    # Closer looks, with the width that a body has at the range found before; nearer than thought, it is wider.
    for _ in range(MOST_LOOKS):
        distance = view.height / math.tan(-low)
        again = _contact(marker, max(half_width / distance, least), CLOSE_LOOK, uprights, segmentation, view, pixel)
        if again is None or again > HORIZON:
            break
        low = again
        if math.isnan(low) or view.height / math.tan(-low) > 0.9 * distance:
            break
    return low


def _contact(
    marker: Marker,
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
    azimuths = marker.azimuth + half * SPREADS[look[0]]
    step = look[1] * pixel
    bottom = view.lowest_elevation - 3.0 * step
    elevations = np.arange(0.5 * (marker.low + marker.high), bottom, -step)[: int(MOST_DOWN / look[1])]
    if len(elevations) < 4:
        return None  # the marker touches the lower edge of the picture
    pixels = view.pixels_of_directions(fan_of(azimuths, elevations))
    images = (segmentation.classes, segmentation.on_carpet, segmentation.own_body)
    cut, inside = view.sample_all(images, pixels)
    shape = (len(elevations), len(azimuths))
    no_body, painted = int(CARPET | Colour.ORANGE), int(Colour.YELLOW | Colour.BLUE)
    lowest, goes_on = lowest_of_body(*(each.reshape(shape) for each in (*cut, inside)), no_body, painted)
    if np.count_nonzero(goes_on) >= 2:
        return nan  # some cuts leave the picture on the body: its lowest point is not seen
    ends = np.minimum(lowest + 1, len(elevations) - 1)
    standing = (lowest >= 0) & ~_on_upright(azimuths, elevations[ends], uprights, view, pixel)
    if np.count_nonzero(standing) < 2:
        return None
    rows = np.sort(ends[standing])
    return float(elevations[rows[-2]]) + 0.25 * step  # the second lowest: one cut may follow a ball or a shadow


def carpet_beside(
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


def painted_share(marker: Marker, low: float, segmentation: Segmentation, view: View) -> float:
    """Return the share of yellow and blue between the marker's middle and the foot."""
    elevations = np.linspace(low, 0.5 * (marker.low + marker.high), 24)
    azimuths = np.linspace(marker.right, marker.left, 5)
    classes, inside = view.sample(segmentation.classes, view.pixels_of_directions(fan_of(azimuths, elevations)))
    return float(belongs(classes, Colour.YELLOW | Colour.BLUE)[inside].mean()) if inside.any() else 0.0


def middle_of(
    marker: Marker, low: float, distance: float, half_width: float, segmentation: Segmentation, view: View
) -> tuple[float, bool]:
    """Return the azimuth of the body's middle, and whether all of the body is in view.

    The middle is that of what is not carpet between the feet and the carpet's far edge.
    """
    half = 1.3 * half_width / distance
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
    chosen = body[rows]
    left, right = azimuths[len(azimuths) - 1 - chosen[:, ::-1].argmax(axis=1)], azimuths[chosen.argmax(axis=1)]
    middle = float(np.median(0.5 * (left + right)))
    # Legs and marker agree on most bodies; where they do not, the truth is between them.
    return 0.5 * (middle + marker.azimuth), bool(inside.all())
