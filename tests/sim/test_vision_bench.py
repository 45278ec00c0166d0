from __future__ import annotations

import math
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_sim.bench.vision_goals import GoalCounts, count_goals
from tulip_sim.bench.vision_score import Judge, Sighting
from tulip_sim.bench.vision_shots import Shot, shots, true_camera_pose, vision_of
from tulip_sim.bench.vision_tables import figures
from tulip_sim.bench.vision_truth import Hiding, Thing, line_distances
from tulip_sim.scene import Body, Boxes, scene_of
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_vision.lens import head_camera_lens
from tulip_vision.own_body import OwnBody
from tulip_vision.view import SpreadParameters, View

FIELD, ROBOT, LENS = load_field(), load_robot(), head_camera_lens()


@pytest.fixture(scope="module")
def taken() -> list[Shot]:
    return list(islice(shots(101), 6))


def test_a_box_hides_what_is_behind_it_and_not_what_is_beside_or_before_it() -> None:
    hiding = Hiding(np.array([0.0, 0.0, 1.0]))
    transform = np.eye(4)[None].copy()
    transform[0, :3, 3] = (2.0, 0.0, 0.5)
    hiding.add_boxes("box", Boxes(transform, np.array([[0.2, 0.6, 1.0]]), np.zeros((1, 3))))
    points = np.array([[4.0, 0.0, 0.0], [4.0, 1.5, 0.0], [1.0, 0.0, 0.0], [4.0, 0.0, 1.6]])
    assert hiding.hides(points, "").tolist() == [True, False, False, False]
    assert not hiding.hides(points, "box").any()


def test_an_upright_cylinder_hides_what_is_behind_it_up_to_its_height() -> None:
    hiding = Hiding(np.array([0.0, 0.0, 1.0]))
    hiding.add_cylinder("post", np.array([2.0, 0.0]), 0.1, 0.8)
    points = np.array([[4.0, 0.0, 0.0], [4.0, 0.5, 0.0], [4.0, 0.0, 0.9]])
    assert hiding.hides(points, "").tolist() == [True, False, False]


def test_distances_to_lines_are_those_to_the_nearest_line_or_to_the_circle() -> None:
    points = np.array([[0.05, 2.0], [0.75, 0.0], [2.0, FIELD.width / 2 - 0.1], [2.0, 1.0]])
    np.testing.assert_allclose(line_distances(points, FIELD)[:3], [0.05, 0.0, 0.1], atol=1e-12)
    assert line_distances(points, FIELD)[3] > 0.5


def test_a_sighting_survives_its_text() -> None:
    sighting = Sighting("post", "GOAL_POST", 3, "walk", "whole", 4.25, True, 0.001, -0.002, 0.0, math.nan, 0.01, 0.02)
    back = Sighting.from_text(sighting.to_text())
    assert (back.name, back.picture, back.found, back.azimuth) == ("post", 3, True, 0.001)
    assert math.isnan(back.own_elevation)
    assert math.isnan(back.range_error)


def test_the_same_seed_takes_the_same_pictures(taken: list[Shot]) -> None:
    again = next(iter(shots(101)))
    np.testing.assert_array_equal(again.picture, taken[0].picture)
    np.testing.assert_array_equal(again.believed, taken[0].believed)


def test_the_robots_camera_pose_errs_a_little_and_the_walking_robots_pictures_are_blurred(taken: list[Shot]) -> None:
    angles = []
    for shot in taken:
        np.testing.assert_array_equal(shot.true, true_camera_pose(shot.truth, ROBOT))
        turn = shot.believed[:3, :3].T @ shot.true[:3, :3]
        angles.append(math.degrees(math.acos(min((np.trace(turn) - 1.0) / 2.0, 1.0))))
    assert 0.001 < min(angles)  # the truth would err by nothing
    assert max(angles) < 1.5  # deg
    assert [shot.movement for shot in taken] == ["stand"] * 4 + ["walk"] * 2


def test_features_at_the_true_places_have_no_error_and_others_are_false(taken: list[Shot]) -> None:
    judge = Judge(LENS, FIELD, ROBOT)
    shot = next(shot for shot in taken if vision_of(shot).process(shot.picture, 0, shot.true).features)
    exact = replace(shot, believed=shot.true)
    features = vision_of(shot).process(shot.picture, shot.stamp, shot.true)
    right = [each for each in judge.sightings(exact, 0, features) if each.found and each.state != "false"]
    assert right
    assert all(each.azimuth == pytest.approx(each.own_azimuth, abs=1e-6) for each in right)
    marks = [each for each in features.features if each.kind != FeatureClass.LINE]
    turned = Features(
        0, features.camera_position, features.view, tuple(replace(each, azimuth=each.azimuth + 0.5) for each in marks)
    )
    assert sum(each.state == "false" for each in judge.sightings(exact, 0, turned)) >= 0.8 * len(marks)


