"""The ball: an orange disk whose size fits its place on the ground.

A sphere's outline is a circular cone of rays, in any lens: all its unit rays u fulfil u . m = 1 with
m = c / cos(rho), c the direction of the centre and rho half the angle that the ball fills. So the fit is
linear and free of the bias of a circle fitted to pixels. Where the own chest or the picture's edge hides part of the
outline, the rest is too short an arc to tell place and size: there the size is that of a ball which lies on the ground.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_vision.features import Feature, FeatureClass
from tulip_vision.findings import Findings, Refusal
from tulip_vision.patches import patches
from tulip_vision.segmentation import Colour, Segmentation, belongs
from tulip_vision.view import Array, Mask, View, angles

MOST_CANDIDATES = 10
"""The largest orange patches are looked at; a crowd in orange shirts must not cost time without bound."""
WELL_SEEN = 0.7
"""Share of the outline that has to be seen for the size to count, and for the place to be as sure as a pixel is."""
BESIDE = 3
"""[px] from the own body: an outline nearer than that is the body's, not the ball's."""


@dataclass(frozen=True)
class BallParameters:
    """How a ball is told from other orange things.

    Attributes:
        radius: Of the ball [m].
        least_area: Smallest orange patch looked at [px^2].
        size_tolerance: Largest ratio, either way, between the seen radius and the one that fits the place.
        size_slack: Difference of radius that is always allowed [px].
        least_fill: Share of the disk that must be orange, where neither the own body nor the picture's edge hides it.
        least_outline: Share of the outline that must be seen.
        least_carpet: Share of the points just beside and below the ball that must be carpet or line.
        farthest: Largest distance along the ground [m].
    """

    radius: float = 0.0935
    least_area: float = 12.0  # [px^2] at 9 m the ball covers about 70 px^2
    size_tolerance: float = 1.6  # a tilt error of 1 deg changes the fitting radius at 6 m by a tenth
    size_slack: float = 1.5  # [px] blur and shading at the edge of a small ball
    least_fill: float = 0.45  # half hidden behind a foot or a post is still a ball
    least_outline: float = 0.15  # half of it hidden by the own chest, and the other half nearly
    least_carpet: float = 0.25
    farthest: float = 10.0  # [m]

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for name in ("radius", "least_area", "farthest"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected > 0")
        if self.size_tolerance <= 1.0:
            raise ValueError(f"size_tolerance is {self.size_tolerance}; expected > 1")
        if self.size_slack < 0.0:
            raise ValueError(f"size_slack is {self.size_slack} px; expected >= 0 px")
        for name in ("least_fill", "least_outline", "least_carpet"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected 0 to 1")


def find_ball(segmentation: Segmentation, view: View, parameters: BallParameters) -> Findings:
    """Return the most likely ball, if any, and the orange patches that are none."""
    candidates: list[Feature] = []
    refusals: list[Refusal] = []
    for points, area in patches(segmentation.mask(Colour.ORANGE), parameters.least_area, MOST_CANDIDATES):
        result = _examine(points, area, segmentation, view, parameters)
        if isinstance(result, Feature):
            candidates.append(result)
        else:
            u, v = points.mean(axis=0)
            refusals.append(Refusal(FeatureClass.BALL, (float(u), float(v)), result))
    candidates.sort(key=lambda feature: feature.confidence, reverse=True)
    return Findings(tuple(candidates[:1]), tuple(refusals))


def _examine(
    points: NDArray[np.int32], area: float, segmentation: Segmentation, view: View, parameters: BallParameters
) -> Feature | str:
    """Return the ball that an orange patch is, or why it is none."""
    width, height = view.lens.width, view.lens.height
    lowest = points[np.argmax(points[:, 1])]
    if segmentation.on_carpet[lowest[1], lowest[0]] == 0:
        return "not on the carpet"
    free = (points[:, 0] > 0) & (points[:, 0] < width - 1) & (points[:, 1] > 0) & (points[:, 1] < height - 1)
    free &= ~_beside(segmentation.own_body, points)
    edge = points[free]
    if len(edge) < 5:
        return "hidden by the picture's edge or the own body"
    rays = view.directions_at(edge[:, 0], edge[:, 1])
    middle = rays.sum(axis=0)
    pixel = view.angle_per_pixel(middle / np.linalg.norm(middle))
    hull = cv2.convexHull(np.ascontiguousarray(edge), returnPoints=False).reshape(-1)
    fit = _fit_cone(rays[hull], rays, pixel)
    if fit is None:
        return "no round outline"
    if not free.all():
        fit = _fit_resting(fit[0], rays, view, parameters.radius, pixel)
        if fit is None:
            return "what is seen of its outline is not that of a ball on the ground"
    centre, radius, residual, used = fit
    radius += 0.5 * pixel
    seen = used / max(2.0 * math.pi * radius / pixel, 1.0)
    if seen < parameters.least_outline:
        return f"only {seen:.0%} of the outline is seen"
    if residual > max(1.2 * pixel, 0.12 * radius):
        return f"not round: edge off by {residual / pixel:.1f} px"

    if not free.all() and not view.inside(view.pixels_of_directions(centre[None]))[0]:
        return "its middle is out of the picture"  # a sliver at the edge fits many circles
    down = -float(centre[2])
    above_centre = view.height - parameters.radius
    if down <= 1e-3 or above_centre <= 0.0:
        return "above the horizon"
    slant = above_centre / down
    if slant > parameters.farthest:
        return f"{slant:.1f} m away"
    if slant <= parameters.radius:
        return "inside the camera"
    fitting = math.asin(parameters.radius / slant)
    slack = parameters.size_slack * pixel
    if not fitting / parameters.size_tolerance - slack <= radius <= fitting * parameters.size_tolerance + slack:
        return f"radius {radius / pixel:.0f} px, {fitting / pixel:.0f} px would fit the place"

    disk = math.pi * (radius / pixel) ** 2
    fill = area / (disk if free.all() else disk * _visible_share(segmentation, view, centre, radius))
    if fill < parameters.least_fill:
        return f"only {fill:.0%} of the disk is orange"
    around = _cones(centre, [radius + max(0.35 * radius, 2.5 * pixel)], 24)
    around = around[around[:, 2] < centre[2] + 0.3 * radius]
    pixels = view.pixels_of_directions(around)
    classes, inside = view.sample(segmentation.classes, pixels)
    free_around = inside & (view.sample(segmentation.own_body, pixels)[0] == 0)
    carpet = belongs(classes, Colour.GREEN | Colour.WHITE)
    share = float(carpet[free_around].mean()) if free_around.any() else 1.0  # nothing to see there
    if share < parameters.least_carpet:
        return f"only {share:.0%} carpet around it"

    azimuth, elevation = angles(centre[None])
    # A ball of which only part of the outline is seen is less sure in place: its fit extrapolates.
    doubt = 1.0 if seen > WELL_SEEN else 1.0 + 3.0 * (WELL_SEEN - seen)
    spread_azimuth, spread_elevation = view.spreads(centre, doubt)
    fits = math.exp(-((math.log(radius / fitting) / math.log(parameters.size_tolerance)) ** 2))
    return Feature(
        FeatureClass.BALL,
        float(azimuth[0]),
        float(elevation[0]),
        spread_azimuth,
        spread_elevation,
        confidence=min(1.0, fill) * fits * (0.5 + 0.5 * share),
        # One that is hidden in part looks small in picture after picture, and what is cut was fitted to its place.
        angular_radius=radius if seen > WELL_SEEN and free.all() else math.nan,
    )


def _fit_cone(start: Array, rays: Array, pixel: float) -> tuple[Array, float, float, int] | None:
    """Fit a cone to an outline.

    Args:
        start: (m, 3) rays of the outline's hull, the first guess.
        rays: (n, 3) rays of the outline.
        pixel: Angle of one pixel [rad].

    Returns:
        Direction of the axis (3,), half the opening angle [rad], mean residual [rad], number of rays used.
    """
    kept, near = start, np.empty(0, dtype=np.bool_)
    for _ in range(4):
        if len(kept) < 4:
            return None
        try:
            solution = np.linalg.solve(kept.T @ kept, kept.sum(axis=0))  # least squares of kept @ solution - 1
        except np.linalg.LinAlgError:
            return None  # all in one plane
        length = float(np.linalg.norm(solution))
        if length <= 1.0:
            return None
        axis = np.asarray(solution / length, dtype=np.float64)
        radius = math.acos(1.0 / length)
        residuals = np.abs(np.arccos(np.clip(rays @ axis, -1.0, 1.0)) - radius)
        median = float(np.partition(residuals, len(residuals) // 2)[len(residuals) // 2])
        before, near = near, residuals <= max(1.5 * pixel, 2.5 * median)
        if np.array_equal(before, near):
            break  # the next round would give the same
        kept = rays[near]
    return axis, radius, float(np.sqrt(np.mean(np.sort(residuals)[: max(len(kept), 1)] ** 2))), len(kept)


def _fit_resting(
    start: Array, rays: Array, view: View, ball_radius: float, pixel: float
) -> tuple[Array, float, float, int] | None:
    """Fit the cone of a ball that lies on the ground to part of its outline; arguments and answer as of `_fit_cone`.

    Gauss-Newton over the two angles of the axis; half the opening angle follows from where the axis meets the height of
    the ball's centre.
    """
    above = view.height - ball_radius
    axis = start
    for _ in range(5):
        opening = _opening(axis, above, ball_radius)
        if opening is None:
            return None
        right = np.array([axis[1], -axis[0], 0.0]) / math.hypot(axis[0], axis[1])
        up = _cross(right, axis)
        cosines = rays @ axis
        away = np.arccos(np.clip(cosines, -1.0, 1.0))
        # What the angles to the rays, and the opening, change by as the axis turns to the right and up
        sines = np.maximum(np.sin(away), 1e-6)
        changes = -np.column_stack((rays @ right, rays @ up)) / sines[:, None]
        changes[:, 1] -= (_opening(axis + 1e-4 * up, above, ball_radius) or opening) / 1e-4 - opening / 1e-4
        residuals = away - (opening - 0.5 * pixel)  # an outline runs through the middles of its pixels
        weights = 1.0 / np.maximum(np.abs(residuals), pixel)  # as robust as the sum of distances
        weighted = changes * weights[:, None]
        try:
            turn = np.linalg.solve(changes.T @ weighted, -weighted.T @ residuals)
        except np.linalg.LinAlgError:
            return None
        axis = axis + turn[0] * right + turn[1] * up
        axis = axis / np.linalg.norm(axis)
        if abs(turn[0]) + abs(turn[1]) < 0.01 * pixel:
            break
    opening = _opening(axis, above, ball_radius)
    if opening is None:
        return None
    opening -= 0.5 * pixel
    residuals = np.abs(np.arccos(np.clip(rays @ axis, -1.0, 1.0)) - opening)
    kept = np.sort(residuals)[: math.ceil(0.85 * len(residuals))]  # blur and shades spoil some of the ends
    if float(np.sqrt(np.mean(kept**2))) > max(1.2 * pixel, 0.05 * opening):
        return None
    return axis, opening, float(np.sqrt(np.mean(kept**2))), len(residuals)


def _opening(axis: Array, above: float, ball_radius: float) -> float | None:
    """Return half the angle that a ball on the ground fills in a direction [rad], None where there is none."""
    down = -float(axis[2]) / float(np.linalg.norm(axis))
    if down <= 1e-3 or above <= 0.0 or above / down <= ball_radius:
        return None
    return math.asin(ball_radius * down / above)


def _beside(own_body: Mask, points: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return for each of (n, 2) pixels whether the own body is beside it."""
    if not own_body.any():
        return np.zeros(len(points), dtype=np.bool_)
    height, width = own_body.shape
    beside = np.zeros(len(points), dtype=np.bool_)
    for du, dv in ((-BESIDE, 0), (BESIDE, 0), (0, -BESIDE), (0, BESIDE), (-2, -2), (-2, 2), (2, -2), (2, 2)):
        u, v = np.clip(points[:, 0] + du, 0, width - 1), np.clip(points[:, 1] + dv, 0, height - 1)
        beside |= own_body[v, u] != 0
    return beside


def _cones(axis: Array, openings: Sequence[float], count: int) -> Array:
    """Return `count` unit vectors, one after the other, at each of some angles [rad] around a unit vector (3,)."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(axis[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    right, up = _cross(axis, helper), _cross(_cross(axis, helper), axis)
    right, up = right / np.linalg.norm(right), up / np.linalg.norm(up)
    turn = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)[:, None]
    ring = np.cos(turn) * right + np.sin(turn) * up
    return np.concatenate([math.cos(opening) * axis + math.sin(opening) * ring for opening in openings])


def _cross(first: Array, second: Array) -> Array:
    """Return the cross product of two vectors (3,), for which np.cross is slow."""
    (a, b, c), (x, y, z) = first.tolist(), second.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def _visible_share(segmentation: Segmentation, view: View, axis: Array, radius: float) -> float:
    """Return how much of the ball's disk lies inside the picture and is not hidden by the own body, 0 to 1."""
    disk = _cones(axis, [radius * share for share in (0.25, 0.56, 0.75, 0.9)], 16)
    own, inside = view.sample(segmentation.own_body, view.pixels_of_directions(disk))
    return max(float((inside & (own == 0)).mean()), 0.05)
