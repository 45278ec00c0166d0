"""Odometry's covariance: how it grows, and that it is honest about the error against the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.planar import Pose2D
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import Side
from tulip_motion.odometry import DeadReckoning, StanceTwist
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench import odometry as bench

P = MotionParameters()
SECOND = 1_000_000_000
HEIGHT = 1.05


def begun() -> DeadReckoning:
    reckoning = DeadReckoning(P)
    reckoning.begin(0, np.zeros(2))
    return reckoning


def base(x: float, y: float) -> np.ndarray:
    return np.array([x, y, HEIGHT])


def test_heading_variance_grows_with_the_square_of_time_by_the_drift() -> None:
    reckoning = begun()
    short, long = (reckoning.pose_covariance(t * SECOND, base(0, 0), 0.0)[5, 5] for t in (100, 200))
    white = 2.0 * P.odometry_yaw_noise**2
    walk = P.odometry_yaw_walk**2 * 100
    assert short - white == pytest.approx(P.odometry_yaw_drift**2 * 100**2 + walk, rel=1e-9)
    assert long - white == pytest.approx(P.odometry_yaw_drift**2 * 200**2 + 2 * walk, rel=1e-9)


def test_covariance_is_that_of_walks_with_random_drift_and_slip() -> None:
    """Monte Carlo of the same model, carried out on poses instead of linearized: 2000 walks round a corner."""
    rng = np.random.default_rng(1)
    runs, dt = 2000, 2.0
    ways = [(0.3, 0.0)] * 20 + [(0.0, 0.3)] * 20
    reckoning = begun()
    x = np.zeros(2)
    errors = np.zeros((runs, 2))
    yaw = rng.normal(0.0, P.odometry_yaw_noise, runs)
    drift = rng.normal(0.0, P.odometry_yaw_drift, runs)
    for k, way in enumerate(ways):
        heading = 0.0 if k < 20 else math.pi / 2
        before = Pose2D(*x, heading)
        x = x + way
        # the base moves by way when both feet do
        reckoning.step(round((k + 1) * dt * SECOND), x, [before, before], [Pose2D(*x, heading)] * 2)
        middle = yaw + drift * dt / 2.0
        turned = np.column_stack([np.cos(middle) * way[0] - np.sin(middle) * way[1], 0 * middle])
        turned[:, 1] = np.sin(middle) * way[0] + np.cos(middle) * way[1]
        slip = rng.normal(0.0, (P.odometry_forward_slip * 0.3, 0.0), (runs, 2))
        slip += rng.normal(0.0, P.odometry_step_noise, (runs, 2))
        errors += turned - way + (slip if k < 20 else slip[:, ::-1])
        yaw += drift * dt + rng.normal(0.0, P.odometry_yaw_walk * math.sqrt(dt), runs)
    said = reckoning.pose_covariance(80 * SECOND, base(*x), 0.0)
    floor = 2.0 * (P.odometry_tilt_noise * HEIGHT) ** 2
    sample = np.cov(np.column_stack([errors, yaw]).T)
    expected = said[np.ix_((0, 1, 5), (0, 1, 5))] - np.diag([floor, floor, P.odometry_yaw_noise**2])
    deviations = np.sqrt(np.diag(sample))
    scale = np.outer(deviations, deviations)
    np.testing.assert_allclose(expected / scale, sample / scale, atol=0.12)  # 4 sigma of a variance of 2000 samples


@given(
    steps=st.lists(
        st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-0.6, 0.6), st.integers(1, 10**10)),
        max_size=30,
    ),
    lying=st.booleans(),
)
def test_covariance_is_symmetric_positive_definite_and_never_shrinks_in_the_plane(
    steps: list[tuple[float, float, float, int]], lying: bool
) -> None:
    reckoning, pose, stamp = begun(), Pose2D(), 0
    for dx, dy, turn, wait in steps:
        before, pose, stamp = pose, pose @ Pose2D(dx, dy, turn), stamp + wait
        reckoning.step(stamp, np.array([pose.x, pose.y]), [before, before], [pose, before])
    covariance = reckoning.pose_covariance(stamp, base(pose.x, pose.y), pose.yaw, lying)
    np.testing.assert_allclose(covariance, covariance.T, rtol=1e-9, atol=1e-18)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert covariance[5, 5] >= P.odometry_yaw_noise**2


def test_distance_is_the_way_of_the_point_between_the_feet() -> None:
    reckoning = begun()
    left, right = Pose2D(0.0, 0.12), Pose2D(0.0, -0.12)
    reckoning.step(SECOND, np.zeros(2), [left, right], [Pose2D(0.4, 0.12), right])
    reckoning.step(2 * SECOND, np.zeros(2), [left, right], [left, Pose2D(-0.2, -0.12)])
    assert reckoning.distance == pytest.approx(0.3)


def test_a_fall_makes_the_place_unsure_but_not_the_heading() -> None:
    reckoning = begun()
    before = reckoning.pose_covariance(SECOND, base(0, 0), 0.3)
    reckoning.fall()
    after = reckoning.pose_covariance(SECOND, base(0, 0), 0.3, lying=True)
    assert after[0, 0] - before[0, 0] == pytest.approx(P.odometry_fall_spread**2)
    assert after[5, 5] == before[5, 5]
    assert after[2, 2] == P.odometry_fall_spread**2


def test_a_twisting_sole_pivots_about_its_centre_of_pressure() -> None:
    twist = StanceTwist(P.control_period)
    anchor, pivot, turned = Pose2D(1.0, 0.5, 0.3), np.array([1.14, 0.54]), 0.1
    for share in np.linspace(0.0, 1.0, 40):
        twist.update(anchor, anchor.yaw + share * turned, pivot)
    for _ in range(40):  # the filter settles
        twist.update(anchor, anchor.yaw + turned, pivot)
    about = Pose2D(*pivot, turned) @ Pose2D(*(-pivot)) @ Pose2D(anchor.x, anchor.y)
    assert twist.twist == pytest.approx(turned, abs=1e-4)
    np.testing.assert_allclose(twist.shift, (about.x - anchor.x, about.y - anchor.y), atol=0.001)  # of second order
    before = twist.twist
    twist.update(anchor, anchor.yaw + turned, np.full(2, np.nan))  # no contact, no pivot
    assert math.isfinite(twist.shift[0]) and twist.twist == pytest.approx(before, abs=1e-4)


def test_feet_keep_their_places_to_each_other_when_a_twist_is_taken_off() -> None:
    twist = StanceTwist(P.control_period)
    twist.shift, twist.twist = (0.02, -0.01), 0.1
    stance, lifted = Footstep(Side.LEFT, Pose2D(0.0, 0.12)), Footstep(Side.RIGHT, Pose2D(0.0, -0.12))
    landed = Footstep(Side.RIGHT, Pose2D(0.32, -0.13))  # shift included
    left, right = twist.carried((stance, lifted), (stance, landed))
    assert right == landed
    assert left.pose.as_array() == pytest.approx([0.02, 0.11, 0.1])
    assert twist.carried((stance, lifted), (stance, lifted)) == (stance, lifted)


@pytest.mark.sim
def test_errors_against_the_truth_are_as_large_as_the_covariance_says() -> None:
    """Mean NEES of (x, y, yaw) over 20 random walks: inside the two-sided 95 % bounds of chi-square."""
    runs = 20
    looks = [bench.walk(100 + seed, 4.0, 2.0)[1] for seed in range(runs)]
    low, high = bench.bounds(runs)
    for time in range(2):
        values = [bench.nees(run[time][1], run[time][0]) for run in looks]
        assert low < np.mean(values) < high, f"look {time}: {values}"
