"""The field's border: straight edges of the carpet, where green ends."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from tulip_vision.features import Feature, FeatureClass
from tulip_vision.findings import Findings, Refusal
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import Array, View, angles

SAMPLES = 12
"""Places along an edge at which green is looked for on both sides."""
BESIDE = 5.0
"""[px] from the edge."""


@dataclass(frozen=True)
class BorderParameters:
    """How edges of the carpet are found.

    Attributes:
        tolerance: Largest distance between the carpet's outline and an edge [px].
        least_length: Shortest edge [m].
        farthest: Largest distance of its ends along the ground [m].
        least_share: Of an edge along which green must end there: else something that hides carpet made it.
        margin: The outline counts for nothing so close to the picture's sides and upper edge [px].
        doubt: How many times less sure the outline is than a line: grass ends raggedly, and things stand there.
    """

    tolerance: float = 2.5
    least_length: float = 1.0
    farthest: float = 7.0  # [m] one pixel is 0.1 m deep there
    least_share: float = 0.7
    margin: float = 4.0
    doubt: float = 3.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not positive.
        """
        for name, value in vars(self).items():
            if not value > 0.0:
                raise ValueError(f"{name} is {value}; expected > 0")


def find_border(segmentation: Segmentation, view: View, parameters: BorderParameters) -> Findings:
    """Return the straight edges of the carpet, each with the directions of its ends."""
    outline = segmentation.outline
    height, width = segmentation.classes.shape
    m = parameters.margin
    inner = (outline[:, 1] > m) & (outline[:, 0] > m) & (outline[:, 0] < width - 1.0 - m)
    outline = outline[inner & (outline[:, 1] < height - 1.0)]
    if len(outline) < 2:
        return Findings()
    flat = view.lens.rays_inside(outline)
    focal = float(view.lens.camera_matrix[0, 0])
    plane = (flat[:, :2] / flat[:, 2:] * focal).astype(np.float32)  # where no lens bends straight edges
    corners = cv2.approxPolyDP(plane, parameters.tolerance, False).reshape(-1, 2).astype(np.float64) / focal
    directions = np.column_stack([corners, np.ones(len(corners))]) @ view.rotation.T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ground = view.ground(directions)
    azimuths, elevations = angles(directions)
    with np.errstate(invalid="ignore"):
        near = np.hypot(*(ground - view.position[:2]).T) < parameters.farthest
    found: list[Feature] = []
    refusals: list[Refusal] = []
    for index in np.flatnonzero(near[:-1] & near[1:]).tolist():
        length = math.hypot(*(ground[index + 1] - ground[index]))
        if length < parameters.least_length:
            continue
        share = _green_ends(ground[index], ground[index + 1], segmentation, view)
        if share < parameters.least_share:
            middle = view.pixels_on_ground(ground[index : index + 2]).mean(axis=0)
            reason = f"green ends on only {share:.0%} of it"
            refusals.append(Refusal(FeatureClass.FIELD_BORDER, (float(middle[0]), float(middle[1])), reason))
            continue
        azimuth_spread, elevation_spread = view.spreads(directions[index], parameters.doubt)
        found.append(
            Feature(
                FeatureClass.FIELD_BORDER,
                float(azimuths[index]),
                float(elevations[index]),
                azimuth_spread,
                elevation_spread,
                confidence=share * min(1.0, 0.25 * length),
                end_azimuth=float(azimuths[index + 1]),
                end_elevation=float(elevations[index + 1]),
            )
        )
    return Findings(tuple(found), tuple(refusals))


def _green_ends(start: Array, end: Array, segmentation: Segmentation, view: View) -> float:
    """Return the share of a piece of the outline, from (2,) to (2,) on the ground [m], along which green ends there."""
    share = np.linspace(0.05, 0.95, SAMPLES)[:, None]
    pixels = view.pixels_on_ground(start + share * (end - start))
    along = pixels[-1] - pixels[0]
    across = np.array([along[1], -along[0]]) / max(math.hypot(*along), 1e-9)
    across *= math.copysign(BESIDE, -across[1])  # upwards
    classes, _ = view.sample(segmentation.classes, np.concatenate([pixels + across, pixels - across]))
    outer, inner = classes[:SAMPLES], classes[SAMPLES:]
    green = belongs(inner, Colour.GREEN | Colour.WHITE) & ~belongs(outer, Colour.GREEN)
    return float(np.count_nonzero(green)) / SAMPLES
