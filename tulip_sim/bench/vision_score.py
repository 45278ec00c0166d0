"""Compares the features of one picture with what it shows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.planar import wrap_angle
from tulip_description.robot import Robot
from tulip_sim.bench.vision_shots import Shot
from tulip_sim.bench.vision_truth import GROUPS, Thing, border_distances, line_distances, things
from tulip_sim.scene import Body
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_vision.lens import Lens
from tulip_vision.view import SpreadParameters, View, angles, direction_of

Array = NDArray[np.float64]

MATCH = math.radians(2.0)
"""A feature further than this from everything of its class, measured with the true camera pose, is false."""
BODY_MATCH = 0.2
"""[m] the same for opponents close by: two thirds of half a body's width."""
LINE_STEP = 0.1  # [m] between the points at which a piece of line is judged
FARTHEST_LINE = 5.0  # [m]
LINE_LIMITS = (0.02, 0.05, 0.15)  # [m] points further off than the last are on no line


@dataclass(frozen=True)
class Sighting:
    """One thing that vision should have found or did find; or, without a distance, something that is not there.

    Attributes:
        name: One of `GROUPS`.
        kind: Class of the feature, or of what was missed.
        picture: Index of the picture among those of its robot.
        movement: What the robot did.
        state: "whole", "partly" (hidden in part), "other" (less is visible: may be found) or "false".
        distance: Along the ground [m]; NaN for a false one.
        found: Whether there is a feature.
        azimuth, elevation: Errors of the feature [rad], camera pose as the robot knew it; NaN where not known.
        own_azimuth, own_elevation: The same with the true camera pose: what vision itself errs [rad].
        azimuth_spread, elevation_spread: Claimed [rad].
        range_error: Relative error of the distance that follows from the elevation; NaN where not known.
    """

    name: str
    kind: str
    picture: int
    movement: str
    state: str
    distance: float
    found: bool
    azimuth: float = math.nan
    elevation: float = math.nan
    own_azimuth: float = math.nan
    own_elevation: float = math.nan
    azimuth_spread: float = math.nan
    elevation_spread: float = math.nan
    range_error: float = math.nan

    def to_text(self) -> str:
        """Return one line for a results file."""
        return " ".join(f"{value:.5g}" if isinstance(value, float) else str(value) for value in vars(self).values())

    @classmethod
    def from_text(cls, text: str) -> Sighting:
        """Return what `to_text` wrote."""
        name, kind, picture, movement, state, distance, found, *numbers = text.split()
        values = [float(number) for number in numbers]
        return cls(name, kind, int(picture), movement, state, float(distance), found == "True", *values)


@dataclass(frozen=True)
class LineErrors:
    """How far points on pieces of line up to 5 m away are from the middles of the field's lines.

    Attributes:
        believed: (n,) [m], camera pose as the robot knew it.
        own: (n,) [m], with the true camera pose.
    """

    believed: Array
    own: Array


