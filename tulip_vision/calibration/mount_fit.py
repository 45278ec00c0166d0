"""How the camera sits on the head, from the field's lines in pictures of a standing robot that looks round.

Each point found on a line is met with the ground, by the camera pose as the offsets tried give it. The residual is the
angle between the ray of the point and the direction of the nearest place on the field's lines. Where exactly the robot
stands and how its IMU is turned is not known either: these five numbers are found along with the offsets, each held by
how well it was known before. That is what makes the spread of the offsets honest: the yaw of a camera, for one, is
known no better than the robot's own unless the pictures tell the two apart, which they do if the head looks down and
to the sides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tulip_description.camera_mount import LARGEST_ANGLE, LARGEST_HEIGHT, OFFSETS, MountOffsets
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_description.quaternion import quaternion_yaw
from tulip_description.robot import Robot
from tulip_vision.calibration.field_lines import FieldLines
from tulip_vision.calibration.recording import Shot
from tulip_vision.lens import Lens
from tulip_vision.line_points import find_line_points
from tulip_vision.pipeline import VisionParameters
from tulip_vision.segmentation import Segmenter
from tulip_vision.view import View

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

FITTED = ("roll", "pitch", "yaw", "height")
FEWEST_PICTURES = 4  # looking four ways: fewer do not tell the camera's tilt from the trunk's
FEWEST_POINTS = 200
MOST_POINTS = 300  # of one picture, so that no picture counts for all
FARTHEST = 6.0  # [m] along the ground; a point at 6 m still tells the angle to 2 mrad
POINT_ANGLE = 1.5e-3  # [rad] spread of a line point: 0.7 px of the head camera
GUESSES = np.radians([-4.0, -2.0, 0.0, 2.0, 4.0])  # [rad] pitch and yaw that the search begins from
PRIORS = 5  # numbers known before: the robot's x, y and heading, the trunk's roll and pitch
OFF = 12.0 * POINT_ANGLE  # [rad] a point further from every line is none on a line


@dataclass(frozen=True)
class PriorParameters:
    """How well the robot's place and attitude are known before, as standard deviations.

    Attributes:
        place: Of the robot in x and y [m].
        heading: Of the robot [rad].
        attitude: Of the trunk's roll and pitch: mounting and bias of the IMU [rad].
        body: Of the trunk's height, which no picture tells from the camera's on the head [m].
    """

    place: float = 0.02  # a robot put on a mark by hand
    heading: float = math.radians(1.5)
    attitude: float = math.radians(0.5)
    body: float = 0.001

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not positive.
        """
        for entry in fields(self):
            if not getattr(self, entry.name) > 0.0:
                raise ValueError(f"{entry.name} is {getattr(self, entry.name)}; expected > 0")


class MountFitError(ValueError):
    """The pictures do not tell how the camera sits; the message says why."""


@dataclass(frozen=True)
class MountFit:
    """How the camera sits, and how sure that is.

    Attributes:
        mount: The offsets.
        names: Of the offsets that were found; the others are as given.
        covariance: (n, n) of these, [rad^2], [m^2].
        robot: Where the robot stood, as the lines tell.
        lean: By how much the trunk's roll and pitch are more than the robot measured [rad].
        before, after: Root mean square angle between points and lines with the offsets given and found [rad].
        errors: The same after the fit, by picture; pictures without line points are missing.
        points: Number of points used.
    """

    mount: MountOffsets
    names: tuple[str, ...]
    covariance: Array
    robot: Pose2D
    lean: tuple[float, float]
    before: float
    after: float
    errors: Mapping[str, float]
    points: int

    @property
    def spread(self) -> Array:
        """Standard deviations of the offsets found [rad], [m]."""
        spread: Array = np.sqrt(np.diag(self.covariance))
        return spread


def _soft(squares: Array) -> Array:
    """Return Cauchy's loss ln(1 + z) of squared residuals with its two derivatives, (3, n), as least_squares asks.

    What is known before counts in full: a softened prior would let heading and pan run off against each other.
    """
    loss = np.stack([np.log1p(squares), 1.0 / (1.0 + squares), -1.0 / (1.0 + squares) ** 2])
    loss[:, -PRIORS:] = np.stack([squares[-PRIORS:], np.ones(PRIORS), np.zeros(PRIORS)])
    return loss


