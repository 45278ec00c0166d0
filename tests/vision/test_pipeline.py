from __future__ import annotations

import math

import numpy as np
import pytest
from test_segmentation import CARPET, looking_down

from tulip_vision.body_growth import lowest_of_body
from tulip_vision.lens import head_camera_lens
from tulip_vision.line_growth import grow_lines
from tulip_vision.pipeline import Stage, Vision, VisionParameters, check_stages, stages
from tulip_vision.pixel_loops import nearest_pixels
from tulip_vision.view import SpreadParameters, View


def pose_of(view: View) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = view.rotation, view.position
    return pose


POSE = pose_of(looking_down(head_camera_lens(), 0.5))


@pytest.mark.parametrize(
    "picture",
    [
        np.zeros((480, 640), np.uint8),
        np.zeros((480, 640, 1), np.uint8),
        np.zeros((480, 640, 4), np.uint8),
        np.zeros((240, 320, 3), np.uint8),
        np.zeros((640, 480, 3), np.uint8),
        np.zeros((480, 640, 3), np.float32),
        np.zeros((0, 0, 3), np.uint8),
        None,
    ],
)
def test_pictures_of_wrong_shape_or_type_are_refused(picture: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"expected \(480, 640, 3\) uint8"):
        Vision(VisionParameters(), head_camera_lens()).process(picture, 0, POSE)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (np.eye(3), "expected \\(4, 4\\)"),
        (np.full((4, 4), np.nan), "finite"),
        (np.diag([2.0, 1.0, 1.0, 1.0]), "no rotation"),
        (np.eye(4), "0.000 m high"),
    ],
)
def test_poses_that_are_none_are_refused(pose: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Vision(VisionParameters(), head_camera_lens()).process(np.zeros((480, 640, 3), np.uint8), 0, pose)


@pytest.mark.parametrize("tilt", [-1.2, 0.0, 0.5, 1.5])
@pytest.mark.parametrize("roll", [0.0, 1.5, 3.1])
def test_any_content_in_any_attitude_is_processed(tilt: float, roll: float) -> None:
    lens = head_camera_lens()
    vision = Vision(VisionParameters(), lens)
    pose = pose_of(looking_down(lens, tilt, roll=roll))
    rng = np.random.default_rng(0)
    blocks = rng.integers(0, 255, (24, 32, 3)).astype(np.uint8).repeat(20, axis=0).repeat(20, axis=1)
    for picture in (
        np.zeros((480, 640, 3), np.uint8),
        np.full((480, 640, 3), 255, np.uint8),
        np.full((480, 640, 3), CARPET, np.uint8),
        np.full((480, 640, 3), (20, 100, 230), np.uint8),
        rng.integers(0, 255, (480, 640, 3)).astype(np.uint8),
        blocks,
    ):
        features = vision.process(picture, 5, pose)
        assert features.stamp == 5
        assert np.isfinite(features.view).all()
        for feature in features.features:
            assert math.isfinite(feature.azimuth)
            assert feature.azimuth_spread > 0.0
            assert 0.0 <= feature.confidence <= 1.0
        assert vision.annotate(picture, features).shape == picture.shape


def test_the_same_picture_gives_the_same_features_whatever_came_before() -> None:
    lens = head_camera_lens()
    rng = np.random.default_rng(1)
    picture = np.full((480, 640, 3), CARPET, np.uint8)
    picture[300:310] = 230
    picture[200:420, 300:312] = 230
    vision = Vision(VisionParameters(), lens)
    first = vision.process(picture, 1, POSE)
    vision.process(rng.integers(0, 255, (480, 640, 3)).astype(np.uint8), 2, POSE)
    second = vision.process(picture, 1, POSE)
    assert len(first.features) > 0
    assert repr(first.features) == repr(second.features)


def test_rehearsing_leaves_no_trace() -> None:
    picture = np.full((480, 640, 3), CARPET, np.uint8)
    picture[300:310] = 230
    fresh, rehearsed = (Vision(VisionParameters(), head_camera_lens()) for _ in range(2))
    rehearsed.rehearse()
    assert rehearsed.last is None
    loops = (lowest_of_body, grow_lines, nearest_pixels)
    assert all(loop.signatures for loop in loops)  # compiled, so that no real picture has to wait
    first, second = (vision.process(picture, 5, POSE) for vision in (fresh, rehearsed))
    assert len(first.features) > 0
    assert repr(first.features) == repr(second.features)


def test_annotating_another_picture_is_refused() -> None:
    picture = np.full((480, 640, 3), CARPET, np.uint8)
    vision = Vision(VisionParameters(), head_camera_lens())
    old = vision.process(picture, 1, POSE)
    vision.process(picture, 2, POSE)
    with pytest.raises(ValueError, match="another picture"):
        vision.annotate(picture, old)


def test_stages_name_what_they_need_before_anything_runs() -> None:
    order = stages(VisionParameters())
    check_stages(order)
    with pytest.raises(ValueError, match="'join lines' requires line_points"):
        check_stages([stage for stage in order if stage.provides != "line_points"])
    with pytest.raises(ValueError, match="provided already"):
        check_stages([*order, Stage("again", (), "ball", list)])


def test_the_view_covers_what_the_lens_sees_and_spreads_grow_with_pixel_noise() -> None:
    lens = head_camera_lens()
    view = looking_down(lens, 0.5)
    left, right, low, high = view.coverage()
    assert left > 0.0 > right
    assert low < -0.5 < high
    assert left - right == pytest.approx(lens.field_of_view[0] / math.cos(0.5), rel=0.1)
    ray = view.rotation[:, 2]
    fine = View(lens, pose_of(view), SpreadParameters(pixel=0.5, pose_azimuth=0.0, pose_elevation=0.0)).spreads(ray)
    assert fine[1] == pytest.approx(0.5 / 455.0, rel=0.02)
    assert fine[0] == pytest.approx(0.5 / 455.0 / math.cos(0.5), rel=0.02)


@pytest.mark.parametrize(("u", "v"), [(0.0, 479.0), (320.0, 400.0), (639.0, 300.0)])
def test_ground_and_pixels_are_inverse_to_each_other(u: float, v: float) -> None:
    view = looking_down(head_camera_lens(), 0.5, roll=0.1)
    ground = view.ground(view.directions(np.array([[u, v]])))
    np.testing.assert_allclose(view.pixels_on_ground(ground), [[u, v]], atol=1e-3)
