"""The lens: exact in both directions over the whole picture, for all models."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tulip_vision.lens import Lens, head_camera_lens

ROUND_TRIP = 1e-6  # [px] far below what any detector resolves; only rounding remains
MATRIX = [[455.0, 0.0, 320.0], [0.0, 450.0, 240.0], [0.0, 0.0, 1.0]]
FISHEYE_MATRIX = [[330.0, 0.0, 322.0], [0.0, 330.0, 238.0], [0.0, 0.0, 1.0]]


WIDE_MATRIX = [[225.0, 0.0, 320.0], [0.0, 226.0, 240.0], [0.0, 0.0, 1.0]]


def _lenses() -> dict[str, Lens]:
    return {
        "head camera": head_camera_lens(),
        "no distortion": Lens(640, 480, MATRIX, np.zeros(5)),
        "four coefficients": Lens(640, 480, MATRIX, [-0.2, 0.04, 0.001, -0.001]),
        "rational": Lens(640, 480, MATRIX, [-0.1, 0.02, 0.001, -0.001, 0.0, 0.1, 0.01, 0.0], "rational_polynomial"),
        "fisheye": Lens(640, 480, FISHEYE_MATRIX, [-0.01, 0.002, 0.0, 0.0], "fisheye"),
        "fisheye of 200 deg": Lens(640, 480, WIDE_MATRIX, [-0.01, 0.002, 0.0, 0.0], "fisheye"),
        "equisolid": Lens(640, 480, FISHEYE_MATRIX, [], "equisolid"),
        "bent equisolid": Lens(640, 480, FISHEYE_MATRIX, [0.02, -0.003, 0.0, 0.0], "equisolid"),
        "equisolid of 200 deg": Lens(640, 480, WIDE_MATRIX, [], "equisolid"),
        "rectilinear": Lens(640, 480, MATRIX, [], "rectilinear"),
        "bent rectilinear": Lens(640, 480, MATRIX, [-0.05, 0.01, 0.0, 0.0], "rectilinear"),
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


def small(bound: float) -> st.SearchStrategy[float]:
    return st.floats(-bound, bound, allow_subnormal=False)


PLUMB = st.tuples(small(0.3), small(0.1), small(0.002), small(0.002), small(0.03))
RATIONAL = st.tuples(*(small(bound) for bound in (0.3, 0.1, 0.002, 0.002, 0.03, 0.3, 0.1, 0.03)))
ANGULAR = st.tuples(small(0.1), small(0.03), small(0.01), small(0.003))
ANY_MODEL = st.one_of(
    st.tuples(st.just("plumb_bob"), PLUMB),
    st.tuples(st.just("plumb_bob"), RATIONAL),
    *(st.tuples(st.just(name), ANGULAR) for name in ("equidistant", "equisolid", "rectilinear")),
)


@settings(max_examples=400)
@given(ANY_MODEL, st.floats(150.0, 900.0), st.floats(0.9, 1.1), small(20.0), small(20.0), st.integers(0, 2**32 - 1))
def test_pixels_that_see_anything_return_to_themselves_with_any_lens(
    model: tuple[str, tuple[float, ...]], focal: float, aspect: float, right: float, down: float, seed: int
):
    matrix = [[focal, 0.0, 319.5 + right], [0.0, focal * aspect, 239.5 + down], [0.0, 0.0, 1.0]]
    lens = Lens(640, 480, matrix, model[1], model[0])
    pixels = np.random.default_rng(seed).uniform((0.0, 0.0), (639.0, 479.0), (400, 2))
    pixels[:4] = [(0.0, 0.0), (639.0, 479.0), (0.0, 479.0), matrix[0][2:] + matrix[1][2:]]
    rays = lens.rays(pixels)
    seen = np.isfinite(rays).all(axis=1)
    assert seen[3]  # the optical axis
    assert np.abs(lens.project(rays[seen]) - pixels[seen]).max() < ROUND_TRIP
    assert np.abs(np.linalg.norm(rays[seen], axis=1) - 1.0).max() < 1e-12
    # Nothing that projects to a pixel is left out: directions round the axis as far as the lens sees.
    angles = np.linspace(0.0, lens.largest_angle * 0.95, 50)
    way = np.linspace(0.0, 6.0, 50)
    directions = np.stack([np.sin(angles) * np.cos(way), np.sin(angles) * np.sin(way), np.cos(angles)], axis=1)
    seen_at = lens.project(directions)
    inside = ((seen_at >= 0.0) & (seen_at <= (639.0, 479.0))).all(axis=1)
    assert lens.rays(seen_at[inside]) == pytest.approx(directions[inside], abs=1e-7)


@pytest.mark.parametrize(
    ("model", "radius"),
    [
        ("equidistant", lambda angle: angle),
        ("equisolid", lambda angle: 2.0 * math.sin(angle / 2.0)),
        ("rectilinear", math.tan),
    ],
)
def test_models_of_the_angle_are_their_closed_forms(model: str, radius):
    lens = Lens(640, 480, WIDE_MATRIX, [0.0] * 4, model)
    widest = 80.0 if model == "rectilinear" else 170.0
    for angle in np.radians([0.0, 0.001, 5.0, 40.0, widest]):
        for way in (0.0, 1.0, 4.0):
            direction = np.array([math.sin(angle) * math.cos(way), math.sin(angle) * math.sin(way), math.cos(angle)])
            pixel = (320.0 + 225.0 * radius(angle) * math.cos(way), 240.0 + 226.0 * radius(angle) * math.sin(way))
            assert lens.project([3.0 * direction])[0] == pytest.approx(pixel, abs=1e-9)
            assert lens.rays([pixel])[0] == pytest.approx(direction, abs=1e-9)


def test_plumb_bob_and_equidistant_agree_with_opencv():
    points = np.random.default_rng(1).uniform((-0.6, -0.5, 1.0), (0.6, 0.5, 2.0), (200, 3))
    still = np.zeros(3)
    matrix = np.array(MATRIX)
    for distortion in ([-0.2, 0.04, 0.001, -0.001, 0.01], [-0.1, 0.02, 0.001, -0.001, 0.0, 0.1, 0.01, 0.02]):
        seen, _ = cv2.projectPoints(points, still, still, matrix, np.array(distortion))
        assert Lens(640, 480, MATRIX, distortion).project(points) == pytest.approx(seen.reshape(-1, 2), abs=1e-9)
    bent = np.array([-0.01, 0.002, 0.001, -0.0005])
    seen, _ = cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), still, still, matrix, bent)
    assert Lens(640, 480, MATRIX, bent, "fisheye").project(points) == pytest.approx(seen.reshape(-1, 2), abs=1e-9)


@pytest.mark.parametrize("model", ["equidistant", "equisolid"])
def test_fisheyes_see_behind_themselves_and_black_corners_see_nothing(model: str):
    lens = Lens(640, 480, [[110.0, 0.0, 319.5], [0.0, 110.0, 239.5], [0.0, 0.0, 1.0]], [0.0] * 4, model)
    direction = np.array([math.sin(2.0), 0.0, math.cos(2.0)])  # 115 deg off the axis
    pixel = lens.project([direction])
    assert np.isfinite(pixel).all() and lens.rays(pixel)[0] == pytest.approx(direction, abs=1e-9)
    assert np.isnan(lens.rays([(0.0, 0.0)])).all()  # 398 px from the middle; the picture ends at 220 or 346 px
    assert np.isnan(lens.ray_table()[0, 0]).all()
    assert lens.largest_angle == pytest.approx(math.pi)


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
        ({"model": "equisolid", "distortion": [0.1]}, "0 or 4"),
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