def test_the_bars_count_what_was_missed_and_what_is_false() -> None:
    seen = Sighting("ball", "BALL", 0, "stand", "whole", 3.0, True, 0.001, 0.001, 0.0, 0.0, 0.01, 0.01, 0.02)
    missed = Sighting("ball", "BALL", 1, "stand", "whole", 3.0, False)
    false = Sighting("ball", "BALL", 2, "stand", "false", math.nan, True)
    texts = [each.to_text() for each in (seen, missed, false)]
    lines = {"line points, believed": [9, 9, 9, 9], "line points, own": [9, 9, 9, 9]}
    goals = vars(GoalCounts(there=4, paired=3, false=1, posts=9, sided=7, wrong=0))
    row = {"pictures": 3, "sightings": texts, **lines, "goals": goals}
    table = {what: (value, reached) for what, _, value, reached in figures([row])}
    assert table["ball, to 6 m"] == ("0.500 (1 of 2)", False)
    assert table["false balls"] == ("1 in 3 pictures", False)
    assert table["ball, range under 4.5 m"][1]
    assert table["goals: the two posts of one paired, to 9 m"] == ("0.750 (3 of 4); 1 false", False)
    assert table["posts: left or right one of its goal"] == ("7 of 9 have one; 0 wrong", True)


def test_goals_and_sides_are_compared_with_where_the_posts_stand() -> None:
    feet = np.array([[-6.0, 1.4, 0.0], [-6.0, -1.4, 0.0], [4.0, 1.4, 0.0], [4.0, -1.4, 0.0]])
    posts = [Thing((FeatureClass.GOAL_POST,), foot, math.hypot(*foot[:2]), foot[0] > 0.0) for foot in feet]
    left, right = math.atan2(1.4, 4.0), math.atan2(-1.4, 4.0)

    def goal(first: float, second: float) -> Feature:
        return Feature(FeatureClass.GOAL, first, -0.25, 0.01, 0.01, 1.0, second, -0.25)

    def post(azimuth: float, side: int) -> Feature:
        return Feature(FeatureClass.GOAL_POST, azimuth, -0.25, 0.01, 0.01, 1.0, side=side)

    def count(*features: Feature) -> GoalCounts:
        return count_goals(features, posts, np.array([0.0, 0.0, 1.1]))

    assert count(goal(left, right), post(left, 1), post(right, -1)) == GoalCounts(1, 1, 0, 2, 2, 0)
    assert count(goal(right, left)) == GoalCounts(1, 0, 1)  # left and right mixed up
    assert count(goal(left, right - 0.3)) == GoalCounts(1, 0, 1)
    assert count(post(left, -1), post(right, 0)) == GoalCounts(1, 0, 0, 2, 1, 1)
    behind = post(math.pi - math.atan2(1.4, 6.0), -1)  # seen from between the goals, +y is on the right there
    assert count(behind) == GoalCounts(1, 0, 0, 1, 1, 0)


def test_the_own_body_is_where_the_renderer_draws_it(taken: list[Shot]) -> None:
    """The boxes' places by vision, with the trunk taken as upright, against those of the true posture."""
    own, body = OwnBody(ROBOT), Body(ROBOT, "cyan", unseen=("neck", "head"))
    shown, agreed = 0, 0
    for shot in taken:
        view = View(LENS, shot.believed, SpreadParameters())
        mask = own.mask(view)
        scene, links = scene_of(replace(shot.truth, keeper=None), body, "cyan")
        camera = body.camera_in_map(links)
        arms = [number for number, name in enumerate(body._links) if name in ("left_arm", "right_arm")]
        for centre in scene.boxes.transforms[arms][:, :3, 3]:
            pixel = LENS.project(((centre - camera[:3, 3]) @ camera[:3, :3])[None])
            if view.inside(pixel, 2.0)[0]:
                shown += 1
                agreed += mask[round(float(pixel[0, 1])), round(float(pixel[0, 0]))] != 0
    assert shown > 0
    assert agreed == shown


def test_nobody_is_looked_for_on_the_own_body_when_the_head_looks_straight_ahead() -> None:
    pose = true_camera_pose(next(iter(shots(101))).truth, ROBOT)
    level = pose.copy()
    level[:3, :3] = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    assert not OwnBody(ROBOT).mask(View(LENS, level, SpreadParameters()))[: LENS.height // 2].any()


def test_robots_stand_on_the_field_and_see_it(taken: list[Shot]) -> None:
    for shot in taken:
        footprint: Pose2D = shot.truth.footprint
        assert abs(footprint.x) < FIELD.carpet_length / 2
        assert abs(footprint.y) < FIELD.carpet_width / 2
    assert len({shot.truth.footprint for shot in taken}) == len(taken)
