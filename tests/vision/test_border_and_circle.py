"""Border, centre circle, yellowish turf and the compiled loops, on pictures painted or rendered for the purpose."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from vision_evaluation import camera_pose, random_scenes, truth_of

from tulip_description.field import load_field
from tulip_description.model import OPTICAL_ROTATION
from tulip_description.robot import load_robot
from tulip_sim.bench.vision_truth import border_distances
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_vision.features import Feature, FeatureClass
from tulip_vision.lens import head_camera_lens
from tulip_vision.line_growth import grow_lines, local_directions
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.segmentation import Colour, SegmentationParameters, Segmenter
from tulip_vision.view import SpreadParameters, View, direction_of

FIELD, ROBOT, LENS = load_field(), load_robot(), head_camera_lens()
GREEN, GREY = (50, 130, 40), (110, 110, 110)  # BGR


def looking_down(tilt: float, height: float = 1.1) -> np.ndarray:
    c, s = math.cos(tilt), math.sin(tilt)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ OPTICAL_ROTATION
    pose[2, 3] = height
    return pose


def painted(pose: np.ndarray, colour: tuple[int, int, int], edge: float) -> np.ndarray:
    """Return a picture of a carpet that ends `edge` ahead, and of a grey hall beyond [m]."""
    view = View(LENS, pose, SpreadParameters())
    picture = np.full((LENS.height, LENS.width, 3), GREY, dtype=np.uint8)
    v, u = np.mgrid[0 : LENS.height, 0 : LENS.width]
    ground = view.ground(view.directions_at(u.ravel(), v.ravel()))
    picture.reshape(-1, 3)[ground[:, 0] < edge] = colour
    return picture


def ends_on_ground(feature: Feature, view: View) -> np.ndarray:
    rays = [(feature.azimuth, feature.elevation), (feature.end_azimuth, feature.end_elevation)]
    return view.ground(np.array([direction_of(*ray) for ray in rays]))


@pytest.mark.parametrize("edge", [2.0, 3.5, 5.0])
def test_edge_of_the_carpet_is_found_within_its_spread(edge: float) -> None:
    vision, pose = Vision(VisionParameters(), LENS), looking_down(0.35)
    features = vision.process(painted(pose, GREEN, edge), 0, pose).features
    borders = [feature for feature in features if feature.kind is FeatureClass.FIELD_BORDER]
    assert len(borders) == 1
    assert vision.last is not None
    ends = ends_on_ground(borders[0], vision.last.view)
    per_radian = (1.1**2 + edge**2) / 1.1
    assert np.abs(ends[:, 0] - edge).max() < 2.0 * per_radian * borders[0].elevation_spread
    assert np.linalg.norm(ends[1] - ends[0]) > 1.0


def test_a_thing_that_hides_carpet_makes_no_border() -> None:
    pose = looking_down(0.35)
    picture = painted(pose, GREEN, 100.0)  # no edge in sight: up to the horizon
    cv2.rectangle(picture, (0, 150), (250, 479), GREY, -1)
    features = Vision(VisionParameters(), LENS).process(picture, 0, pose).features
    assert not [feature for feature in features if feature.kind is FeatureClass.FIELD_BORDER]


def test_border_and_circle_of_rendered_scenes_lie_where_they_are() -> None:
    renderer, vision, rng = (
        CameraRenderer(CameraParameters(), FIELD, ROBOT, LENS),
        Vision(VisionParameters(), LENS),
        None,
    )
    rng = np.random.default_rng(4)
    borders, circles = [], []
    for number, scene in enumerate(random_scenes(60, FIELD, ROBOT, np.random.default_rng(4))):
        features = vision.process(renderer.render(truth_of(scene), rng), number, camera_pose(scene, ROBOT))
        assert vision.last is not None
        for feature in features.features:
            if feature.kind is FeatureClass.FIELD_BORDER:
                ends = ends_on_ground(feature, vision.last.view)
                if np.hypot(*ends.T).max() < 5.0:
                    borders.append(np.array([scene.footprint.transform(tuple(end)) for end in ends.tolist()]))
            elif feature.kind is FeatureClass.CENTRE_CIRCLE:
                ray = direction_of(feature.azimuth, feature.elevation)
                middle = vision.last.view.ground(ray[None])[0]
                circles.append(np.hypot(*scene.footprint.transform((float(middle[0]), float(middle[1])))))
    assert len(borders) >= 5 and len(circles) >= 5
    assert np.median(border_distances(np.concatenate(borders), FIELD)) < 0.05  # [m]
    assert max(circles) < 0.10  # [m]


@pytest.mark.parametrize("colour", [(25, 75, 68), (30, 88, 78)])  # hues of 68 and 65 deg
def test_yellowish_turf_is_green(colour: tuple[int, int, int]) -> None:
    pose = looking_down(0.35)
    rng = np.random.default_rng(1)
    picture = painted(pose, colour, 4.0).astype(int)
    picture[..., :] += rng.integers(-4, 5, picture.shape)  # scatter of some degrees of hue
    seen = Segmenter(SegmentationParameters()).segment(
        picture.clip(0, 255).astype(np.uint8), View(LENS, pose, SpreadParameters())
    )
    carpet = painted(pose, colour, 4.0)[..., 2] == colour[2]
    assert (seen.mask(Colour.GREEN)[carpet] != 0).mean() > 0.97


def test_points_of_three_lines_give_these_lines() -> None:
    rng = np.random.default_rng(2)
    lines = [((0.0, 10.0), (0.96, 0.28)), ((30.0, 0.0), (0.0, 1.0)), ((0.0, 90.0), (0.8, -0.6))]
    points = np.concatenate(
        [np.array(start) + np.linspace(0.0, 110.0, 60)[:, None] * np.array(along) for start, along in lines]
    )
    points += 0.2 * rng.standard_normal(points.shape)
    directions, clear = local_directions(points, np.ones(len(points), dtype=np.bool_), 13.0, 8.0)
    candidates = np.flatnonzero(clear)
    to_ground = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    limits, gaps = (1.3, math.cos(math.radians(14.0)), 8, 16), (22.0, 0.35)
    members, lengths, found = grow_lines(points, directions, clear, candidates, limits, gaps, to_ground)
    assert len(found) == 3
    assert len(members) == lengths.sum() == len(set(members.tolist()))
    for _, along in lines:
        assert max(abs(float(np.dot(along, line[2:]))) for line in found) > math.cos(math.radians(0.5))
