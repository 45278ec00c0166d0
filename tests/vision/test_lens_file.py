"""Lens files in all forms that are read, and what is said of those that cannot be used."""

from __future__ import annotations

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.lens_file import LensFileError, lens_of, read_lens, write_lens
from tulip_vision.pipeline import Vision, VisionParameters

REAL = Path(__file__).parents[3] / "shared" / "data" / "real_images"

OF_ROS = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [438.783367, 0.000000, 305.593336, 0.000000, 437.302876, 243.738352, 0.000000, 0.000000, 1.000000]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [0.999978, 0.002789, -0.006046, -0.002816, 0.999986, -0.004401, 0.006034, 0.004417, 0.999972]
projection_matrix:
  rows: 3
  cols: 4
  data: [393.653800, 0.0, 322.797939, 0.0, 0.0, 393.653800, 241.090902, 0.0, 0.0, 0.0, 1.0, 0.0]
"""


def test_a_file_as_camera_calibration_writes_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "head.yaml"
    path.write_text(OF_ROS)
    lens = read_lens(path)
    assert (lens.width, lens.height, lens.model) == (640, 480, "plumb_bob")
    np.testing.assert_array_equal(lens.camera_matrix[:2, 2], [305.593336, 243.738352])
    np.testing.assert_array_equal(lens.distortion, [-0.361976, 0.110510, 0.001014, 0.000505, 0.0])


@pytest.mark.parametrize(
    ("model", "distortion"),
    [
        ("plumb_bob", [-0.2, 0.04, 0.001, -0.001, 0.01]),
        ("rational_polynomial", [-0.1, 0.02, 0.001, -0.001, 0.0, 0.1, 0.01, 0.02]),
        ("equidistant", [-0.01, 0.002, 0.0, 0.0]),
        ("equisolid", [0.02, 0.0, 0.0, 0.0]),
        ("rectilinear", []),
    ],
)
def test_what_is_written_is_read_again_to_the_last_digit(tmp_path: Path, model: str, distortion: list[float]) -> None:
    lens = Lens(640, 480, [[455.1, 0.0, 320.3], [0.0, 1e3 / 3, 240.7], [0.0, 0.0, 1.0]], distortion, model)
    write_lens(tmp_path / "lens.yaml", lens, provenance=["A note: with a colon"])
    again = read_lens(tmp_path / "lens.yaml", (640, 480))
    assert again.to_camera_info() == lens.to_camera_info()
    assert lens_of(lens.to_camera_info()).to_camera_info() == lens.to_camera_info()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: [1\n b", "is not YAML"),
        ("- 1", "expected a mapping"),
        ("image_width: 640", "lacks image_height"),
        (OF_ROS.replace("plumb_bob", "pinhole"), "expected one of plumb_bob"),
        (OF_ROS.replace("438.783367", "wide"), "could not convert string to float"),
        (OF_ROS.replace("438.783367, ", ""), "camera_matrix has 8 numbers"),
        (OF_ROS.replace("image_width: 640", "image_width: 800"), "is for pictures of 800 x 480 px"),
        ("{projection: CONICAL, focal_length: 400}", "expected one of RECTILINEAR, EQUIDISTANT, EQUISOLID"),
        ("{projection: EQUISOLID, focal_length: 400, k: [0.1, 0]}", "expected zeros"),
        ("{projection: EQUISOLID}", "lacks focal_length"),
    ],
)
def test_unusable_files_are_named_with_the_reason(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(LensFileError, match=words) as caught:
        read_lens(path, (640, 480))
    assert str(path) in str(caught.value)
    with pytest.raises(LensFileError, match="cannot be read"):
        read_lens(tmp_path / "none.yaml")


def test_a_file_without_size_needs_one(tmp_path: Path) -> None:
    path = tmp_path / "lens.yaml"
    path.write_text("{projection: EQUISOLID, focal_length: 420, centre: [3, -2], k: [0, 0], fov: 1.6}")
    with pytest.raises(LensFileError, match="how large the picture is"):
        read_lens(path)
    lens = read_lens(path, (1280, 1024))
    np.testing.assert_allclose(lens.camera_matrix[:2, 2], [636.5, 513.5])  # counted to the left and upwards


@pytest.mark.skipif(not REAL.is_dir(), reason=f"the real pictures are not at {REAL}")
def test_the_lenses_of_the_real_pictures_are_read_and_exact_over_their_pictures(tmp_path: Path) -> None:
    entries = [e for e in json.loads((REAL / "manifest.json").read_text())["files"] if "lens" in (e["annotation"])]
    assert len(entries) == 12
    for entry in entries:
        path = tmp_path / "lens.yaml"
        path.write_text(entry["annotation"]["lens"])
        width, height = entry["size"]
        picture = cv2.imread(str(REAL / entry["file"]))
        lens = read_lens(path, (width, height))
        v, u = np.mgrid[0:height:16, 0:width:16]
        pixels = np.stack([u.ravel(), v.ravel()], axis=1).astype(float)
        np.testing.assert_allclose(lens.project(lens.rays(pixels)), pixels, atol=1e-6)
        assert picture.shape == (height, width, 3)


def test_vision_works_with_a_fisheye_that_sees_more_than_half_of_everything() -> None:
    lens = Lens(640, 480, [[150.0, 0.0, 319.5], [0.0, 150.0, 239.5], [0.0, 0.0, 1.0]], np.zeros(4), "equisolid")
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0.0, -0.5, math.sqrt(0.75)], [-1.0, 0.0, 0.0], [0.0, -math.sqrt(0.75), -0.5]])
    pose[2, 3] = 1.1
    picture = np.full((480, 640, 3), (120, 124, 118), np.uint8)
    rays = lens.ray_table().reshape(-1, 3).astype(float) @ pose[:3, :3].T
    with np.errstate(invalid="ignore"):
        picture.reshape(-1, 3)[rays[:, 2] < -0.12] = (44, 128, 58)
    vision = Vision(VisionParameters(), lens)
    features = vision.process(picture, 0, pose)
    assert vision.last is not None
    assert vision.last.segmentation.on_carpet[300, 320] == 255
    assert vision.annotate(picture, features).shape == picture.shape
    assert vision.process(head_camera_picture(), 0, pose).features == ()


def head_camera_picture() -> np.ndarray:
    return np.zeros((head_camera_lens().height, head_camera_lens().width, 3), np.uint8)
