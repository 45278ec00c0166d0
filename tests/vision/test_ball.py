from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from test_segmentation import CARPET, looking_down

from tulip_vision.ball import BallParameters, find_ball
from tulip_vision.findings import Findings
from tulip_vision.lens import head_camera_lens
from tulip_vision.segmentation import SegmentationParameters, Segmenter
from tulip_vision.view import View, angles

ORANGE = (20, 100, 230)
RADIUS = BallParameters().radius


def silhouette(view: View, centre: np.ndarray, radius: float) -> np.ndarray:
    """Return (n, 2) pixels of a sphere's outline, from its tangent cone: exact in any lens."""
    ray = centre - view.position
    distance = float(np.linalg.norm(ray))
    axis, opening = ray / distance, math.asin(radius / distance)
    right = np.cross(axis, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, axis)
    turn = np.linspace(0.0, 2.0 * math.pi, 200)[:, None]
    cone = math.cos(opening) * axis + math.sin(opening) * (np.cos(turn) * right + np.sin(turn) * up)
    return view.pixels_of_directions(cone)


def look(
    view: View,
    *spheres: tuple[np.ndarray, float],
    cover: tuple[int, int, int, int] | None = None,
    own_body_from: int = 480,
) -> Findings:
    """Return what is found; `cover` hides a rectangle, and the own body everything below a row."""
    picture = np.full((480, 640, 3), CARPET, np.uint8)
    for centre, radius in spheres:
        outline = np.rint(silhouette(view, centre, radius) * 16).astype(np.int32)
        cv2.fillPoly(picture, [outline], ORANGE, cv2.LINE_AA, 4)
    if cover is not None:
        left, top, right, bottom = cover
        picture[top:bottom, left:right] = (50, 50, 50)
    own_body = np.zeros((480, 640), np.uint8)
    own_body[own_body_from:] = 255
    picture[own_body_from:] = (50, 50, 50)
    return find_ball(Segmenter(SegmentationParameters()).segment(picture, view, own_body), view, BallParameters())


@pytest.mark.parametrize("x", [0.5, 1.0, 2.5, 5.0, 8.0])
@pytest.mark.parametrize("sideways", [-0.5, 0.0, 0.45])
def test_direction_is_exact_to_a_fifth_of_a_pixel_and_spread_covers_it(x: float, sideways: float) -> None:
    view = looking_down(head_camera_lens(), 0.9 if x < 1.5 else 0.3)
    centre = np.array([x, x * sideways, RADIUS])
    found = look(view, (centre, RADIUS)).features
    assert len(found) == 1
    ray = centre - view.position
    distance = float(np.linalg.norm(ray))
    (azimuth,), (elevation,) = angles(ray[None] / distance)
    level = math.cos(elevation)
    pixel = 1.0 / 455.0
    assert found[0].azimuth == pytest.approx(azimuth, abs=0.2 * pixel / level)
    assert found[0].elevation == pytest.approx(elevation, abs=0.2 * pixel)
    # 0.8 px: OpenCV paints the pixels on the edge of a polygon whole.
    assert found[0].angular_radius == pytest.approx(math.asin(RADIUS / distance), abs=0.8 * pixel)
    assert abs(found[0].azimuth - azimuth) < 2.0 * found[0].azimuth_spread


def test_ball_half_behind_a_foot_is_found_with_a_larger_spread() -> None:
    view = looking_down(head_camera_lens(), 0.6)
    centre = np.array([1.5, 0.0, RADIUS])
    u, v = (round(value) for value in view.pixels(centre[None])[0])
    whole = look(view, (centre, RADIUS)).features[0]
    hidden = look(view, (centre, RADIUS), cover=(u + 2, v - 60, u + 80, v + 60)).features[0]
    assert hidden.azimuth == pytest.approx(whole.azimuth, abs=math.radians(0.3))
    assert hidden.azimuth_spread > whole.azimuth_spread
    assert hidden.confidence < whole.confidence
    assert math.isnan(hidden.angular_radius)  # it would look small, and so far away, in picture after picture
    assert whole.angular_radius > 0.0


@pytest.mark.parametrize("shown", [0.25, 0.5, 0.8])
@pytest.mark.parametrize("sideways", [0.0, 0.12])
def test_ball_half_hidden_by_the_own_chest_is_found_where_it_lies(shown: float, sideways: float) -> None:
    view = looking_down(head_camera_lens(), 1.2)
    centre = np.array([0.4, sideways, RADIUS])
    rows = silhouette(view, centre, RADIUS)[:, 1]
    below = round(float(rows.min() + shown * np.ptp(rows)))
    found = look(view, (centre, RADIUS), own_body_from=below).features
    assert len(found) == 1
    ray = centre - view.position
    (azimuth,), (elevation,) = angles(ray[None] / np.linalg.norm(ray))
    assert found[0].azimuth * math.cos(elevation) == pytest.approx(azimuth * math.cos(elevation), abs=0.003)
    assert found[0].elevation == pytest.approx(elevation, abs=0.003)
    assert math.isnan(found[0].angular_radius)


def test_what_the_own_chest_hides_half_must_be_as_big_as_a_ball_on_the_ground() -> None:
    view = looking_down(head_camera_lens(), 1.2)
    for radius in (0.05, 0.16):
        centre = np.array([0.4, 0.0, radius])
        rows = silhouette(view, centre, radius)[:, 1]
        found = look(view, (centre, radius), own_body_from=round(float(rows.mean())))
        assert not found.features
        assert found.refusals


@pytest.mark.parametrize(
    ("centre", "radius", "reason"),
    [
        ((3.0, 0.0, 0.3), 0.3, "would fit"),  # an orange bucket
        ((3.0, 0.0, 0.03), 0.03, "would fit"),  # a marble
    ],
)
def test_orange_things_of_another_size_are_refused_with_the_reason(
    centre: tuple[float, float, float], radius: float, reason: str
) -> None:
    result = look(looking_down(head_camera_lens(), 0.4), (np.array(centre), radius))
    assert result.features == ()
    assert reason in result.refusals[0].reason


def test_orange_above_the_carpet_is_refused() -> None:
    view = looking_down(head_camera_lens(), 0.1)
    picture = np.full((480, 640, 3), (120, 124, 118), np.uint8)
    picture[300:] = CARPET
    cv2.circle(picture, (320, 150), 15, ORANGE, -1)
    result = find_ball(Segmenter(SegmentationParameters()).segment(picture, view), view, BallParameters())
    assert result.features == ()
    assert [refusal.reason for refusal in result.refusals] == ["not on the carpet"]


def test_of_two_balls_the_better_one_is_reported() -> None:
    view = looking_down(head_camera_lens(), 0.5)
    good, bad = np.array([2.0, 0.4, RADIUS]), np.array([2.0, -0.4, RADIUS])
    found = look(view, (good, RADIUS), (bad, 1.4 * RADIUS)).features
    assert len(found) == 1
    assert found[0].azimuth > 0.0
