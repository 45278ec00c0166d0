"""Boxes of colour classes from labelled places in pictures, or from what the present boxes find.

A class begins with the colours of its labels (or, without labels, of what the present box finds on the carpet). Then,
some times over: its pixels are looked for with the present box, patches that hang together with the labels grow into
neighbours of nearly the same colour, and the box is fitted to all of them anew. Values are divided by the carpet's
brightness in their picture, as segmentation multiplies them with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.colour_file import ColourFile
from tulip_vision.segmentation import Colour, ColourBox, ColourBoxes, SegmentationParameters

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Rectangle = tuple[int, int, int, int]
"""x, y of the upper left pixel, width and height [px]."""

NAMES = tuple(str(colour.name).lower() for colour in Colour)
COLOURLESS = ("white", "dark")
ROUNDS = 4
REACH = 2  # [px] by which patches grow in a round
SHARE = 0.02  # of the pixels at either end that may be another thing: edges, reflections
HUE_MARGIN, SATURATION_MARGIN, VALUE_SHARE = 7.0, 0.10, 0.75  # [deg], -, of the least value: light differs by place
MOST_SHIFT = 12.0  # [deg] beyond the bounds known before, without labels
MOST_MORE = 2.0  # times the pixels of a class before, without labels
MOST_GROWTH = 16.0  # [deg] beyond the hues that a class began with
FEWEST = 12  # px of a class; fewer tell nothing of its spread
SMALLEST_PATCH = 25  # px of a patch found without a label
LIKE_MIDDLE = 40  # grey levels that the pixels of a label may differ from those in its middle
ALIKE = 0.25  # share of the pixels of a label that may look like another class
LEAST_CHROMA = 0.12  # saturation below which a hue says nothing
CORE_HUE, CORE_SATURATION, CORE_VALUE = 10.0, 0.12, 0.35  # [deg], -, share of neighbours that a patch grows into
COLOURLESS_SHARE = 0.10  # as SHARE: a white line is thin, and its edges are half carpet
COLOURLESS_CORE, COLOURLESS_GROWTH = 0.08, 0.08  # of saturation and value: beyond white lie grey floor and pale walls


class ColourFitError(ValueError):
    """The pictures do not tell what a colour is; the message says why."""


@dataclass(frozen=True)
class ColourFit:
    """Boxes and what they were made from.

    Attributes:
        colours: The result.
        before, after: Pixels of each class in all pictures with the boxes given and found.
        used: Pixels that each fitted class was made from; classes that are missing stayed as they were.
    """

    colours: ColourFile
    before: Mapping[str, int]
    after: Mapping[str, int]
    used: Mapping[str, int]


class _Seen:
    """A picture as hue [deg], saturation and value, float32."""

    def __init__(self, picture: Picture) -> None:
        self.picture = picture
        hsv = cv2.cvtColor(picture.astype(np.float32) / 255.0, cv2.COLOR_BGR2HSV)
        self.hue, self.saturation, self.value = (np.asarray(hsv[..., index]) for index in range(3))
        self.brightness = 1.0

    def inside(self, box: ColourBox) -> Mask:
        """Return (h, w) whether each pixel lies in a box, as segmentation's tables decide it."""
        low, high = box.hue
        hue = self.hue
        in_hue = (hue >= low) & (hue <= high) if low <= high else (hue >= low) | (hue <= high)
        least = min(box.value[0] * self.brightness, 0.8)
        most = 1.0 if box.value[1] >= 1.0 else min(box.value[1] * self.brightness, 1.0)
        in_saturation = (self.saturation >= box.saturation[0]) & (self.saturation <= box.saturation[1])
        found: Mask = in_hue & in_saturation & (self.value >= least) & (self.value <= most)
        return found


