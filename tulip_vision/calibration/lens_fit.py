"""A lens from the corners of a board in some pictures: bundle adjustment, for every lens model alike.

All of the lens's numbers and the board's pose in each picture are found together, as those that minimize the distances
between the corners seen and the corners projected, by least squares with a robust loss.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tulip_vision.calibration.boards import Corners
from tulip_vision.lens import Lens
from tulip_vision.lens_models import EQUIDISTANT, EQUISOLID, RECTILINEAR

Array = NDArray[np.float64]

COEFFICIENTS = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4, "equisolid": 4, "rectilinear": 0}
"""Models that can be fitted, and how many coefficients are fitted."""
FEWEST_PICTURES = 4  # three would do without noise; the fourth shows whether they agree
GUESSES = (45.0, 65.0, 85.0, 110.0, 140.0, 180.0)  # [deg] seen across the picture, one of which to start from
UNSEEN = 100.0  # [px] residual of a corner that the lens, as tried, does not see at all
SOFT = 1.0  # [px] larger errors count less than their squares
LOOSE = 0.5  # standard deviation of a coefficient before anything is known: keeps those in check that hardly matter
NOISE = 0.1  # [px] of a corner, for that comparison only
WORSE = 3.0  # times the median error of all pictures: such a picture is left out
ALWAYS_GOOD = 0.8  # [px] and no picture below this error
STEPS = 1e-6  # of the derivatives, relative to parameters scaled to about 1


class FitError(ValueError):
    """The pictures do not tell what the lens is; the message says why."""


@dataclass(frozen=True)
class LensFit:
    """A lens and how well it explains the pictures.

    Attributes:
        lens: The lens.
        model: Its name in COEFFICIENTS.
        spread: Standard deviations of fx, fy, cx, cy [px].
        errors: Root mean square distance of corners seen and projected, by picture [px].
        left_out: Pictures that did not fit, with the reason.
        poses: (6,) rotation vector [rad] and translation [m] of the board in camera_optical_frame, by picture.
        criterion: Bayesian information criterion of the fit: less is better, and more coefficients must pay.
    """

    lens: Lens
    model: str
    spread: Array
    errors: Mapping[str, float]
    left_out: Mapping[str, str]
    poses: Mapping[str, Array]
    criterion: float

    @property
    def error(self) -> float:
        """Root mean square error over all pictures used [px]."""
        return math.sqrt(float(np.mean(np.square(list(self.errors.values())))))

    def projected(self, name: str, corners: Corners) -> Array:
        """Return (n, 2) pixels at which the corners of a picture should be [px]."""
        pose = self.poses[name]
        return self.lens.project(corners.points @ Rotation.from_rotvec(pose[:3]).as_matrix().T + pose[3:])


def fit_lens(corners: Mapping[str, Corners], size: tuple[int, int], model: str) -> LensFit:
    """Find the lens of a camera.

    Args:
        corners: What each picture, by name, shows of the board.
        size: Width and height of the pictures [px].
        model: One of COEFFICIENTS.

    Raises:
        FitError: if there are too few pictures, too few are left, or they do not tell the focal length.
        ValueError: if there is no such model.
    """
    if model not in COEFFICIENTS:
        raise ValueError(f"lens model is {model!r}; expected one of {', '.join(COEFFICIENTS)}")
    used, left_out = dict(corners), dict[str, str]()
    while True:
        if len(used) < FEWEST_PICTURES:
            raise FitError(f"{len(used)} pictures are usable; expected at least {FEWEST_PICTURES}")
        fit = _fit(used, size, model)
        limit = max(WORSE * float(np.median(list(fit.errors.values()))), ALWAYS_GOOD)
        worst = max(fit.errors, key=lambda name: fit.errors[name])
        if fit.errors[worst] <= limit:
            break
        left_out[worst] = f"its corners miss by {fit.errors[worst]:.2f} px, where the limit is {limit:.2f} px"
        del used[worst]
    if fit.spread[:2].max() > 0.05 * fit.lens.camera_matrix[0, 0]:
        raise FitError("the focal length stays unknown; expected pictures with the board tilted in several ways")
    return LensFit(fit.lens, model, fit.spread, fit.errors, left_out, fit.poses, fit.criterion)


class _Problem:
    """Residuals of all corners as a function of one vector: fx, fy, cx, cy, coefficients, then six numbers a pose."""

    def __init__(self, corners: Sequence[Corners], size: tuple[int, int], model: str) -> None:
        self.size, self.model, self.lens_numbers = size, model, 4 + COEFFICIENTS[model]
        self.points = np.concatenate([each.points for each in corners])
        self.pixels = np.concatenate([each.pixels for each in corners])
        self.picture = np.repeat(np.arange(len(corners)), [len(each.points) for each in corners])
        self.scale = np.array([*[float(size[0])] * 4, *[1.0] * COEFFICIENTS[model], *[1.0] * (6 * len(corners))])

    def lens(self, x: Array) -> Lens:
        """Return the lens that a vector stands for."""
        fx, fy, cx, cy = (x * self.scale[: len(x)])[:4].tolist()
        matrix = [[max(fx, 1.0), 0.0, cx], [0.0, max(fy, 1.0), cy], [0.0, 0.0, 1.0]]
        return Lens(*self.size, matrix, x[4 : self.lens_numbers], self.model)

    def poses(self, x: Array) -> Array:
        """Return (m, 6) poses."""
        return x[self.lens_numbers :].reshape(-1, 6)

    def misses(self, x: Array) -> Array:
        """Return (n, 2) corners projected minus corners seen [px]."""
        poses = self.poses(x)
        turned = np.einsum("nij,nj->ni", Rotation.from_rotvec(poses[:, :3]).as_matrix()[self.picture], self.points)
        missed = self.lens(x).project(turned + poses[self.picture, 3:]) - self.pixels
        return np.where(np.isfinite(missed), missed, UNSEEN)

    def residuals(self, x: Array) -> Array:
        """Return what is minimized: misses in x and y, then the coefficients, which are not expected to be large."""
        loose = x[4 : self.lens_numbers] * (NOISE / LOOSE)
        return np.concatenate([self.misses(x).ravel(), loose])

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives of the residuals, by central differences.

        A corner depends on the pose in its own picture only, so one number of all poses is moved at the same time.
        """
        found = np.zeros((2 * len(self.points) + self.lens_numbers - 4, len(x)))
        for index in range(self.lens_numbers):
            step = np.zeros_like(x)
            step[index] = STEPS
            found[:, index] = (self.residuals(x + step) - self.residuals(x - step)) / (2.0 * STEPS)
        rows = np.arange(len(self.points))
        for number in range(6):
            step = np.zeros_like(x)
            step[self.lens_numbers + number :: 6] = STEPS
            change = (self.misses(x + step) - self.misses(x - step)) / (2.0 * STEPS)
            columns = self.lens_numbers + 6 * self.picture + number
            found[2 * rows, columns], found[2 * rows + 1, columns] = change[:, 0], change[:, 1]
        return found


