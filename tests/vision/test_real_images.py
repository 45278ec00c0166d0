"""Pictures that no simulator made. Lens and pose of most of them are guesses; that is enough to find a ball."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from test_segmentation import looking_down

from tulip_sim.bench.vision_real import FOLDER as PICTURES
from tulip_vision.ball import BallParameters
from tulip_vision.features import Feature, FeatureClass
from tulip_vision.lens import Lens
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.view import direction_of

WITH_RED_BALL = {"image0000011.jpg", "image0000019.jpg"}

pytestmark = pytest.mark.skipif(not PICTURES.is_dir(), reason=f"the real pictures are not at {PICTURES}")


def see(
    name: str, focal: float, model: str, height: float, tilt: float, **parameters: object
) -> tuple[Vision, tuple[Feature, ...]]:
    picture = cv2.imread(str(PICTURES / name))
    assert picture is not None
    rows, columns = picture.shape[:2]
    matrix = [[focal, 0.0, columns / 2], [0.0, focal, rows / 2], [0.0, 0.0, 1.0]]
    lens = Lens(columns, rows, matrix, np.zeros(4), model)
    view = looking_down(lens, math.radians(tilt), height)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = view.rotation, view.position
    vision = Vision(VisionParameters(**parameters), lens)  # type: ignore[arg-type]
    features = vision.process(picture, 0, pose)
    assert vision.annotate(picture, features).shape == picture.shape
    return vision, features.features


@pytest.mark.parametrize(
    ("name", "focal", "model", "height", "tilt", "ball_radius", "u", "v"),
    [
        ("orange_era/convexhull1.png", 330.0, "equidistant", 0.9, 27.0, 0.0935, 417, 286),
        ("orange_era/rgb.jpg", 900.0, "plumb_bob", 1.0, 14.0, 0.05, 362, 492),
    ],
)
def test_the_orange_ball_is_found_in_pictures_of_2012(
    name: str, focal: float, model: str, height: float, tilt: float, ball_radius: float, u: int, v: int
) -> None:
    vision, features = see(name, focal, model, height, tilt, ball=BallParameters(radius=ball_radius))
    balls = [feature for feature in features if feature.kind == FeatureClass.BALL]
    assert len(balls) == 1
    assert vision.last is not None
    pixel = vision.last.view.pixels_of_directions(direction_of(balls[0].azimuth, balls[0].elevation)[None])[0]
    np.testing.assert_allclose(pixel, [u, v], atol=3.0)


@pytest.mark.parametrize("folder", ["lens_pose", "msl_yellow_ball"])
def test_balls_are_found_in_no_other_picture_but_those_with_a_red_ball(folder: str) -> None:
    names = sorted(path.name for path in (PICTURES / folder).glob("*.jpg"))
    assert names
    with_ball = set()
    for name in names:
        _, features = see(f"{folder}/{name}", 500.0, "equidistant", 0.9, 25.0)
        with_ball |= {name for feature in features if feature.kind == FeatureClass.BALL}
    assert with_ball <= WITH_RED_BALL
