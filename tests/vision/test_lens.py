"""The lens: exact in both directions over the whole picture, for both models."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tulip_vision.lens import Lens, head_camera_lens

ROUND_TRIP = 1e-3  # [px] far below what any detector resolves
MATRIX = [[455.0, 0.0, 320.0], [0.0, 450.0, 240.0], [0.0, 0.0, 1.0]]
FISHEYE_MATRIX = [[330.0, 0.0, 322.0], [0.0, 330.0, 238.0], [0.0, 0.0, 1.0]]


def _lenses() -> dict[str, Lens]:
    return {
        "head camera": head_camera_lens(),
        "no distortion": Lens(640, 480, MATRIX, np.zeros(5)),
        "four coefficients": Lens(640, 480, MATRIX, [-0.2, 0.04, 0.001, -0.001]),
        "rational": Lens(640, 480, MATRIX, [-0.1, 0.02, 0.001, -0.001, 0.0, 0.1, 0.01, 0.0], "rational_polynomial"),
        "fisheye": Lens(640, 480, FISHEYE_MATRIX, [-0.01, 0.002, 0.0, 0.0], "fisheye"),
    }


def _all_pixels(lens: Lens) -> np.ndarray:
    v, u = np.mgrid[0 : lens.height, 0 : lens.width]
    return np.stack([u.ravel(), v.ravel()], axis=1).astype(float)


@pytest.mark.parametrize("name", list(_lenses()))
def test_every_pixel_returns_to_itself_through_ray_and_projection(name: str):
    lens = _lenses()[name]
    pixels = _all_pixels(lens)
    rays = lens.rays(pixels)
    assert np.linalg.norm(rays, axis=1) == pytest.approx(1.0, abs=1e-12)
    assert np.abs(lens.project(rays) - pixels).max() < ROUND_TRIP
    assert np.abs(lens.project(rays * 7.3) - pixels).max() < ROUND_TRIP  # the length of a ray does not matter


def test_ray_table_holds_the_ray_of_each_pixel_and_is_kept():
    lens = head_camera_lens()
    table = lens.ray_table()
    assert table.shape == (480, 640, 3) and table.dtype == np.float32
    assert table[17, 603] == pytest.approx(lens.rays([(603.0, 17.0)])[0], abs=1e-6)
    assert lens.ray_table() is table
    with pytest.raises(ValueError, match="read-only"):
        table[0, 0, 0] = 1.0


def test_projection_without_distortion_is_the_pinhole():
    lens = Lens(640, 480, MATRIX, np.zeros(5))
    points = np.array([[0.3, -0.2, 2.0], [-1.0, 0.5, 3.0]])
    expected = np.stack([455.0 * points[:, 0] / points[:, 2] + 320.0, 450.0 * points[:, 1] / points[:, 2] + 240.0], 1)
    assert lens.project(points) == pytest.approx(expected, abs=1e-9)


def test_fisheye_grows_with_the_angle_instead_of_its_tangent():
    lens = Lens(640, 480, [[330.0, 0.0, 320.0], [0.0, 330.0, 240.0], [0.0, 0.0, 1.0]], np.zeros(4), "equidistant")
    angle = math.radians(40.0)
    assert lens.project([[math.sin(angle), 0.0, math.cos(angle)]])[0] == pytest.approx((320.0 + 330.0 * angle, 240.0))


def test_head_camera_has_a_barrel_lens_and_sees_75_to_80_degrees():
    lens = head_camera_lens()
    horizontal, vertical = np.degrees(lens.field_of_view)
    assert 75.0 < horizontal < 80.0
    assert 55.0 < vertical < 62.0
    pinhole = Lens(640, 480, lens.camera_matrix, np.zeros(5))
    corner_ray = lens.rays([(0.0, 0.0)])
    drawn_in = pinhole.project(corner_ray)[0]
    assert drawn_in[0] < -10.0 and drawn_in[1] < -10.0  # the pinhole would put this direction well outside


def test_points_behind_the_camera_and_where_the_distortion_folds_back_have_no_pixel():
    lens = Lens(640, 480, MATRIX, [-0.4, 0.0, 0.0, 0.0])  # r (1 - 0.4 r^2) falls beyond r = 0.91
    pixels = lens.project([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [3.0, 0.0, 1.0], [0.5, 0.0, 1.0]])
    assert np.isnan(pixels[:3]).all()
    assert np.isfinite(pixels[3]).all()


def test_horizon_is_where_rays_are_level():
    lens = head_camera_lens()
    tilt = math.radians(10.0)  # camera looks down by 10 deg, map-like axes x forward, z up
    forward = np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    right = np.array([0.0, -1.0, 0.0])
    rotation = np.stack([right, np.cross(forward, right), forward], axis=1)
    horizon = lens.horizon(rotation)
    assert len(horizon) > 10
    assert (np.diff(horizon[:, 0]) > 0.0).all()
    assert np.abs((lens.rays(horizon) @ rotation.T)[:, 2]).max() < 1e-6
    down = np.stack([right, np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])], axis=1)
    assert lens.horizon(down).shape == (0, 2)


@pytest.mark.parametrize("name", list(_lenses()))
def test_camera_info_carries_the_lens(name: str):
    lens = _lenses()[name]
    copy = Lens.from_camera_info(lens.to_camera_info())
    pixels = [(3.0, 4.0), (600.0, 30.0), (320.0, 470.0)]
    assert copy.rays(pixels) == pytest.approx(lens.rays(pixels), abs=1e-12)
    assert (copy.width, copy.height, copy.model) == (lens.width, lens.height, lens.model)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"model": "pinhole"}, "plumb_bob"),
        ({"width": 0}, "0 x 480"),
        ({"camera_matrix": np.eye(2)}, "3 x 3"),
        ({"camera_matrix": np.zeros((3, 3))}, "fx, fy > 0"),
        ({"camera_matrix": [[400, 5, 320], [0, 400, 240], [0, 0, 1]]}, "cx"),
        ({"distortion": [0.1, 0.2]}, "4 or 5 or 8"),
        ({"distortion": [0.1, math.nan, 0, 0]}, "finite"),
    ],
)
def test_unusable_lens_is_refused_with_the_reason(change, words):
    arguments = {"width": 640, "height": 480, "camera_matrix": MATRIX, "distortion": np.zeros(5)} | change
    with pytest.raises(ValueError, match=words):
        Lens(**arguments)


def test_camera_info_without_calibration_is_refused():
    info = head_camera_lens().to_camera_info()
    with pytest.raises(ValueError, match="lacks k"):
        Lens.from_camera_info({key: value for key, value in info.items() if key != "k"})
    with pytest.raises(ValueError, match="fx, fy > 0"):
        Lens.from_camera_info(info | {"k": [0.0] * 9})


def test_no_pixels_give_no_rays():
    assert head_camera_lens().rays(np.empty((0, 2))).shape == (0, 3)