def _fit(used: Mapping[str, Corners], size: tuple[int, int], model: str) -> LensFit:
    problem = _Problem(list(used.values()), size, model)
    starts = [start for view in GUESSES if (start := _start(list(used.values()), problem, view)) is not None]
    if not starts:
        raise FitError("the board's place could not be found in every picture; check the number of its squares")
    starts.sort(key=lambda start: float(np.median(np.abs(problem.misses(start)))))
    found = min((_solve(problem, start) for start in starts[:2]), key=lambda result: result[1])
    x = found[0]
    missed = problem.misses(x)
    squares = (missed**2).sum(axis=1)
    count = missed.size
    # Robust: the median square of a two-dimensional normal error is 2 ln 2 of its variance.
    variance = max(float(np.median(squares)) / (2.0 * math.log(2.0)), 1e-12)
    jacobian = problem.jacobian(x)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * variance
    spread = np.sqrt(np.diag(covariance)[:4]) * problem.scale[:4]
    errors = {name: math.sqrt(float(squares[problem.picture == i].mean())) for i, name in enumerate(used)}
    criterion = count * math.log(float(squares.sum()) / count + 1e-12) + problem.lens_numbers * math.log(count)
    poses = dict(zip(used, problem.poses(x), strict=True))
    return LensFit(problem.lens(x), model, spread, errors, {}, poses, criterion)


def _solve(problem: _Problem, start: Array) -> tuple[Array, float]:
    """Return the best vector near a start, and its cost."""
    result = least_squares(
        problem.residuals, start, problem.jacobian, loss="soft_l1", f_scale=SOFT, x_scale="jac", max_nfev=60
    )
    return result.x, float(result.cost)


def _start(corners: Sequence[Corners], problem: _Problem, degrees: float) -> Array | None:
    """Return the vector of a lens without distortion that sees so much across the picture; None if that cannot be."""
    half = math.radians(degrees / 2.0)
    width, height = problem.size
    base = {EQUIDISTANT: half, EQUISOLID: 2.0 * math.sin(half / 2.0)}
    if problem.model not in base and degrees > 150.0:
        return None
    focal = width / 2.0 / base.get(problem.model, math.tan(min(half, 1.4)))
    numbers = [focal, focal, (width - 1) / 2.0, (height - 1) / 2.0]
    matrix = [[focal, 0.0, numbers[2]], [0.0, focal, numbers[3]], [0.0, 0.0, 1.0]]
    kind = problem.model if problem.model in (EQUIDISTANT, EQUISOLID) else RECTILINEAR
    plain = Lens(width, height, matrix, np.zeros(4), kind)
    poses = [_pose(each, plain) for each in corners]
    if any(pose is None for pose in poses):
        return None
    lens = np.array([*numbers, *[0.0] * (problem.lens_numbers - 4)]) / problem.scale[: problem.lens_numbers]
    return np.concatenate([lens, *(pose for pose in poses if pose is not None)])


def _pose(corners: Corners, lens: Lens) -> Array | None:
    """Return the (6,) pose of a board as a known lens sees it, the better of the two that a plane allows."""
    rays = lens.rays(corners.pixels)
    ahead = np.isfinite(rays).all(axis=1) & (np.nan_to_num(rays[:, 2]) > 0.05)
    if np.count_nonzero(ahead) < 6:
        return None
    flat = np.ascontiguousarray(rays[ahead, :2] / rays[ahead, 2:])
    points = np.ascontiguousarray(corners.points[ahead])
    count, turns, places, _ = cv2.solvePnPGeneric(points, flat, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    found, best = None, math.inf
    for turn, place in zip(turns[:count], places[:count], strict=True):
        pose = np.concatenate([np.ravel(turn), np.ravel(place)])
        there = corners.points @ Rotation.from_rotvec(pose[:3]).as_matrix().T + pose[3:]
        error = float(np.nanmean(np.abs(lens.project(there) - corners.pixels)))
        if error < best:
            found, best = pose, error
    return found


def choose_model(fits: Sequence[LensFit]) -> LensFit:
    """Return the fit of the model that explains the pictures best for its number of coefficients.

    The models may have left out different pictures: of those that kept the most, the least criterion wins.
    """
    most = max(len(fit.errors) for fit in fits)
    return min((fit for fit in fits if len(fit.errors) == most), key=lambda fit: fit.criterion)
