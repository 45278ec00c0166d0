"""Colour classes of a picture, by a table over all colours, and the carpet's outline.

The table has 32 x 32 x 32 cells, one for the five upper bits of blue, green and red; each cell holds one
bit for each class it belongs to. Classes are boxes in hue, saturation and value. The bounds on value move
with the brightness of the carpet in the picture, so a dark hall needs no other parameters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntFlag
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.colour_file import PATH, ColourFile, ColourFileError, read_colours
from tulip_vision.view import Array, Mask, View

Picture = NDArray[np.uint8]


LUT_TAKES_WORDS = int(cv2.__version__.split(".")[0]) >= 5
"""Whether `cv2.LUT` looks up 16-bit indices: a quarter of the time of `np.take`."""

FAINT = 0.1
"""Value below which colours are not told apart, 0 to 1."""
YELLOWER = 8.0
"""[deg] by which green may begin before its box does, where the carpet is yellowish."""
SCATTER = 12.0
"""[deg] of the carpet's hue about its median."""
HUE_STEP = 4.0
"""[deg] between the tables that are made for yellowish carpets."""

LEAST_COSINE = 0.1
"""Of the angle to the optical axis, 84 deg, up to which the carpet's outline is looked for."""


class Colour(IntFlag):
    """Bits of the colour classes. A pixel may belong to several."""

    GREEN = 1
    WHITE = 2
    ORANGE = 4
    YELLOW = 8
    BLUE = 16
    CYAN = 32
    MAGENTA = 64
    DARK = 128


FIELD = np.uint8(Colour.GREEN | Colour.ORANGE | Colour.YELLOW | Colour.BLUE)
"""What a robot's own body does not wear, by the rules."""


@dataclass(frozen=True)
class ColourBox:
    """A box of colours.

    Attributes:
        hue: Lower and upper bound [deg], 0 red, 120 green, 240 blue; lower > upper goes through 0.
        saturation: Lower and upper bound, 0 to 1.
        value: Lower and upper bound, 0 to 1, for a carpet of the reference brightness.
    """

    hue: tuple[float, float] = (0.0, 360.0)
    saturation: tuple[float, float] = (0.0, 1.0)
    value: tuple[float, float] = (0.0, 1.0)

    def __post_init__(self) -> None:
        """Check the bounds.

        Raises:
            ValueError: if one is out of range, or a lower bound exceeds its upper bound.
        """
        if not all(0.0 <= bound <= 360.0 for bound in self.hue):
            raise ValueError(f"hue is {self.hue} deg; expected two angles from 0 to 360 deg")
        for name, bounds in (("saturation", self.saturation), ("value", self.value)):
            if not 0.0 <= bounds[0] <= bounds[1] <= 1.0:
                raise ValueError(f"{name} is {bounds}; expected lower <= upper, both from 0 to 1")


DEFAULTS = read_colours()
"""What colours.yaml says; a file that cannot be used ends the import with a ColourFileError."""


def _boxes(content: ColourFile) -> dict[str, ColourBox]:
    try:
        return {name: ColourBox(**box) for name, box in content.boxes.items()}
    except ValueError as error:
        raise ColourFileError(f"{PATH}: {error}") from None


BOXES = _boxes(DEFAULTS)


@dataclass(frozen=True)
class ColourBoxes:
    """The box of each colour class; the defaults are those of colours.yaml."""

    green: ColourBox = BOXES["green"]
    white: ColourBox = BOXES["white"]
    orange: ColourBox = BOXES["orange"]
    yellow: ColourBox = BOXES["yellow"]
    blue: ColourBox = BOXES["blue"]
    cyan: ColourBox = BOXES["cyan"]
    magenta: ColourBox = BOXES["magenta"]
    dark: ColourBox = BOXES["dark"]

    def of(self, colour: Colour) -> ColourBox:
        """Return the box of one class."""
        box = getattr(self, str(colour.name).lower())
        assert isinstance(box, ColourBox)  # the fields bear the names of the classes
        return box