def line_pixels(picture: Picture, lens: Lens, camera_in_footprint: Array, rng: np.random.Generator) -> Array:
    """Return (n, 2) pixels on the field's lines, n <= MOST_POINTS, as vision finds them.

    Args:
        picture: (height, width, 3) BGR.
        lens: That took it.
        camera_in_footprint: (4, 4) about where from; it tells how thick lines are.
        rng: Chooses which points are left out.
    """
    parameters = VisionParameters()
    view = View(lens, camera_in_footprint, parameters.spread)
    points = find_line_points(Segmenter(parameters.segmentation).segment(picture, view), view, parameters.line_points)
    near = np.flatnonzero(np.linalg.norm(points.ground, axis=1) < FARTHEST)
    if len(near) > MOST_POINTS:
        near = rng.choice(near, MOST_POINTS, replace=False)
    return points.pixels[near]


class MountCalibration:
    """All pictures of one recording."""

    def __init__(
        self,
        robot: Robot,
        field: Field,
        lens: Lens,
        place: Pose2D,
        shots: Sequence[Shot],
        start: MountOffsets,
        names: Sequence[str] = FITTED,
        prior: PriorParameters | None = None,
    ) -> None:
        """Prepare.

        Args:
            robot: Whose camera it is.
            field: Whose lines are seen.
            lens: Of the camera.
            place: Where base_footprint stood in map at the first picture.
            shots: How the head was held for each picture.
            start: The offsets as known before.
            names: Which of them are to be found.
            prior: How well place and attitude are known.

        Raises:
            ValueError: if a name is no offset, or both of a pair are asked for that do the same.
        """
        for name in names:
            if name not in OFFSETS:
                raise ValueError(f"there is no offset {name!r}; expected some of {', '.join(OFFSETS)}")
        if {"pitch", "tilt"} <= set(names):
            raise ValueError("pitch and tilt do the same; expected only one of the two")
        if len(shots) < FEWEST_PICTURES:
            raise MountFitError(f"the recording has {len(shots)} pictures; expected at least {FEWEST_PICTURES}")
        self._robot, self._lens, self._place, self._shots = robot, lens, place, tuple(shots)
        self._start, self._names, prior = start, tuple(names), prior or PriorParameters()
        self._lines = FieldLines(field)
        self._first_heading = quaternion_yaw(shots[0].base_orientation)
        self._body = prior.body
        self._prior = np.array([prior.place, prior.place, prior.heading, prior.attitude, prior.attitude])

    def camera_in_map(self, shot: Shot, mount: MountOffsets, place: Pose2D, lean: Array | None = None) -> Array:
        """Return the (4, 4) transform of camera_optical_frame in map.

        Args:
            shot: How the head was held.
            mount: How the camera sits.
            place: Where the robot stood at the first picture; soles creep, and so it may have turned on the spot since.
            lean: (2,) error of the trunk's roll and pitch, about its own axes [rad].
        """
        turn = np.asarray(shot.base_orientation)
        if lean is not None:
            turn = (Rotation.from_quat(turn) * Rotation.from_rotvec([lean[0], lean[1], 0.0])).as_quat()
        camera = camera_in_footprint(self._robot, shot.base_height, turn, shot.pan, shot.tilt, mount)
        yaw = place.yaw + quaternion_yaw(shot.base_orientation) - self._first_heading
        c, s = math.cos(yaw), math.sin(yaw)
        footprint = np.array([[c, -s, 0.0, place.x], [s, c, 0.0, place.y], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
        return footprint @ camera

    def fit(
        self, pictures: Sequence[Picture], rng: np.random.Generator, progress: Callable[[], None] = lambda: None
    ) -> MountFit:
        """Find the offsets.

        Args:
            pictures: (height, width, 3) BGR, one for each shot.
            rng: Thins out the points.
            progress: Called after each picture of both rounds: thick and thin are judged by the camera's pose, so the
                points are looked for again when it is known better.

        Raises:
            MountFitError: if too few points of lines are seen.
        """
        unknowns = np.zeros(len(self._names) + PRIORS)
        rays: list[Array] = []
        for round_ in range(2):
            mount = self._mount(unknowns)
            rays = []
            for shot, picture in zip(self._shots, pictures, strict=True):
                pose = camera_in_footprint(
                    self._robot, shot.base_height, shot.base_orientation, shot.pan, shot.tilt, mount
                )
                rays.append(self._lens.rays(line_pixels(picture, self._lens, pose, rng)))
                progress()
            if sum(len(each) for each in rays) < FEWEST_POINTS or sum(len(each) > 20 for each in rays) < 3:
                raise MountFitError(
                    f"{sum(len(each) for each in rays)} points on lines were found in {len(rays)} pictures; expected at"
                    f" least {FEWEST_POINTS}, in three or more: is the carpet green, and the place right?"
                )
            if round_ == 0:
                unknowns = self._search(rays)
            unknowns = self._solve(rays, unknowns)
        return self._result(rays, unknowns)

    def _mount(self, unknowns: Array) -> MountOffsets:
        changes = {}
        for name, value in zip(self._names, unknowns.tolist(), strict=False):
            most = LARGEST_HEIGHT if name == "height" else LARGEST_ANGLE
            changes[name] = min(max(getattr(self._start, name) + value, -most), most)
        return replace(self._start, **changes)

    def _misses(self, rays: Sequence[Array], unknowns: Array) -> Array:
        """Return (n, 3): where lines are minus where they are seen, as unit vectors [rad]."""
        mount = self._mount(unknowns)
        x, y, yaw, *lean = unknowns[len(self._names) :].tolist()
        place = Pose2D(self._place.x + x, self._place.y + y, self._place.yaw + yaw)
        found = []
        for shot, seen in zip(self._shots, rays, strict=True):
            if not len(seen):
                continue
            camera = self.camera_in_map(shot, mount, place, np.array(lean))
            directions = seen @ camera[:3, :3].T
            # What would be seen above the horizon meets the ground far away instead: it fits no line.
            reach = -camera[2, 3] / np.minimum(directions[:, 2], -0.02)
            ground = camera[:2, 3] + directions[:, :2] * reach[:, None]
            there = np.concatenate([self._lines.nearest(ground), np.zeros((len(seen), 1))], axis=1) - camera[:3, 3]
            found.append(there / np.linalg.norm(there, axis=1, keepdims=True) - directions)
        return np.concatenate(found)

    def _residuals(self, rays: Sequence[Array], unknowns: Array) -> Array:
        misses = self._misses(rays, unknowns)
        return np.concatenate([misses.ravel() / POINT_ANGLE, unknowns[len(self._names) :] / self._prior])

    def _search(self, rays: Sequence[Array]) -> Array:
        """Return the best of a grid of starts: lines can be taken for their neighbours when the start is far off."""
        few = [each[:: max(len(each) // 60, 1)] for each in rays]
        best, cost = np.zeros(len(self._names) + PRIORS), math.inf
        second = [name for name in ("yaw", "pan") if name in self._names][:1]
        first = [name for name in ("pitch", "tilt") if name in self._names][:1]
        for down in GUESSES if first else (0.0,):
            for left in GUESSES if second else (0.0,):
                start = np.zeros_like(best)
                for names, value in ((first, down), (second, left)):
                    for name in names:
                        start[self._names.index(name)] = value
                squares = (self._misses(few, start) ** 2).sum(axis=1) / OFF**2
                tried = float(np.log1p(squares).sum())
                if tried < cost:
                    best, cost = start, tried
        return best

    def _solve(self, rays: Sequence[Array], start: Array) -> Array:
        """Return the unknowns that fit best: wide errors first, so that no point is lost before it can be reached."""
        unknowns = start
        loss: Any = _soft  # the library's type hints know of no function, its documentation does
        for soft in (OFF / POINT_ANGLE, 3.0):
            residuals = partial(self._residuals, rays)
            result = least_squares(residuals, unknowns, loss=loss, f_scale=soft, x_scale=0.01)
            unknowns = result.x
        return unknowns

    def _result(self, rays: Sequence[Array], unknowns: Array) -> MountFit:
        count, known = len(self._names), np.zeros_like(unknowns)
        misses = self._misses(rays, unknowns)
        on_line = np.linalg.norm(misses, axis=1) < OFF
        used = [(shot.picture, len(seen)) for shot, seen in zip(self._shots, rays, strict=True) if len(seen)]
        names = np.repeat(np.arange(len(used)), [number for _, number in used])
        if np.count_nonzero(on_line) < max(FEWEST_POINTS, 0.5 * len(on_line)):
            raise MountFitError(
                f"only {np.count_nonzero(on_line)} of {len(on_line)} points fit the field's lines; expected half of"
                " them: is the robot's place right, and the field that of field.yaml?"
            )
        jacobian = np.empty((3 * len(on_line), len(unknowns)))
        for index in range(len(unknowns)):
            step = np.zeros_like(unknowns)
            step[index] = 1e-6
            change = self._misses(rays, unknowns + step) - self._misses(rays, unknowns - step)
            jacobian[:, index] = change.ravel() / 2e-6
        kept = np.repeat(on_line, 3)
        weights = kept / POINT_ANGLE**2
        information = (jacobian * weights[:, None]).T @ jacobian + np.diag([*[0.0] * count, *self._prior**-2.0])
        inverse = np.linalg.pinv(information)
        # Errors of neighbouring points are alike: pictures, not points, count as independent.
        scores = np.zeros((len(used), len(unknowns)))
        np.add.at(scores, np.repeat(names, 3), jacobian * (weights * misses.ravel())[:, None])
        scatter = scores.T @ scores * len(used) / max(len(used) - 1, 1)
        clustered = inverse @ scatter @ inverse
        # The latter knows nothing of the priors, the former nothing of likeness.
        covariance = np.asarray(inverse + clustered, np.float64)
        if "height" in self._names:
            covariance[self._names.index("height"), self._names.index("height")] += self._body**2
        squares = (misses**2).sum(axis=1)
        errors = {
            name: math.sqrt(float(squares[on_line & (names == index)].mean()))
            for index, (name, _) in enumerate(used)
            if (on_line & (names == index)).any()
        }
        before = np.linalg.norm(self._misses(rays, known), axis=1)[on_line]
        x, y, yaw, roll, pitch = unknowns[count:].tolist()
        return MountFit(
            self._mount(unknowns),
            self._names,
            covariance[:count, :count],
            Pose2D(self._place.x + x, self._place.y + y, self._place.yaw + yaw),
            (roll, pitch),
            math.sqrt(float((before**2).mean())),
            math.sqrt(float(squares[on_line].mean())),
            errors,
            int(np.count_nonzero(on_line)),
        )

    def visible(self, shot: Shot, mount: MountOffsets, place: Pose2D) -> float:
        """Return how much of the lines a picture shows [px]."""
        return float(sum(np.linalg.norm(end - start) for start, end in self._drawn_lines(shot, mount, place)))

    def draw(self, picture: Picture, shot: Shot, mount: MountOffsets, place: Pose2D) -> Picture:
        """Return a copy of a picture with the field's lines where the offsets put them, in red."""
        drawn = picture.copy()
        for start, end in self._drawn_lines(shot, mount, place):
            ends = [tuple(round(float(value) * 16) for value in point) for point in (start, end)]
            cv2.line(drawn, ends[0], ends[1], (0, 0, 255), 1, cv2.LINE_AA, 4)
        return drawn

    def _drawn_lines(self, shot: Shot, mount: MountOffsets, place: Pose2D) -> Iterator[tuple[Array, Array]]:
        """Yield the ends of short pieces of all lines that begin in the picture [px]."""
        camera = self.camera_in_map(shot, mount, place)
        size = (self._lens.width, self._lens.height)
        for outline in self._lines.outlines():
            points = np.concatenate([outline, np.zeros((len(outline), 1))], axis=1)
            pixels = self._lens.project((points - camera[:3, 3]) @ camera[:3, :3])
            for start, end in pairwise(pixels):
                if np.isfinite([start, end]).all() and any(((p >= 0.0) & (p < size)).all() for p in (start, end)):
                    yield start, end
