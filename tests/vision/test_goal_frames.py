"""Goals as wholes, on painted pictures of posts and bars."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.model import OPTICAL_ROTATION
from tulip_vision.features import Feature, FeatureClass
from tulip_vision.lens import head_camera_lens
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.view import SpreadParameters, View, direction_of

LENS = head_camera_lens()
GREEN, GREY, YELLOW = (50, 130, 40), (110, 110, 110), (20, 190, 230)  # BGR
GOAL = load_field().opponent_goal
WIDTH, BAR, THICK = GOAL.posts[0].y - GOAL.posts[1].y, 1.855, 0.11  # [m]
HEIGHT = 1.1  # [m] of the camera
LEVEL, DOWN = 0.05, 0.5  # [rad] tilts of the camera: with the bar of a goal 4 m away in the picture, and without


class Painting:
    """A picture of a carpet, to which posts and bars are added."""

    def __init__(self, tilt: float = LEVEL) -> None:
        c, s = math.cos(tilt), math.sin(tilt)
        self.pose = np.eye(4)
        self.pose[:3, :3] = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ OPTICAL_ROTATION
        self.pose[2, 3] = HEIGHT
        self.view = View(LENS, self.pose, SpreadParameters())
        self.picture = np.full((LENS.height, LENS.width, 3), GREY, dtype=np.uint8)
        v, u = np.mgrid[0 : LENS.height, 0 : LENS.width]
        ground = self.view.ground(self.view.directions_at(u.ravel(), v.ravel()))
        self.picture.reshape(-1, 3)[ground[:, 0] < 8.0] = GREEN

    def bar(self, start: tuple[float, float, float], end: tuple[float, float, float], colour=YELLOW) -> None:
        """Paint a round bar from one point to another in base_footprint [m]."""
        axis = np.linspace(start, end, 200)
        along = (np.array(end) - start) / np.linalg.norm(np.array(end) - start)
        sight = axis - self.view.position
        across = np.cross(sight, along)
        across *= 0.5 * THICK / np.linalg.norm(across, axis=1, keepdims=True)
        left, right = self.view.pixels(axis + across), self.view.pixels(axis - across)
        for index in range(len(axis) - 1):
            corners = np.array([left[index], left[index + 1], right[index + 1], right[index]])
            if np.isfinite(corners).all() and np.abs(corners).max() < 4000.0:
                cv2.fillConvexPoly(self.picture, np.rint(corners).astype(np.int32), colour)

    def post(self, x: float, y: float) -> None:
        self.bar((x, y, 0.0), (x, y, BAR))

    def goal(self, left: tuple[float, float], right: tuple[float, float]) -> None:
        self.post(*left)
        self.post(*right)
        self.bar((*left, BAR), (*right, BAR))

    def see(self) -> tuple[list[Feature], list[Feature]]:
        """Return the posts, from left to right, and the goals."""
        features = Vision(VisionParameters(), LENS).process(self.picture, 0, self.pose).features
        posts = [each for each in features if each.kind is FeatureClass.GOAL_POST]
        return sorted(posts, key=lambda each: -each.azimuth), [e for e in features if e.kind is FeatureClass.GOAL]


@pytest.mark.parametrize("turn", [-0.6, 0.0, 0.6])
@pytest.mark.parametrize("distance", [3.5, 5.0, 7.0])
def test_two_posts_under_a_bar_are_one_goal(distance: float, turn: float) -> None:
    painting = Painting()
    half = 0.5 * WIDTH * np.array([-math.sin(turn), math.cos(turn)])
    left, right = np.array([distance, 0.0]) + half, np.array([distance, 0.0]) - half
    painting.goal(tuple(left), tuple(right))
    posts, goals = painting.see()
    assert [post.side for post in posts] == [1, -1]
    assert len(goals) == 1
    goal = goals[0]
    assert (goal.azimuth, goal.elevation) == (posts[0].azimuth, posts[0].elevation)
    assert (goal.end_azimuth, goal.end_elevation) == (posts[1].azimuth, posts[1].elevation)
    rays = np.array([direction_of(goal.azimuth, goal.elevation), direction_of(goal.end_azimuth, goal.end_elevation)])
    assert painting.view.ground(rays) == pytest.approx(np.array([left, right]), abs=0.03 * distance)
    assert goal.confidence > 0.9


def test_bar_out_of_the_picture_leaves_the_width_to_pair_posts() -> None:
    painting = Painting(DOWN)
    painting.goal((3.0, 1.0), (3.0, 1.0 - WIDTH))
    posts, goals = painting.see()
    assert [post.side for post in posts] == [1, -1]
    assert len(goals) == 1
    assert goals[0].confidence < 0.8  # no bar confirms it


@pytest.mark.parametrize("width", [2.0, 3.4])
def test_posts_that_stand_too_near_or_far_are_no_goal(width: float) -> None:
    painting = Painting(DOWN)
    painting.goal((3.0, 0.5 * width), (3.0, -0.5 * width))
    posts, goals = painting.see()
    assert len(posts) == 2
    assert goals == []


def test_posts_a_width_apart_without_a_bar_where_it_should_be_are_no_goal() -> None:
    painting = Painting()
    painting.post(5.0, 0.5 * WIDTH)
    painting.post(5.0, -0.5 * WIDTH)
    posts, goals = painting.see()
    assert [post.side for post in posts] == [0, 0]
    assert goals == []


@pytest.mark.parametrize("side", [1, -1])
def test_lone_post_gets_its_side_from_where_the_bar_runs(side: int) -> None:
    painting = Painting()
    painting.post(4.0, side * 0.3)
    painting.bar((4.0, side * 0.3, BAR), (4.0, side * (0.3 - WIDTH), BAR))
    (post,), goals = painting.see()
    assert post.side == side
    assert goals == []


def test_hidden_foot_is_paired_by_the_bar_alone() -> None:
    painting = Painting()
    painting.goal((5.0, 0.5 * WIDTH), (5.0, -0.5 * WIDTH))
    foot = painting.view.pixels(np.array([[5.0, -0.5 * WIDTH, 0.0]]))[0]
    u, v = (round(float(each)) for each in foot)
    cv2.rectangle(painting.picture, (u - 60, v - 20), (u + 60, v + 30), GREY, -1)  # stands before it
    posts, goals = painting.see()
    assert [post.side for post in posts] == [1, -1]
    assert [math.isnan(post.elevation) for post in posts] == [False, True]
    assert len(goals) == 1
    assert math.isnan(goals[0].end_elevation)
    assert goals[0].end_azimuth == posts[1].azimuth
