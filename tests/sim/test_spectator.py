"""The spectator's camera: where it looks, and what is in its picture."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_sim.keeper import Keeper
from tulip_sim.scenario import Scenario
from tulip_sim.spectator import VIEW_ANGLE, Spectator, behind, look_at, pinhole
from tulip_sim.truth import Truth
from tulip_sim.world import World

FIELD, ROBOT = load_field(), load_robot()
SIZE = (320, 160)
LENS = pinhole(*SIZE, VIEW_ANGLE)


def _pixels(camera: np.ndarray, points: np.ndarray) -> np.ndarray:
    return LENS.project((points - camera[:3, 3]) @ camera[:3, :3])


@pytest.fixture(scope="module")
def truth() -> Truth:
    keeper = Keeper(Pose2D(4.2, -0.4, math.pi))
    world = World(Scenario(Pose2D(1.0, 0.0, 0.0), (1.6, 0.0), keeper), seed=0)
    return world.truth()


@pytest.fixture(scope="module")
def spectator() -> Spectator:
    return Spectator(FIELD, ROBOT, *SIZE)


def test_pinhole_sees_the_stated_angle() -> None:
    assert LENS.field_of_view[0] == pytest.approx(VIEW_ANGLE)
    with pytest.raises(ValueError, match=r"view_angle is 3\.5 rad"):
        pinhole(*SIZE, 3.5)


@pytest.mark.parametrize("target", [(1.0, 0.0, 0.5), (-3.0, 2.0, 0.0), (0.0, -4.0, 3.0)])
def test_the_target_is_in_the_middle_and_what_is_above_it_is_above(target: tuple[float, float, float]) -> None:
    camera = look_at((0.5, 0.5, 1.2), target)
    np.testing.assert_allclose(camera[:3, :3] @ camera[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(camera[:3, :3]) == pytest.approx(1.0)
    middle, above = _pixels(camera, np.array([target, (*target[:2], target[2] + 0.1)]))
    np.testing.assert_allclose(middle, [(SIZE[0] - 1) / 2.0, (SIZE[1] - 1) / 2.0], atol=1e-6)
    assert above[0] == pytest.approx(middle[0])
    assert above[1] < middle[1]


def test_a_target_straight_below_is_refused() -> None:
    with pytest.raises(ValueError, match="apart in x or y"):
        look_at((1.0, 2.0, 3.0), (1.0, 2.0, 0.0))


@pytest.mark.parametrize("robot", [Pose2D(1.0, 0.0, 0.0), Pose2D(0.3, 1.0, 0.2), Pose2D(1.5, -1.0, -0.3)])
def test_robot_ball_and_goal_fit_into_the_picture_from_behind(robot: Pose2D) -> None:
    posts = [(post.x, post.y, z) for post in FIELD.opponent_goal.posts for z in (0.0, post.height)]
    body = [(robot.x, robot.y, 0.0), (robot.x, robot.y, 1.25)]
    pixels = _pixels(behind(robot, FIELD.opponent_goal), np.array([*posts, *body]))
    assert np.isfinite(pixels).all()
    assert (pixels[:, 0] > 0).all() and (pixels[:, 0] < SIZE[0]).all()
    assert (pixels[4:, 1] > 0).all() and (pixels[:, 1] < SIZE[1]).all()  # the bar may touch the upper edge
    assert pixels[4, 0] < pixels[:4, 0].min()  # the robot does not hide the goal


def test_the_whole_robot_ball_and_keeper_are_drawn(spectator: Spectator, truth: Truth) -> None:
    picture = spectator.render(truth, behind(Pose2D(1.0, 0.0, 0.0), FIELD.opponent_goal)).astype(int)
    assert picture.shape == (*SIZE[::-1], 3)
    blue, green, red = picture[..., 0], picture[..., 1], picture[..., 2]
    orange = (red > 150) & (blue < 80) & (green < 140)
    cyan = (blue > red + 60) & (green > red + 40)
    magenta = (red > green + 50) & (blue > green + 50)
    for name, mask in (("ball", orange), ("marker", cyan), ("keeper", magenta)):
        assert mask.sum() > 20, name
    marker, ball, keeper = (np.argwhere(mask).mean(axis=0) for mask in (cyan, orange, magenta))
    assert ball[0] > keeper[0] > 0  # nearer things stand lower
    assert marker[1] < ball[1]  # the ball is ahead, to the right in the picture


def test_the_head_is_drawn_although_the_head_camera_does_not_see_it(
    spectator: Spectator, truth: Truth, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera = look_at(truth.base_position + np.array([-1.0, 0.0, 0.1]), truth.base_position + np.array([0.1, 0.0, 0.03]))
    picture = spectator.render(truth, camera).astype(int)
    monkeypatch.setattr("tulip_sim.spectator.HIDDEN", ("neck", "head"))
    headless = Spectator(FIELD, ROBOT, *SIZE).render(truth, camera).astype(int)
    changed = np.abs(picture - headless).max(axis=2) > 5
    focal = float(LENS.camera_matrix[0, 0])
    assert changed.sum() == pytest.approx(0.14 * 0.12 * focal**2 / 1.1**2, rel=0.3)  # [px] of the head from behind
    assert changed[SIZE[1] // 2, SIZE[0] // 2]


def test_the_same_truth_gives_the_same_picture(spectator: Spectator, truth: Truth) -> None:
    camera = behind(Pose2D(1.0, 0.0, 0.0), FIELD.opponent_goal)
    assert np.array_equal(spectator.render(truth, camera), spectator.render(truth, camera))
