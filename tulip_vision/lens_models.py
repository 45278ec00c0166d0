"""How lenses bend light: from directions to the plane at distance 1 behind the lens, and back.

A model takes a direction, theta from the optical axis, to a point of the image plane in units of the focal length:

    plumb_bob    x' = x s + 2 p1 x y + p2 (r^2 + 2 x^2),  y' = y s + p1 (r^2 + 2 y^2) + 2 p2 x y,
                 x, y = X / Z, Y / Z,  r^2 = x^2 + y^2,
                 s = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)           (Brown-Conrady)
    equidistant  r' = t           t = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)
    equisolid    r' = 2 sin(t / 2)                                                     (Kannala-Brandt)
    rectilinear  r' = tan(t)

The three of the angle keep the direction round the axis. Each model has an exact inverse: a closed form where there
is one, otherwise Newton's method from a table of the model itself, so that it cannot go astray.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tulip_vision.pixel_loops import project_plumb_bob

Array = NDArray[np.float64]

PLUMB_BOB = "plumb_bob"
EQUIDISTANT = "equidistant"
EQUISOLID = "equisolid"
RECTILINEAR = "rectilinear"
COEFFICIENTS = {PLUMB_BOB: (4, 5, 8), EQUIDISTANT: (4,), EQUISOLID: (0, 4), RECTILINEAR: (0, 4)}
"""How many coefficients each model has: plumb_bob's are k1, k2, p1, p2, k3, k4, k5, k6, the others' k1 to k4."""

STEEPEST = math.radians(88.0)  # where a tangent is still a length that a picture can have: 29 focal lengths
STEP = math.radians(0.1)  # of the tables; Newton's method needs no finer start
NEWTON_STEPS = 12
PLAIN = np.array([1.0, 1.0, 0.0, 0.0])  # scale of the image plane itself
CONVERGED = 1e-13  # [focal lengths] rounding is all that remains


class LensModel(Protocol):
    """One way of bending light."""

    @property
    def largest_angle(self) -> float:
        """Angle to the optical axis up to which pictures of directions move outwards and do not fold back [rad]."""

    def flatten(self, directions: Array) -> Array:
        """Return (n, 2) points of the image plane of (n, 3) directions within the largest angle, of any length."""

    def unflatten(self, points: Array) -> Array:
        """Return (n, 3) unit directions of (n, 2) points of the image plane; NaN where no light falls."""


def make_model(name: str, coefficients: Array) -> LensModel:
    """Return a model by name, with coefficients as in COEFFICIENTS."""
    return PlumbBob(coefficients) if name == PLUMB_BOB else AngleModel(name, coefficients)


class PlumbBob:
    """The pinhole with radial and tangential distortion."""

    def __init__(self, coefficients: Array) -> None:
        self._coefficients = np.zeros(8)
        self._coefficients[: coefficients.size] = coefficients
        self._k1, self._k2, self._p1, self._p2, self._k3, self._k4, self._k5, self._k6 = self._coefficients.tolist()
        tangents = np.tan(np.arange(0.0, STEEPEST, STEP))
        radii = tangents * self._stretch(tangents**2)
        way = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
        along_x, across, along_y = self._derivatives(tangents[:, None] * np.cos(way), tangents[:, None] * np.sin(way))
        folds = np.flatnonzero((along_x * along_y - across * across).min(axis=1) <= 0.0)  # tangential distortion, too
        count = max(min(_rising(radii), int(folds[0]) if folds.size else len(radii)), 2)
        self._tangents, self._radii = tangents[:count], radii[:count]
        self.largest_angle = math.atan(float(self._tangents[-1]))

    def flatten(self, directions: Array) -> Array:
        """Return (n, 2) points of the image plane of (n, 3) directions."""
        points: Array = project_plumb_bob(directions, self._coefficients, PLAIN, math.inf)
        return points

    def unflatten(self, points: Array) -> Array:
        """Return (n, 3) unit directions of (n, 2) points of the image plane; NaN beyond the largest angle."""
        radius = np.hypot(points[:, 0], points[:, 1])
        start = np.interp(radius, self._radii, self._tangents)
        flat = points * (start / np.where(radius > 0.0, radius, 1.0))[:, None]
        # Points that no direction reaches run away; they become NaN below.
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            for _ in range(NEWTON_STEPS):
                x, y = flat.T
                squared = x * x + y * y
                radial = self._stretch(squared)
                error_x = x * radial + 2.0 * self._p1 * x * y + self._p2 * (squared + 2.0 * x * x) - points[:, 0]
                error_y = y * radial + self._p1 * (squared + 2.0 * y * y) + 2.0 * self._p2 * x * y - points[:, 1]
                if not max(np.abs(error_x).max(initial=0.0), np.abs(error_y).max(initial=0.0)) > CONVERGED:
                    break
                along_x, across, along_y = self._derivatives(x, y)
                share = 1.0 / (along_x * along_y - across * across)
                step_x = (along_y * error_x - across * error_y) * share
                step_y = (along_x * error_y - across * error_x) * share
                flat = flat - np.stack([step_x, step_y], axis=1)
            tangent = np.hypot(flat[:, 0], flat[:, 1])
            outside = ~((tangent <= self._tangents[-1]) & (np.maximum(np.abs(error_x), np.abs(error_y)) < 1e-9))
        directions = np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
        directions[outside] = np.nan
        unit: Array = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return unit

    def _stretch(self, squared: Array) -> Array:
        """Return (n,) by how much the distance from the optical axis grows, given its square at z = 1."""
        outer = self._k2 + squared * self._k3 if self._k3 else self._k2
        stretch: Array = 1.0 + squared * (self._k1 + squared * outer)
        if self._k4 or self._k5 or self._k6:
            stretch = stretch / (1.0 + squared * (self._k4 + squared * (self._k5 + squared * self._k6)))
        return stretch

    def _derivatives(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Return dx'/dx, dx'/dy = dy'/dx and dy'/dy."""
        squared = x * x + y * y
        radial, slope = self._stretch(squared), 2.0 * self._slope(squared)
        along_x = radial + slope * x * x + 2.0 * self._p1 * y + 6.0 * self._p2 * x
        along_y = radial + slope * y * y + 6.0 * self._p1 * y + 2.0 * self._p2 * x
        return along_x, slope * x * y + 2.0 * (self._p1 * x + self._p2 * y), along_y

    def _slope(self, squared: Array) -> Array:
        """Return (n,) the derivative of the stretch by the square."""
        rising: Array = self._k1 + squared * (2.0 * self._k2 + squared * 3.0 * self._k3)
        if self._k4 or self._k5 or self._k6:
            below = 1.0 + squared * (self._k4 + squared * (self._k5 + squared * self._k6))
            falling = self._k4 + squared * (2.0 * self._k5 + squared * 3.0 * self._k6)
            rising = (rising - self._stretch(squared) * falling) / below
        return rising