def fit_colours(
    pictures: Mapping[str, Picture],
    labels: Mapping[str, Mapping[str, Sequence[Rectangle]]],
    start: SegmentationParameters | None = None,
) -> ColourFit:
    """Find the boxes of colour classes.

    Args:
        pictures: (h, w, 3) BGR, by name.
        labels: Rectangles that show nothing but one class, by class, by name of the picture. Without any label all
            classes that the start's boxes find on the carpet are fitted to what they find.
        start: The boxes as they were; they stay for classes that nothing is known of.

    Raises:
        ColourFitError: if a label is outside its picture, of no class or picture, or shows too little.
    """
    start = start or SegmentationParameters()
    check_labels(pictures, labels)
    seen = {name: _Seen(picture) for name, picture in pictures.items()}
    boxes = {name: start.colours.of(Colour[name.upper()]) for name in NAMES}
    labelled = {name for of_picture in labels.values() for name in of_picture}
    wanted = [name for name in NAMES if name in labelled] if labelled else list(NAMES)
    used: dict[str, int] = {}
    _set_brightness(seen, boxes["green"], start.reference_brightness)
    before = {name: sum(int(each.inside(boxes[name]).sum()) for each in seen.values()) for name in NAMES}
    for name in wanted:  # green comes first: the brightness of all others depends on it
        if labelled:
            seeds = {key: _label_mask(each, labels.get(key, {}).get(name, ())) for key, each in seen.items()}
        else:
            seeds = {key: _found_mask(each, boxes[name], boxes["green"], name) for key, each in seen.items()}
        if labelled and name == "green":
            _set_brightness(seen, _box_of(seen, seeds, name), start.reference_brightness)
        count = sum(int(seed.sum()) for seed in seeds.values())
        if count < FEWEST:
            if labelled:
                raise ColourFitError(f"the labels of {name} have {count} px; expected at least {FEWEST} px")
            continue
        box, pixels = _grow(seen, seeds, name)
        if not labelled:
            box = _near(box, boxes[name], name)
            if sum(int(each.inside(box).sum()) for each in seen.values()) > MOST_MORE * before[name]:
                continue  # it has grown into something else
        boxes[name], used[name] = box, pixels
        if name == "green":
            _set_brightness(seen, boxes["green"], start.reference_brightness)
    _part(boxes, used)
    _check_apart(seen, labels, boxes)
    after = {name: sum(int(each.inside(boxes[name]).sum()) for each in seen.values()) for name in NAMES}
    return ColourFit(colour_file(boxes, start.reference_brightness), before, after, used)


def colour_file(boxes: Mapping[str, ColourBox], reference_brightness: float) -> ColourFile:
    """Return boxes by class as the content of a colour file, rounded to what is meant."""
    rounded = {
        name: {
            "hue": (round(box.hue[0], 1), round(box.hue[1], 1)),
            "saturation": (round(box.saturation[0], 3), round(box.saturation[1], 3)),
            "value": (round(box.value[0], 3), round(box.value[1], 3)),
        }
        for name, box in boxes.items()
    }
    return ColourFile(rounded, reference_brightness)


def segmentation_parameters(colours: ColourFile) -> SegmentationParameters:
    """Return the parameters of segmentation with the boxes of a colour file.

    Raises:
        ValueError: if a bound is out of range.
    """
    boxes = {entry.name: ColourBox(**colours.boxes[entry.name]) for entry in fields(ColourBoxes)}
    return SegmentationParameters(colours=ColourBoxes(**boxes), reference_brightness=colours.reference_brightness)


def check_labels(pictures: Mapping[str, Picture], labels: Mapping[str, Mapping[str, Sequence[Rectangle]]]) -> None:
    """Check that labels are of classes and lie inside their pictures.

    Raises:
        ColourFitError: if one does not.
    """
    for name, of_picture in labels.items():
        if name not in pictures:
            raise ColourFitError(f"labels are given for {name}; expected one of {', '.join(pictures)}")
        height, width = pictures[name].shape[:2]
        for colour, rectangles in of_picture.items():
            if colour not in NAMES:
                raise ColourFitError(f"there is no colour class {colour!r}; expected one of {', '.join(NAMES)}")
            for x, y, w, h in rectangles:
                if w < 1 or h < 1 or x < 0 or y < 0 or x + w > width or y + h > height:
                    raise ColourFitError(
                        f"rectangle {x},{y},{w},{h} of {colour} is not inside {name}; expected it within"
                        f" 0,0,{width},{height}"
                    )