class Judge:
    """Judges the features of pictures of one lens on one field."""

    def __init__(self, lens: Lens, field: Field, robot: Robot) -> None:
        """Prepare.

        Args:
            lens: Of the camera.
            field: Of the scenes.
            robot: Whose own body hides things.
        """
        self._lens, self._field, self._body = lens, field, Body(robot, "cyan")

    def sightings(self, shot: Shot, number: int, features: Features) -> list[Sighting]:
        """Return everything that a picture shows, found or not, and what is false.

        Args:
            shot: The picture.
            number: Of the picture.
            features: What vision found in it.
        """
        result: list[Sighting] = []
        for name, present in self.things(shot).items():
            found = [each for each in features.features if each.kind in GROUPS[name]]
            result += self._compare(name, present, found, shot, number, features)
        return result

    def things(self, shot: Shot) -> dict[str, list[Thing]]:
        """Return what a picture shows, by the names of `GROUPS`."""
        view = View(self._lens, shot.true, SpreadParameters())
        return things(shot.truth, self._body, self._field, view)

    def line_errors(self, shot: Shot, features: Features) -> LineErrors:
        """Return how far the pieces of line of a picture are from the field's lines."""
        believed, own = self._places(shot, features, FeatureClass.LINE)
        return LineErrors(line_distances(believed, self._field), line_distances(own, self._field))

    def border_errors(self, shot: Shot, features: Features) -> Array:
        """Return how far points of the field's border in a picture are from it, camera pose as believed, (n,) [m]."""
        believed, _ = self._places(shot, features, FeatureClass.FIELD_BORDER)
        return border_distances(believed, self._field)

    def _places(self, shot: Shot, features: Features, kind: FeatureClass) -> tuple[Array, Array]:
        """Return points along straight features up to FARTHEST_LINE away, with both camera poses, (n, 2) in map [m]."""
        believed: list[Array] = [np.empty((0, 2))]
        own: list[Array] = [np.empty((0, 2))]
        for feature in features.features:
            if feature.kind != kind:
                continue
            ends = np.stack(
                [
                    direction_of(feature.azimuth, feature.elevation),
                    direction_of(feature.end_azimuth, feature.end_elevation),
                ]
            )
            start, end = _on_ground(ends, features.camera_position)
            share = np.linspace(0.0, 1.0, max(int(np.linalg.norm(end - start) / LINE_STEP), 1) + 1)[:, None]
            points = start + share * (end - start)
            points = points[np.hypot(*(points - features.camera_position[:2]).T) < FARTHEST_LINE]
            rays = np.column_stack([points, np.zeros(len(points))]) - features.camera_position
            truly = _on_ground(_turned(rays, shot), shot.true[:3, 3])
            for places, found in ((points, believed), (truly, own)):
                in_map = [shot.truth.footprint.transform((x, y)) for x, y in places.tolist()]
                found.append(np.array(in_map).reshape(-1, 2))
        return np.concatenate(believed), np.concatenate(own)

    def _compare(
        self, name: str, present: list[Thing], found: list[Feature], shot: Shot, number: int, features: Features
    ) -> list[Sighting]:
        left, result = list(found), []
        for thing in sorted(present, key=lambda each: (not each.whole, not each.partly)):
            truly = _angles_of(thing.point - shot.true[:3, 3])
            match = max(MATCH, BODY_MATCH / thing.distance) if name == "opponent" else MATCH
            fitting = [
                (off, feature)
                for feature in left
                if feature.kind in thing.kinds and (off := _off(_errors(feature, truly, shot))) < match
            ]
            state = "whole" if thing.whole else "partly" if thing.partly else "other"
            kind = thing.kinds[0].name
            if not fitting:
                if state != "other":
                    result.append(Sighting(name, kind, number, shot.movement, state, thing.distance, False))
                continue
            best = min(fitting, key=lambda pair: pair[0])[1]
            left.remove(best)
            known = _angles_of(thing.point - features.camera_position)
            own_azimuth, own_elevation = _errors(best, truly, shot)
            low = thing.point[2]  # on the ground, or the ball's centre
            distance = (
                (features.camera_position[2] - low) / math.tan(-best.elevation) if best.elevation < -0.01 else 0.0
            )
            result.append(
                Sighting(
                    name,
                    kind,
                    number,
                    shot.movement,
                    state,
                    thing.distance,
                    True,
                    wrap_angle(best.azimuth - known[0]),
                    best.elevation - known[1],
                    own_azimuth,
                    own_elevation,
                    best.azimuth_spread,
                    best.elevation_spread,
                    distance / thing.distance - 1.0 if distance > 0.0 else math.nan,
                )
            )
        for extra in left:
            result.append(Sighting(name, extra.kind.name, number, shot.movement, "false", math.nan, True))
        return result


def _turned(rays: Array, shot: Shot) -> Array:
    """Return rays (n, 3) from the believed base_footprint in the true one: the camera saw them in the same pixels."""
    turned: Array = rays @ shot.believed[:3, :3] @ shot.true[:3, :3].T
    return turned


def _on_ground(rays: Array, eye: Array) -> Array:
    """Return (n, 2) where rays from an eye (3,) meet the ground [m]; far away where they do not."""
    down = np.minimum(rays[:, 2:], -1e-6)
    met: Array = eye[:2] - rays[:, :2] / down * eye[2]
    return met


def _angles_of(ray: Array) -> tuple[float, float]:
    azimuth, elevation = angles((ray / np.linalg.norm(ray))[None])
    return float(azimuth[0]), float(elevation[0])


def _errors(feature: Feature, truly: tuple[float, float], shot: Shot) -> tuple[float, float]:
    """Return the errors of azimuth and elevation with the true camera pose [rad]."""
    unknown = math.isnan(feature.elevation)
    ray = direction_of(feature.azimuth, truly[1] if unknown else feature.elevation)
    azimuth, elevation = angles(_turned(ray[None], shot))
    return wrap_angle(float(azimuth[0]) - truly[0]), math.nan if unknown else float(elevation[0]) - truly[1]


def _off(errors: tuple[float, float]) -> float:
    return math.hypot(errors[0], 0.0 if math.isnan(errors[1]) else errors[1])