class AngleModel:
    """Equidistant, equisolid or rectilinear: the distance from the middle depends on the angle to the axis only."""

    def __init__(self, name: str, coefficients: Array) -> None:
        self._name = name
        self._k = coefficients.tolist()
        self._plain = not any(self._k)
        angles = np.arange(0.0, (STEEPEST if name == RECTILINEAR else math.pi) + STEP / 2.0, STEP)
        angles = np.minimum(angles, math.pi)
        stretched = self._stretch(angles)
        beyond = np.flatnonzero(stretched > (STEEPEST if name == RECTILINEAR else math.pi) + 1e-9)
        if name != EQUIDISTANT and beyond.size:
            stretched = stretched[: max(int(beyond[0]), 2)]
        count = _rising(stretched)
        self._angles, self._stretched = angles[:count], stretched[:count]
        self.largest_angle = float(self._angles[-1])

    def flatten(self, directions: Array) -> Array:
        """Return (n, 2) points of the image plane of (n, 3) directions."""
        aside = np.hypot(directions[:, 0], directions[:, 1])
        stretched = self._stretch(np.arctan2(aside, directions[:, 2]))
        if self._name == EQUISOLID:
            radius = 2.0 * np.sin(stretched / 2.0)
        elif self._name == RECTILINEAR:
            radius = np.tan(stretched)
        else:
            radius = stretched
        points: Array = directions[:, :2] * (radius / np.where(aside > 0.0, aside, 1.0))[:, None]
        return points

    def unflatten(self, points: Array) -> Array:
        """Return (n, 3) unit directions of (n, 2) points of the image plane; NaN beyond the largest angle."""
        radius = np.hypot(points[:, 0], points[:, 1])
        if self._name == EQUISOLID:
            with np.errstate(invalid="ignore"):
                stretched = 2.0 * np.arcsin(radius / 2.0)
        elif self._name == RECTILINEAR:
            stretched = np.arctan(radius)
        else:
            stretched = radius
        angle = stretched if self._plain else self._unstretch(stretched)
        with np.errstate(invalid="ignore"):
            angle = np.where(stretched <= self._stretched[-1], angle, np.nan)
        unit = np.empty((len(points), 3))
        unit[:, :2] = points * (np.sin(angle) / np.where(radius > 0.0, radius, 1.0))[:, None]
        unit[:, 2] = np.cos(angle)
        return unit

    def _stretch(self, angle: Array) -> Array:
        if self._plain:
            return angle
        k1, k2, k3, k4 = self._k
        squared = angle * angle
        stretched: Array = angle * (1.0 + squared * (k1 + squared * (k2 + squared * (k3 + squared * k4))))
        return stretched

    def _unstretch(self, stretched: Array) -> Array:
        k1, k2, k3, k4 = self._k
        angle: Array = np.interp(stretched, self._stretched, self._angles)
        for _ in range(NEWTON_STEPS):
            error = self._stretch(angle) - stretched
            if not np.abs(error[np.isfinite(error)]).max(initial=0.0) > CONVERGED:
                break
            squared = angle * angle
            slope = 1.0 + squared * (3.0 * k1 + squared * (5.0 * k2 + squared * (7.0 * k3 + squared * 9.0 * k4)))
            # Close to where it folds back the slope is small: a step stays within the table.
            angle = np.clip(angle - error / np.maximum(slope, 1e-6), 0.0, self._angles[-1])
        return angle


def _rising(values: Array) -> int:
    """Return how many of the first values rise."""
    falling = np.flatnonzero(~(np.diff(values) > 0.0))
    return int(falling[0]) + 1 if falling.size else len(values)