@dataclass(frozen=True)
class SegmentationParameters:
    """Colour classes and how the carpet's outline is found.

    Attributes:
        colours: The box of each colour class.
        reference_brightness: Value of the carpet for which the boxes are given, 0 to 1.
        brightness_step: Tables are made for brightnesses that differ by this factor.
        outline_step: Distance between the columns and rows looked at for the carpet's outline [px].
        outline_run: Fewest samples, one above the other, that make a run of carpet.
        outline_gap: Longer gaps end a run; a green jacket beyond the floor is no carpet [samples].
        farthest: Nothing on the ground is looked for beyond this range [m].
    """

    colours: ColourBoxes = ColourBoxes()
    reference_brightness: float = DEFAULTS.reference_brightness
    brightness_step: float = 1.25
    outline_step: int = 8
    outline_run: int = 3
    outline_gap: int = 1  # far lines and noise
    farthest: float = 12.5  # [m] the diagonal of carpet 10.4 x 7.4 m is 12.8 m

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if a number is out of range.
        """
        if not 0.0 < self.reference_brightness <= 1.0:
            raise ValueError(f"reference_brightness is {self.reference_brightness}; expected above 0 to 1")
        if self.brightness_step <= 1.0:
            raise ValueError(f"brightness_step is {self.brightness_step}; expected > 1")
        if self.outline_step < 2:
            raise ValueError(f"outline_step is {self.outline_step} px; expected >= 2 px")
        if self.outline_run < 1 or self.outline_gap < 0:
            raise ValueError(f"outline_run is {self.outline_run}, outline_gap {self.outline_gap}; expected >= 1, >= 0")
        if self.farthest <= 0.0:
            raise ValueError(f"farthest is {self.farthest} m; expected > 0 m")


@dataclass(frozen=True)
class Segmentation:
    """A picture divided into colour classes.

    Attributes:
        classes: (height, width) bits of `Colour`.
        whiteness: (height, width) the smaller of red and blue, 0 to 255: low on carpet, high on lines.
        on_carpet: (height, width) 255 inside the carpet's outline, else 0.
        outline: (n, 2) the outline's upper edge, left to right [px]; empty if no carpet is seen.
        own_body: (height, width) 255 where the robot sees its own trunk and arms, else 0; no class there.
        brightness: Value of the carpet over the reference brightness; 1 if no carpet is seen.
        carpet_share: Share of the pixels that are green, 0 to 1.
    """

    classes: Mask
    whiteness: Mask
    on_carpet: Mask
    outline: Array
    own_body: Mask
    brightness: float
    carpet_share: float

    def mask(self, colours: Colour, top: int = 0) -> Mask:
        """Return (height - top, width) nonzero where a pixel from row `top` on belongs to one of the classes."""
        found: Mask = np.bitwise_and(self.classes[top:], np.uint8(colours))
        return found


def belongs(classes: Mask, colours: Colour) -> NDArray[np.bool_]:
    """Return where an array of any shape, with bits of `Colour`, belongs to one of the classes."""
    # Without the conversion numpy takes an enumeration's member for a wide integer, and computes with those.
    found: NDArray[np.bool_] = np.bitwise_and(classes, np.uint8(colours)) != 0
    return found


def _whiteness_table() -> NDArray[np.uint8]:
    """Return (65536,) the smaller of red and blue of each cell's middle, 0 to 255; the upper half is empty."""
    index = np.arange(2**15)
    table = np.zeros(2**16, dtype=np.uint8)
    table[: len(index)] = 8 * np.minimum((index >> 10) & 31, index & 31) + 4
    return table


WHITENESS = _whiteness_table()


