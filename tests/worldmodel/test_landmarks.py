from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tulip_description.field import LineSegment, load_field
from tulip_vision.features import Feature, FeatureClass
from tulip_worldmodel.direction import directions, half_turn, meet_plane, rays
from tulip_worldmodel.landmark_geometry import line_misfits, piece_on_ground, point_directions
from tulip_worldmodel.landmarks import (
    Lines,
    PointObservation,
    has_side,
    landmarks_of,
    lines_of,
)

CAMERA = np.array([0.05, 0.02, 1.15])
STEP = 1e-6

states = st.tuples(
    st.floats(-4.0, 4.0),
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
).map(np.array)


def numeric(function, at: np.ndarray) -> np.ndarray:
    """Return the central-difference Jacobian of a function that returns (m,)."""
    columns = []
    for index in range(len(at)):
        step = np.zeros_like(at)
        step[index] = STEP
        columns.append((function(at + step) - function(at - step)) / (2.0 * STEP))
    return np.stack(columns, axis=-1)


def misfits_of(state: np.ndarray, ends: np.ndarray, lines: Lines) -> tuple[np.ndarray, ...]:
    return line_misfits(state, ends, CAMERA, lines.directions, lines.starts)


@settings(max_examples=60)
@given(state=states, place=st.tuples(st.floats(-5.0, 5.0), st.floats(-4.0, 4.0)))
def test_jacobian_of_point_directions_agrees_with_finite_differences(state, place) -> None:
    points = np.array([place])
    if math.dist(place, state[:2]) < 0.5:
        return  # nearly below the camera the azimuth has no meaning
    angles, jacobian = point_directions(state, points, CAMERA)
    if abs(angles[0, 0]) > 3.13:
        return  # the azimuth's wrap is not differentiable
    expected = numeric(lambda x: point_directions(x, points, CAMERA)[0][0], state)
    assert np.allclose(jacobian[0], expected, rtol=1e-5, atol=1e-6)


@settings(max_examples=60)
@given(
    state=states,
    ends=st.tuples(st.floats(-2.0, 2.0), st.floats(-1.2, -0.2), st.floats(0.1, 1.0), st.floats(-1.2, -0.2)),
)
def test_jacobians_of_line_misfit_agree_with_finite_differences(state, ends) -> None:
    azimuth, elevation, width, end_elevation = ends
    seen = np.array([[azimuth, elevation], [azimuth + width, end_elevation]])
    lines = lines_of([LineSegment((1.0, -2.0), (-2.0, 1.0)), LineSegment((3.0, -2.0), (3.0, 2.0))])
    misfits, by_state, by_angles, _ = misfits_of(state, seen, lines)
    expected_by_state = numeric(lambda x: misfits_of(x, seen, lines)[0], state)
    expected_by_angles = numeric(lambda z: misfits_of(state, z.reshape(2, 2), lines)[0], seen.ravel())
    for line in range(2):
        if abs(misfits[line, 0]) > 1.56:
            continue  # the direction's wrap is not differentiable
        assert np.allclose(by_state[line], expected_by_state[line], rtol=1e-4, atol=1e-5)
        assert np.allclose(by_angles[line], expected_by_angles[line], rtol=1e-4, atol=1e-4)


@given(azimuth=st.floats(-3.1, 3.1), elevation=st.floats(-1.4, -0.1), height=st.floats(0.0, 0.2))
def test_ray_that_meets_a_plane_comes_from_the_direction_of_the_meeting_point(azimuth, elevation, height) -> None:
    unit, _ = rays(np.array([[azimuth, elevation]]))
    points, _ = meet_plane(unit, CAMERA, height)
    angles, _ = directions(np.array([[*(points[0] - CAMERA[:2]), height - CAMERA[2]]]))
    assert angles[0] == pytest.approx([azimuth, elevation], abs=1e-9)


def test_jacobian_of_rays_on_a_plane_agrees_with_finite_differences() -> None:
    angles = np.array([0.4, -0.6])
    unit, by_angles = rays(angles[None])
    _, by_ray = meet_plane(unit, CAMERA, 0.09)
    expected = numeric(lambda a: meet_plane(rays(a[None])[0], CAMERA, 0.09)[0][0], angles)
    assert np.allclose(by_ray[0] @ by_angles[0], expected, rtol=1e-6)