def draw_classes(picture: Picture, colours: ColourFile) -> Picture:
    """Return a picture of which class each pixel is in, in plain colours; pixels of none are dim."""
    paint = {
        "green": (0, 150, 0),
        "white": (255, 255, 255),
        "orange": (0, 120, 255),
        "yellow": (0, 230, 255),
        "blue": (255, 60, 0),
        "cyan": (255, 255, 0),
        "magenta": (255, 0, 255),
        "dark": (0, 0, 0),
    }
    parameters, seen = segmentation_parameters(colours), {"": _Seen(picture)}
    _set_brightness(seen, parameters.colours.green, parameters.reference_brightness)
    drawn: Picture = (picture // 3 + 40).astype(np.uint8)
    for name in ("dark", *(each for each in NAMES if each != "dark")):
        drawn[seen[""].inside(parameters.colours.of(Colour[name.upper()]))] = paint[name]
    return drawn


def _set_brightness(seen: Mapping[str, _Seen], green: ColourBox, reference: float) -> None:
    """Set the carpet's brightness over the reference in each picture, as segmentation measures it."""
    for each in seen.values():
        carpet = each.value[::8, ::8][each.inside(replace(green, value=(20.0 / 255.0, 1.0)))[::8, ::8]]
        enough = len(carpet) >= 0.02 * each.value[::8, ::8].size
        each.brightness = float(np.median(carpet)) / reference if enough else 1.0


def _label_mask(seen: _Seen, rectangles: Sequence[Rectangle]) -> Mask:
    """Return the pixels of rectangles that are like the rectangle's middle: a line is thinner than a click."""
    mask = np.zeros(seen.hue.shape, dtype=np.bool_)
    for x, y, w, h in rectangles:
        part = seen.picture[y : y + h, x : x + w].astype(np.int16)
        middle = part[(h - 1) // 3 : h - (h - 1) // 3, (w - 1) // 3 : w - (w - 1) // 3].reshape(-1, 3)
        mask[y : y + h, x : x + w] |= (np.abs(part - np.median(middle, axis=0)) < LIKE_MIDDLE).all(axis=2)
    return mask


def _found_mask(seen: _Seen, box: ColourBox, green: ColourBox, name: str) -> Mask:
    """Return the patches of a class on the carpet: inside the hull of the largest green patch."""
    carpet = _patches(seen.inside(green))
    nothing = np.zeros(seen.hue.shape, dtype=np.bool_)
    if not carpet:
        return nothing
    if name == "green":
        return carpet[0]
    points = cv2.findNonZero(carpet[0].astype(np.uint8)).reshape(-1, 1, 2)
    on_carpet = cv2.fillPoly(nothing.astype(np.uint8), [cv2.convexHull(points)], (1,)) != 0
    found = nothing
    mask = seen.inside(box) & on_carpet
    if name not in COLOURLESS:  # thin rims round other things are mixtures; lines are thin themselves
        mask = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) != 0
    for patch in _patches(mask):
        found = found | patch
    return found


def _patches(mask: Mask) -> list[Mask]:
    """Return the connected patches that are no specks, largest first, at most 20."""
    _, labels, numbers, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = numbers[1:, cv2.CC_STAT_AREA]
    order = [index for index in np.argsort(-areas)[:20] if areas[index] >= SMALLEST_PATCH]
    return [labels == index + 1 for index in order]


def _grow(seen: Mapping[str, _Seen], seeds: Mapping[str, Mask], name: str) -> tuple[ColourBox, int]:
    """Return the box of a class, and the number of pixels that it was made from."""
    box = _box_of(seen, seeds, name)
    first = box
    masks = dict(seeds)
    for _ in range(ROUNDS):
        for key, each in seen.items():
            if not seeds[key].any():
                continue
            near = cv2.dilate(masks[key].astype(np.uint8), np.ones((2 * REACH + 1,) * 2, np.uint8)) != 0
            core = _core(each, masks[key], name)
            allowed = each.inside(box) | (near & core)
            _, parts = cv2.connectedComponents((allowed | seeds[key]).astype(np.uint8), connectivity=8)
            touching = np.unique(parts[seeds[key]])
            masks[key] = np.isin(parts, touching[touching > 0])
        grown = _limited(_box_of(seen, masks, name), first, name)
        if grown == box:
            break
        box = grown
    return box, sum(int(mask.sum()) for mask in masks.values())


def _core(seen: _Seen, mask: Mask, name: str) -> Mask:
    """Return the pixels of nearly the middle colour of a patch."""
    saturation, value = (float(np.median(each[mask])) for each in (seen.saturation, seen.value))
    if name in COLOURLESS:
        like: Mask = np.abs(seen.value - value) < COLOURLESS_CORE
        return like if name == "dark" else like & (np.abs(seen.saturation - saturation) < COLOURLESS_CORE)
    close = (np.abs(seen.saturation - saturation) < CORE_SATURATION) & (
        np.abs(seen.value - value) < CORE_VALUE * max(value, 0.2)
    )
    middle = _middle_hue(seen.hue[mask])
    found: Mask = close & (np.abs(_turn(seen.hue - middle)) < CORE_HUE)
    return found


def _box_of(seen: Mapping[str, _Seen], masks: Mapping[str, Mask], name: str) -> ColourBox:
    """Return the box round the colours of masked pixels, all but the outermost, with a margin."""
    hue = np.concatenate([seen[key].hue[mask] for key, mask in masks.items()]).astype(np.float64)
    saturation = np.concatenate([seen[key].saturation[mask] for key, mask in masks.items()]).astype(np.float64)
    value = np.concatenate([seen[key].value[mask] / seen[key].brightness for key, mask in masks.items()])
    if not len(hue):
        raise ColourFitError(f"nothing is labelled {name}")
    share = COLOURLESS_SHARE if name in COLOURLESS else SHARE
    ends = [share, 1.0 - share]
    s_low, s_high = np.quantile(saturation, ends).tolist()
    v_low, v_high = np.quantile(value.astype(np.float64), ends).tolist()
    if name == "white":
        return ColourBox((0.0, 360.0), (0.0, min(s_high + 0.05, 1.0)), (min(0.92 * v_low, 1.0), 1.0))
    if name == "dark":
        return ColourBox((0.0, 360.0), (0.0, 1.0), (0.0, min(v_high + 0.04, 1.0)))
    coloured = hue[saturation > LEAST_CHROMA]
    if len(coloured) < 0.5 * len(hue):
        raise ColourFitError(f"the labels of {name} are mostly grey; expected a colour with a hue")
    middle = _middle_hue(coloured)
    low, high = np.quantile(_turn(coloured - middle), ends).tolist()
    low, high = max(low - HUE_MARGIN, -90.0), min(high + HUE_MARGIN, 90.0)
    least = (max(s_low - SATURATION_MARGIN, LEAST_CHROMA), 1.0)
    return ColourBox(((middle + low) % 360.0, (middle + high) % 360.0), least, (min(VALUE_SHARE * v_low, 1.0), 1.0))


def _limited(box: ColourBox, first: ColourBox, name: str) -> ColourBox:
    """Return a grown box that does not leave the first by more than MOST_GROWTH or COLOURLESS_GROWTH."""
    if name == "white":
        most = min(box.saturation[1], first.saturation[1] + COLOURLESS_GROWTH)
        least = max(box.value[0], first.value[0] - COLOURLESS_GROWTH)
        return replace(box, saturation=(0.0, most), value=(least, 1.0))
    if name == "dark":
        return replace(box, value=(0.0, min(box.value[1], first.value[1] + COLOURLESS_GROWTH / 2.0)))
    low = first.hue[0] + min(max(float(_turn(box.hue[0] - first.hue[0])), -MOST_GROWTH), 0.0)
    high = first.hue[1] + max(min(float(_turn(box.hue[1] - first.hue[1])), MOST_GROWTH), 0.0)
    return replace(box, hue=(low % 360.0, high % 360.0))


def _near(box: ColourBox, known: ColourBox, name: str) -> ColourBox:
    """Return a box that nobody has labelled, no paler, darker or further off in hue than the known one allows."""
    if name in COLOURLESS:
        return box
    least = max(box.saturation[0], known.saturation[0] - SATURATION_MARGIN)
    darkest = max(box.value[0], VALUE_SHARE * known.value[0])
    low = max(float(_turn(box.hue[0] - known.hue[0])), -MOST_SHIFT)
    high = min(float(_turn(box.hue[1] - known.hue[1])), MOST_SHIFT)
    hue = ((known.hue[0] + low) % 360.0, (known.hue[1] + high) % 360.0)
    return ColourBox(hue, (least, 1.0), (darkest, 1.0))


def _part(boxes: dict[str, ColourBox], used: Mapping[str, int]) -> None:
    """Let hues that overlap meet in the middle between the classes, where a class was fitted."""
    coloured = [name for name in NAMES if name not in COLOURLESS]
    middles = {name: (boxes[name].hue[0] + _width(boxes[name]) / 2.0) % 360.0 for name in coloured}
    ordered = sorted(coloured, key=lambda name: middles[name])
    for lower, upper in zip(ordered, ordered[1:] + ordered[:1], strict=True):
        if lower not in used and upper not in used:
            continue
        gap = (middles[upper] - middles[lower]) % 360.0
        reach_up, reach_down = _width(boxes[lower]) / 2.0, _width(boxes[upper]) / 2.0
        if reach_up + reach_down < gap:
            continue
        # A class that was not fitted gives way to one that was.
        share = reach_up / (reach_up + reach_down)
        if lower in used and upper not in used:
            share = min(reach_up, 0.95 * gap) / gap
        elif upper in used and lower not in used:
            share = 1.0 - min(reach_down, 0.95 * gap) / gap
        border = (middles[lower] + share * gap) % 360.0
        boxes[lower] = replace(boxes[lower], hue=(boxes[lower].hue[0], (border - 0.5) % 360.0))
        boxes[upper] = replace(boxes[upper], hue=((border + 0.5) % 360.0, boxes[upper].hue[1]))


def _check_apart(
    seen: Mapping[str, _Seen], labels: Mapping[str, Mapping[str, Sequence[Rectangle]]], boxes: Mapping[str, ColourBox]
) -> None:
    """Refuse labels of two classes that look alike: most likely one of them is beside its thing."""
    labelled = [name for name in NAMES if any(name in of_picture for of_picture in labels.values())]
    for name in labelled:
        masks = {key: _label_mask(each, labels.get(key, {}).get(name, ())) for key, each in seen.items()}
        count = sum(int(mask.sum()) for mask in masks.values())
        own = sum(int((each.inside(boxes[name]) & masks[key]).sum()) for key, each in seen.items())
        if own < 0.5 * count:
            raise ColourFitError(
                f"only {100 * own // count} % of what is labelled {name} can be kept apart from other classes;"
                " check that each label shows its class only"
            )
        for other in labelled:
            alike = sum(int((each.inside(boxes[other]) & masks[key]).sum()) for key, each in seen.items())
            if other != name and alike > ALIKE * count:
                raise ColourFitError(
                    f"{100 * alike // count} % of what is labelled {name} looks like what is labelled {other};"
                    " check that each label shows its class only"
                )


def _width(box: ColourBox) -> float:
    low, high = box.hue
    return high - low if high >= low else high - low + 360.0


def _middle_hue(hue: NDArray[Any]) -> float:
    """Return the mean direction of hues [deg]."""
    angles = np.radians(hue.astype(np.float64))
    return math.degrees(math.atan2(float(np.sin(angles).mean()), float(np.cos(angles).mean()))) % 360.0


def _turn(difference: Any) -> Array:
    """Return differences of hues between -180 and 180 deg."""
    turned: Array = (np.asarray(difference, np.float64) + 180.0) % 360.0 - 180.0
    return turned
