"""Nothing that a camera may deliver ends vision: any size, any number of channels, any content, and real pictures."""

from __future__ import annotations

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_pipeline import pose_of
from test_segmentation import looking_down

from tulip_description.robot import load_robot
from tulip_sim.bench.vision_real import FOLDER
from tulip_vision.lens import Lens
from tulip_vision.own_body import OwnBody
from tulip_vision.pipeline import SMALLEST, Vision, VisionParameters

OWN_BODY = OwnBody(load_robot())


def lens_of(width: int, height: int, model: str) -> Lens:
    focal = 0.7 * max(width, height)
    matrix = [[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]]
    return Lens(width, height, matrix, np.zeros(4), model)


def field_colours(width: int, height: int, seed: int) -> np.ndarray:
    """Return blocks in the colours of a field, with noise: more like a field than pure noise is."""
    rng = np.random.default_rng(seed)
    palette = np.array([(62, 126, 52), (220, 220, 220), (28, 112, 246), (38, 200, 232), (186, 92, 36), (150, 52, 214)])
    block = int(rng.integers(1, 40))
    cells = rng.choice(len(palette), (-(-height // block), -(-width // block)), p=(0.6, 0.15, 0.07, 0.06, 0.06, 0.06))
    picture = palette[cells].repeat(block, axis=0).repeat(block, axis=1)[:height, :width]
    return np.clip(picture + rng.normal(0.0, 6.0, picture.shape), 0, 255).astype(np.uint8)


@settings(max_examples=40)
@given(
    width=st.integers(SMALLEST, 330),
    height=st.integers(SMALLEST, 250),
    model=st.sampled_from(["plumb_bob", "equidistant", "equisolid"]),
    tilt=st.floats(-0.5, 1.5),
    seed=st.integers(0, 1000),
)
def test_pictures_of_any_size_and_content_are_processed(
    width: int, height: int, model: str, tilt: float, seed: int
) -> None:
    lens = lens_of(width, height, model)
    picture = field_colours(width, height, seed)
    features = Vision(VisionParameters(), lens, OWN_BODY).process(picture, 3, pose_of(looking_down(lens, tilt)))
    assert features.stamp == 3
    assert all(math.isfinite(each.azimuth) and each.azimuth_spread > 0.0 for each in features.features)


@pytest.mark.parametrize(("width", "height"), [(1, 1), (3, 200), (330, 15)])
def test_lenses_of_pictures_too_small_to_show_anything_are_refused(width: int, height: int) -> None:
    with pytest.raises(ValueError, match="expected at least 16 x 16"):
        Vision(VisionParameters(), lens_of(width, height, "plumb_bob"))


@settings(max_examples=20)
@given(channels=st.sampled_from([0, 1, 2, 4, 5]), type_=st.sampled_from([np.uint8, np.uint16, np.float32, np.bool_]))
def test_pictures_with_another_number_of_channels_or_type_are_refused_by_name(channels: int, type_: type) -> None:
    lens = lens_of(64, 48, "plumb_bob")
    with pytest.raises(ValueError, match=r"expected \(48, 64, 3\) uint8"):
        Vision(VisionParameters(), lens).process(
            np.zeros((48, 64, channels), type_), 0, pose_of(looking_down(lens, 0.5))
        )


@pytest.mark.skipif(not FOLDER.is_dir(), reason=f"the real pictures are not at {FOLDER}")
def test_every_real_picture_is_processed_at_its_own_size_and_smaller() -> None:
    for entry in json.loads((FOLDER / "manifest.json").read_text())["files"]:
        whole = cv2.imread(str(Path(FOLDER) / entry["file"]))
        assert whole is not None
        for scale in (1.0, 0.37):
            picture = np.asarray(cv2.resize(whole, None, fx=scale, fy=scale), np.uint8)
            lens = lens_of(picture.shape[1], picture.shape[0], "equidistant")
            vision = Vision(VisionParameters(), lens, OWN_BODY)
            features = vision.process(picture, 0, pose_of(looking_down(lens, 0.4)))
            assert vision.annotate(picture, features).shape == picture.shape