def test_piece_on_the_line_has_no_misfit_in_either_order_of_its_ends() -> None:
    lines = lines_of([LineSegment((2.0, -2.0), (2.0, 2.0))])
    state = np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0])
    seen, _ = point_directions(state, np.array([[2.0, -1.0], [2.0, 1.5]]), CAMERA)
    for ends in (seen, seen[::-1]):
        misfits, _, _, along = misfits_of(state, ends.copy(), lines)
        assert misfits[0] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert sorted(along[0]) == pytest.approx([1.0, 3.5])


def test_seen_points_on_the_ground_are_where_a_tilted_camera_sees_them() -> None:
    state = np.array([0.0, 0.0, 0.0, 0.02, -0.03, 0.01, 0.0])  # base_footprint is map
    places = np.array([[2.0, -1.0], [3.0, 1.5]])
    seen, _ = point_directions(state, places, CAMERA)
    # To turn there by v + w x v and back by v - w x v misses by the square of w: 1.4e-3 of some 3 m.
    assert piece_on_ground(state, seen, CAMERA)[0] == pytest.approx(places, abs=0.02)
    assert abs(piece_on_ground(np.zeros(7), seen, CAMERA)[0] - places).max() > 0.1


@given(st.floats(-20.0, 20.0))
def test_half_turn_keeps_an_undirected_line(angle: float) -> None:
    wrapped = half_turn(np.array([angle]))[0]
    assert -math.pi / 2.0 <= wrapped <= math.pi / 2.0
    assert math.sin(wrapped - angle) == pytest.approx(0.0, abs=1e-9)


def test_field_gives_its_landmarks_by_class() -> None:
    points = landmarks_of(load_field()).points
    counts = {kind: len(places) for kind, places in points.items()}
    assert counts == {
        FeatureClass.GOAL_POST: 4,
        FeatureClass.PENALTY_MARK: 2,
        FeatureClass.CENTRE_CIRCLE: 1,
        FeatureClass.CROSSING_L: 8,
        FeatureClass.CROSSING_T: 6,
        FeatureClass.CROSSING_X: 2,
        FeatureClass.POLE_YELLOW_BLUE_YELLOW: 1,
        FeatureClass.POLE_BLUE_YELLOW_BLUE: 1,
    }
    assert points[FeatureClass.POLE_YELLOW_BLUE_YELLOW][0, 1] > 0.0


def test_field_without_poles_has_no_pole_landmarks() -> None:
    points = landmarks_of(load_field().without_poles()).points
    assert points[FeatureClass.POLE_YELLOW_BLUE_YELLOW].shape == (0, 2)


@pytest.mark.parametrize("place", [(0.0, 0.0), (-3.0, 2.0), (4.0, -2.5)])
@pytest.mark.parametrize("side", [1, -1])
def test_post_with_a_side_is_one_of_two_from_between_the_goal_lines(place, side) -> None:
    landmarks = landmarks_of(load_field())
    post = Feature(FeatureClass.GOAL_POST, 0.0, -0.2, 0.01, 0.01, 1.0, side=side)
    expected = {(4.5, side * 1.355), (-4.5, side * -1.355)}  # the left one is at +y where x points to the goal
    assert {tuple(each) for each in landmarks.of(post)} == expected
    observation = PointObservation(post, landmarks.points[FeatureClass.GOAL_POST], CAMERA, 0.0, landmarks.mates)
    possible = observation.possible(np.array([*place, 0.7, 0.0, 0.0, 0.0, 0.0]))
    assert {tuple(each) for each in landmarks.points[FeatureClass.GOAL_POST][possible]} == expected


def test_from_behind_the_goal_line_left_and_right_change_places() -> None:
    landmarks = landmarks_of(load_field())
    posts = landmarks.points[FeatureClass.GOAL_POST]
    left = posts[has_side(np.array([5.0, 0.0]), posts, landmarks.mates, 1)]
    assert {tuple(each) for each in left} == {(4.5, -1.355), (-4.5, -1.355)}


def test_post_without_a_side_may_be_any() -> None:
    landmarks = landmarks_of(load_field())
    post = Feature(FeatureClass.GOAL_POST, 0.0, -0.2, 0.01, 0.01, 1.0)
    observation = PointObservation(post, landmarks.of(post), CAMERA, 0.0, landmarks.mates)
    assert len(observation.possible(np.zeros(7))) == 4
