from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.patches import patches
from tulip_vision.segmentation import Colour, ColourBox, SegmentationParameters, Segmenter
from tulip_vision.view import SpreadParameters, View

CARPET = (44, 128, 58)
PAINTS = {
    Colour.GREEN: CARPET,
    Colour.WHITE: (225, 230, 225),
    Colour.ORANGE: (20, 100, 230),
    Colour.YELLOW: (30, 190, 215),
    Colour.BLUE: (170, 70, 25),
    Colour.CYAN: (200, 180, 30),
    Colour.MAGENTA: (150, 40, 200),
    Colour.DARK: (30, 30, 30),
}


def looking_down(lens: Lens, tilt: float, height: float = 1.1, roll: float = 0.0) -> View:
    """Return the view of a camera that looks forward and `tilt` [rad] down."""
    c, s = math.cos(tilt), math.sin(tilt)
    forward, down = np.array([c, 0.0, -s]), np.array([-s, 0.0, -c])
    rotation = np.stack([np.array([0.0, -1.0, 0.0]), down, forward], axis=1)
    c, s = math.cos(roll), math.sin(roll)
    transform = np.eye(4)
    transform[:3, :3] = rotation @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    transform[2, 3] = height
    return View(lens, transform, SpreadParameters())


@pytest.mark.parametrize("gain", [0.45, 0.7, 1.0, 1.5])
def test_each_paint_has_its_own_class_in_dark_and_bright_halls(gain: float) -> None:
    lens = head_camera_lens()
    picture = np.full((480, 640, 3), CARPET, np.uint8)
    for index, paint in enumerate(PAINTS.values()):
        picture[200:230, 40 + 70 * index : 70 + 70 * index] = paint
    picture = np.clip(picture * gain, 0, 255).astype(np.uint8)
    classes = Segmenter(SegmentationParameters()).segment(picture, looking_down(lens, 0.6)).classes
    for index, colour in enumerate(PAINTS):
        block = classes[205:225, 45 + 70 * index : 65 + 70 * index]
        assert ((block & colour) != 0).all(), colour.name
        others = [other for other in PAINTS if other not in (colour, Colour.DARK)]
        assert not any((block & other).any() for other in others), colour.name


@pytest.mark.parametrize("roll", [-0.15, 0.0, 0.15])
def test_outline_follows_the_far_edge_of_the_carpet_past_robots_and_green_jackets(roll: float) -> None:
    lens = head_camera_lens()
    view = looking_down(lens, 0.35, roll=roll)
    ground = view.ground(view.lens.ray_table().reshape(-1, 3).astype(float) @ view.rotation.T).reshape(480, 640, 2)
    with np.errstate(invalid="ignore"):
        carpet = ground[:, :, 0] < 5.0  # NaN, above the horizon, is not
    picture = np.full((480, 640, 3), (120, 124, 118), np.uint8)
    picture[carpet] = CARPET
    edge = view.pixels_on_ground(np.array([[5.0, y] for y in (-2.0, 0.0, 2.0)]))
    u, v = (int(value) for value in edge[0])
    picture[v - 30 : v + 60, u - 20 : u + 20] = (60, 60, 60)  # a robot
    u, v = (int(value) for value in edge[2])
    cv2.rectangle(picture, (u - 15, max(v - 70, 0)), (u + 15, v - 30), CARPET, -1)  # a jacket beyond the floor
    outline = Segmenter(SegmentationParameters()).segment(picture, view).outline
    for u, v in edge:
        assert np.interp(u, outline[:, 0], outline[:, 1]) == pytest.approx(v, abs=2.5)


def test_a_picture_without_carpet_has_no_outline() -> None:
    view = looking_down(head_camera_lens(), 0.3)
    result = Segmenter(SegmentationParameters()).segment(np.full((480, 640, 3), 90, np.uint8), view)
    assert len(result.outline) == 0
    assert not result.on_carpet.any()
    assert result.brightness == 1.0


def test_patches_come_by_size_and_include_those_inside_holes() -> None:
    mask = np.zeros((100, 100), np.uint8)
    cv2.rectangle(mask, (10, 10), (90, 90), 1, 3)
    cv2.circle(mask, (50, 50), 8, 1, -1)
    mask[2, 2] = 1
    found = patches(mask, least_area=4.0, most=5)
    assert len(found) == 2
    assert found[0][1] > found[1][1] == pytest.approx(math.pi * 8**2, rel=0.1)
    np.testing.assert_allclose(found[1][0].mean(axis=0), [50, 50], atol=0.5)


@pytest.mark.parametrize("bad", [{"hue": (10.0, 400.0)}, {"saturation": (0.5, 0.2)}, {"value": (0.0, 1.2)}])
def test_colour_boxes_out_of_range_are_refused(bad: dict[str, tuple[float, float]]) -> None:
    with pytest.raises(ValueError, match="expected"):
        ColourBox(**bad)