class Segmenter:
    """Divides pictures into colour classes and finds the carpet in them."""

    def __init__(self, parameters: SegmentationParameters) -> None:
        """Make a segmenter; its colour tables are made when first needed."""
        self._parameters = parameters
        self._tables: dict[tuple[int, int], NDArray[np.uint8]] = {}

    def table(self, brightness: float, green_from: float | None = None) -> NDArray[np.uint8]:
        """Return the (65536,) colour table for a carpet of this brightness over the reference brightness.

        Green may begin at another hue than that of its box [deg], which moves yellow's end, too.

        Colours have 15 bits; the upper half is empty, and there because `cv2.LUT` takes tables of this size only.
        """
        step = math.log(self._parameters.brightness_step)
        level = int(np.clip(round(math.log(max(brightness, 1e-3)) / step), -8, 5))
        shift = 0 if green_from is None else round((self._parameters.colours.green.hue[0] - green_from) / HUE_STEP)
        if (level, shift) not in self._tables:
            self._tables[level, shift] = self._make_table(math.exp(level * step), HUE_STEP * shift)
        return self._tables[level, shift]

    def segment(self, picture: Picture, view: View, own_body: Mask | None = None) -> Segmentation:
        """Divide a picture into colour classes and find the carpet's outline.

        Args:
            picture: (height, width, 3) BGR.
            view: Of the picture.
            own_body: (height, width) 255 where the robot may see itself; None if it does not.
        """
        brightness, green_from = self._carpet(picture)
        packed = cv2.cvtColor(picture, cv2.COLOR_BGR2BGR555)  # two bytes a pixel, little-endian: 0rrrrrgg gggbbbbb
        index = packed.view(np.uint16).reshape(picture.shape[:2])
        classes = self._look_up(index, self.table(brightness, green_from))
        whiteness = self._look_up(index, WHITENESS)
        if own_body is None:
            own_body = np.zeros(classes.shape, dtype=np.uint8)
        elif own_body.any():
            # Where the trunk leans otherwise than thought, the field shows, in colours that the own body has not.
            own_body = own_body.copy()
            left, top, width, height = cv2.boundingRect(own_body)
            part = slice(top, top + height), slice(left, left + width)
            own_body[part] &= cv2.compare(classes[part] & FIELD, 0, cv2.CMP_EQ)
            classes[part] &= ~own_body[part]
        outline = self._outline(classes, view)
        on_carpet: Mask = np.zeros(classes.shape, dtype=np.uint8)
        if len(outline):
            corners = [[outline[-1, 0], classes.shape[0]], [outline[0, 0], classes.shape[0]]]
            polygon = np.rint(np.concatenate([outline, corners])).astype(np.int32)
            cv2.fillPoly(on_carpet, [polygon], 255)
        sampled = belongs(classes[::8, ::8], Colour.GREEN)
        share = float(np.count_nonzero(sampled)) / max(sampled.size, 1)
        return Segmentation(classes, whiteness, on_carpet, outline, own_body, brightness, share)

    @staticmethod
    def _look_up(index: NDArray[np.uint16], table: NDArray[np.uint8]) -> Mask:
        """Return `table` (65536,) at each of (height, width) indices."""
        if LUT_TAKES_WORDS:
            return np.asarray(cv2.LUT(index, table.reshape(1, -1)), np.uint8)
        return np.take(table, index, mode="wrap")  # every index is inside: saves the check

    def _make_table(self, brightness: float, shift: float) -> NDArray[np.uint8]:
        """Return the table for a brightness and for a green that begins at a hue lower by `shift` [deg]."""
        hue, saturation, value = self._cells
        table = np.zeros(2**16, dtype=np.uint8)
        for colour in Colour:
            box = self._parameters.colours.of(colour)
            low, high = box.hue
            if colour is Colour.GREEN:
                low -= shift
            elif colour is Colour.YELLOW:
                high -= shift
            in_hue = (hue >= low) & (hue <= high) if low <= high else (hue >= low) | (hue <= high)
            # An upper bound of 1 stays: nothing is too bright; a lower bound never asks for more than 0.8.
            # Below FAINT the camera's noise makes any hue.
            least = min(max(box.value[0] * brightness, min(box.value[0], FAINT)), 0.8)
            most = 1.0 if box.value[1] >= 1.0 else min(box.value[1] * brightness, 1.0)
            fits = in_hue & (saturation >= box.saturation[0]) & (saturation <= box.saturation[1])
            table[: len(hue)][fits & (value >= least) & (value <= most)] |= int(colour)
        return table

    @cached_property
    def _cells(self) -> tuple[Array, Array, Array]:
        """Hue [deg], saturation and value of the middle of each cell, in the order of BGR555."""
        index = np.arange(32 * 32 * 32)
        red, green, blue = ((((index >> shift) & 31) + 0.5) / 32.0 for shift in (10, 5, 0))
        value = np.maximum(np.maximum(red, green), blue)
        chroma = value - np.minimum(np.minimum(red, green), blue)
        safe = np.where(chroma > 0.0, chroma, 1.0)
        hue = np.where(
            value == red,
            ((green - blue) / safe) % 6.0,
            np.where(value == green, (blue - red) / safe + 2.0, (red - green) / safe + 4.0),
        )
        return hue * 60.0, chroma / value, value

    def _carpet(self, picture: Picture) -> tuple[float, float]:
        """Return the carpet's value over the reference and the hue at which green begins [deg], from some pixels.

        Turf may be so yellowish that its hue scatters about the bound between the classes; that shows in the median of
        what is green or a little yellower. If there is hardly any, the value is 1 and green begins where its box does.
        """
        height, width = picture.shape[:2]
        small = cv2.resize(picture, (-(-width // 8), -(-height // 8)), interpolation=cv2.INTER_NEAREST)
        hsv = cv2.cvtColor(small, cv2.COLOR_BGR2HSV)
        box = self._parameters.colours.green
        begins = box.hue[0]
        # OpenCV keeps hue / 2 in a byte.
        low = (math.ceil(max(begins - YELLOWER, 0.0) / 2.0), math.ceil(255.0 * box.saturation[0]), 20)
        green = cv2.inRange(hsv, low, (math.floor(box.hue[1] / 2.0), 255, 255)) != 0
        hue = np.cumsum(np.bincount(hsv[..., 0][green], minlength=256))
        if hue[-1] < 0.02 * green.size:
            return 1.0, begins
        common = 2.0 * float(np.searchsorted(hue, 0.5 * hue[-1]))
        if common < begins + SCATTER:
            begins = max(common - SCATTER, begins - YELLOWER)
        green &= hsv[..., 0] >= begins / 2.0
        value = np.cumsum(np.bincount(hsv[..., 2][green], minlength=256))
        median = int(np.searchsorted(value, 0.5 * value[-1]))
        return median / 255.0 / self._parameters.reference_brightness, begins

    def _outline(self, classes: Mask, view: View) -> Array:
        """Return the carpet's upper edge: the hull of the tops of each column's lowest run of carpet.

        The carpet is convex, a lens-free picture of it is convex too, and objects that stand on it only take
        parts away: a run that ends below an object is too low, never too high. So the hull is taken where no
        lens bends it: on the plane z = 1 of the camera, turned about its optical axis until the horizon is level.
        """
        parameters = self._parameters
        step = parameters.outline_step
        coarse = classes[step // 2 :: step, step // 2 :: step]
        rows = len(coarse)
        rays = view.lens.ray_table()
        lowest = view.height / math.hypot(view.height, parameters.farthest)  # sine of the angle below the horizon
        # What a wide lens sees beside or behind itself has no place on that plane.
        below = (view.coarse_sines(step) < -lowest) & (view.lens.coarse_ray_table(step)[..., 2] > LEAST_COSINE)
        # Thick lines divide runs, so white is part of them; but a grey floor counts as white now and then, and so
        # white joins no parts, and the carpet's edge itself is green.
        carpet = _large_parts(belongs(coarse, Colour.GREEN | Colour.ORANGE) & below)
        filled = carpet | (belongs(coarse, Colour.WHITE) & below)
        row = _top_of_lowest_run(filled, parameters.outline_run, parameters.outline_gap)
        carpet &= np.arange(rows)[:, None] >= row
        row = np.where(carpet.any(axis=0), carpet.argmax(axis=0), rows)
        column = np.flatnonzero(row < rows)
        if len(column) < 3:
            return np.empty((0, 2))
        row = row[column]
        # The edge lies in the step above the first green sample: find it pixel by pixel.
        u = column * step + step // 2
        v = row * step + step // 2
        offsets = np.arange(step)
        above = np.maximum(v[:, None] - offsets, 0)
        still = np.logical_and.accumulate(belongs(classes[above, u[:, None]], Colour.GREEN), axis=1)
        v = np.maximum(v - np.maximum(still.sum(axis=1) - 1, 0), 0)

        flat = _level_plane(view, rays[v, u].astype(np.float64))
        hull = _upper_hull(flat)
        if len(hull) < 2:
            return np.empty((0, 2))
        across = np.linspace(flat[:, 0].min(), flat[:, 0].max(), 41)
        height = np.interp(across, flat[hull, 0], flat[hull, 1])
        return _picture_edge(_from_level_plane(view, np.stack([across, height], axis=1)), view, 3.0 * step)


def _large_parts(filled: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the largest connected part of a coarse mask and those that are not much smaller.

    Lines and robots divide the carpet, but green things in the hall stand apart from it and are small.
    """
    count, labels, numbers, _ = cv2.connectedComponentsWithStats(filled.astype(np.uint8), connectivity=8)
    if count < 2:
        return filled
    areas = numbers[:, cv2.CC_STAT_AREA]
    areas[0] = 0
    large: NDArray[np.bool_] = (areas >= 0.2 * areas.max())[labels]
    return large


def _top_of_lowest_run(filled: NDArray[np.bool_], shortest: int, gap: int) -> NDArray[np.intp]:
    """Return for each column of (rows, columns) the top row of its lowest run; `rows` where that is too short.

    Gaps of up to `gap` rows do not end a run.
    """
    rows = len(filled)
    upwards = filled[::-1]
    start = upwards.argmax(axis=0)
    row = np.arange(rows)[:, None]
    hits = np.concatenate([np.zeros((1, filled.shape[1]), dtype=np.intp), np.cumsum(upwards, axis=0)])
    ahead = np.minimum(np.arange(rows) + gap + 1, rows)
    empty = hits[ahead] == hits[:-1]  # nothing in this row and the `gap` rows above it
    ends = empty & (row > start)
    end = np.where(ends.any(axis=0), ends.argmax(axis=0), rows)
    enough = upwards.any(axis=0) & (end - start >= shortest)
    return np.where(enough, rows - end, rows)


def _roll(view: View) -> tuple[float, float]:
    """Return the world's up direction in the picture plane: unit (right, down) components."""
    right, down = float(view.rotation[2, 0]), float(view.rotation[2, 1])
    norm = math.hypot(right, down)
    return (0.0, -1.0) if norm < 1e-6 else (right / norm, down / norm)


def _level_plane(view: View, rays: Array) -> Array:
    """Return (n, 2): right and up on the plane z = 1, turned so that up is the world's up."""
    x, y = rays[:, 0] / rays[:, 2], rays[:, 1] / rays[:, 2]
    right, down = _roll(view)
    return np.stack([-x * down + y * right, x * right + y * down], axis=1)


def _from_level_plane(view: View, points: Array) -> Array:
    right, down = _roll(view)
    x = -points[:, 0] * down + points[:, 1] * right
    y = points[:, 0] * right + points[:, 1] * down
    return view.lens.project(np.stack([x, y, np.ones(len(points))], axis=1))


def _upper_hull(points: Array) -> NDArray[np.intp]:
    """Return the indices of the upper convex hull of (n, 2) points, left to right."""
    whole = cv2.convexHull(points.astype(np.float32), clockwise=False, returnPoints=False).reshape(-1)
    x = points[whole, 0]
    # OpenCV means a picture, where y grows downwards; here it grows upwards: the upper side begins at the right.
    first = np.roll(whole, -int(np.argmax(x)))
    count = (int(np.argmin(x)) - int(np.argmax(x))) % len(whole) + 1
    upper: NDArray[np.intp] = first[:count][::-1].astype(np.intp)
    return upper


def _picture_edge(outline: Array, view: View, near: float) -> Array:
    """Let the outline reach the picture's left and right edge if it comes closer to them than `near` [px]."""
    outline = outline[np.isfinite(outline).all(axis=1)]
    if not len(outline):
        return outline
    left, right = outline[:1].copy(), outline[-1:].copy()
    left[0, 0], right[0, 0] = 0.0, view.lens.width - 1.0
    at_left, at_right = int(outline[0, 0] < near), int(outline[-1, 0] > view.lens.width - near)
    return np.concatenate([left[:at_left], outline, right[:at_right]])
