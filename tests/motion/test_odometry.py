"""Odometry's covariance: how it grows, and that it is honest about the error against the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.planar import Pose2D
from tulip_motion.ground_track import SlipSigns
from tulip_motion.odometry import DeadReckoning
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench import odometry as bench

P = MotionParameters()
SECOND = 1_000_000_000
HEIGHT = 1.05
NO_SLIP = SlipSigns(0.0, 0.0)


def begun() -> DeadReckoning:
    reckoning = DeadReckoning(P)
    reckoning.begin(0, (0.0, 0.0))
    return reckoning


def base(x: float, y: float) -> np.ndarray:
    return np.array([x, y, HEIGHT])


def test_heading_variance_grows_with_the_square_of_time_by_the_drift() -> None:
    reckoning = begun()
    short, long = (reckoning.pose_covariance(t * SECOND, base(0, 0), 0.0, NO_SLIP)[5, 5] for t in (100, 200))
    white = 2.0 * P.odometry_yaw_noise**2
    walk = P.odometry_yaw_walk**2 * 100
    assert short - white == pytest.approx(P.odometry_yaw_drift**2 * 100**2 + walk, rel=1e-9)
    assert long - white == pytest.approx(P.odometry_yaw_drift**2 * 200**2 + 2 * walk, rel=1e-9)


def test_covariance_is_that_of_walks_with_random_drift_and_slip() -> None:
    """Monte Carlo of the same model, carried out on poses instead of linearized: 2000 walks round a corner."""
    rng = np.random.default_rng(1)
    runs, dt, twist, flight = 2000, 2.0, 0.2, 0.004
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
        signs = SlipSigns((k + 1) * twist, (k + 1) * flight)
        # the base moves by way when both feet do
        reckoning.step(round((k + 1) * dt * SECOND), (x[0], x[1]), [before, before], [Pose2D(*x, heading)] * 2, signs)
        middle = yaw + drift * dt / 2.0
        turned = np.column_stack([np.cos(middle) * way[0] - np.sin(middle) * way[1], 0 * middle])
        turned[:, 1] = np.sin(middle) * way[0] + np.cos(middle) * way[1]
        slip = rng.normal(0.0, (P.odometry_twist_slip_along * twist, P.odometry_twist_slip_across * twist), (runs, 2))
        slip += rng.normal(0.0, math.hypot(P.odometry_step_noise, P.odometry_flight_slip * flight), (runs, 2))
        errors += turned - way + (slip if k < 20 else slip[:, ::-1])
        yaw += drift * dt + rng.normal(0.0, P.odometry_yaw_walk * math.sqrt(dt), runs)
    said = reckoning.pose_covariance(80 * SECOND, base(*x), 0.0, SlipSigns(40 * twist, 40 * flight))
    floor = 2.0 * (P.odometry_tilt_noise * HEIGHT) ** 2
    sample = np.cov(np.column_stack([errors, yaw]).T)
    expected = said[np.ix_((0, 1, 5), (0, 1, 5))] - np.diag([floor, floor, P.odometry_yaw_noise**2])
    deviations = np.sqrt(np.diag(sample))
    scale = np.outer(deviations, deviations)
    np.testing.assert_allclose(expected / scale, sample / scale, atol=0.12)  # 4 sigma of a variance of 2000 samples


def test_a_slip_counts_at_once_and_only_once() -> None:
    reckoning, signs = begun(), SlipSigns(0.1, 0.0)
    quiet = reckoning.pose_covariance(0, base(0, 0), 0.0, NO_SLIP)
    during = reckoning.pose_covariance(0, base(0, 0), math.pi / 2, signs)
    across, along = during[0, 0] - quiet[0, 0], during[1, 1] - quiet[1, 1]
    tilt = 2.0 * (P.odometry_tilt_bias * HEIGHT) ** 2  # of the quarter turn, between two of a lean of unknown direction
    assert across - tilt == pytest.approx((0.1 * P.odometry_twist_slip_across) ** 2, rel=1e-6)
    assert along - tilt == pytest.approx((0.1 * P.odometry_twist_slip_along) ** 2, rel=1e-6)
    left, right = Pose2D(0.0, 0.12), Pose2D(0.0, -0.12)
    reckoning.step(0, (0.0, 0.0), [left, right], [left, right], signs)
    after = reckoning.pose_covariance(0, base(0, 0), 0.0, signs)
    assert after[1, 1] - quiet[1, 1] == pytest.approx(
        (0.1 * P.odometry_twist_slip_across) ** 2 + P.odometry_step_noise**2
    )


def test_roll_and_pitch_grow_surer_while_the_tilt_is_learned() -> None:
    reckoning, feet = begun(), [Pose2D(0.0, 0.12), Pose2D(0.0, -0.12)]
    tilts = []
    for step in range(60):
        reckoning.step(round(0.4 * step * SECOND), (0.0, 0.0), feet, feet, NO_SLIP)
        tilts.append(reckoning.pose_covariance(round(0.4 * step * SECOND), base(0, 0), 0.0, NO_SLIP)[3, 3])
    assert tilts[0] == pytest.approx(P.odometry_tilt_bias**2 + P.odometry_tilt_noise**2)
    assert np.all(np.diff(tilts) <= 0.0)
    assert tilts[-1] == pytest.approx(P.odometry_tilt_noise**2, rel=0.01)


def test_a_heading_that_is_off_shortens_the_way() -> None:
    """Monte Carlo over drifts of six minutes straight on, when the shortening is more than all slips."""
    drift = np.random.default_rng(2).normal(0.0, P.odometry_yaw_drift, 20000)
    reckoning, x, truth, feet = begun(), 0.0, np.zeros(20000), [Pose2D(), Pose2D()]
    for step in range(1, 361):
        x += 0.5
        truth += 0.5 * np.cos(drift * (step - 0.5))
        reckoning.step(step * SECOND, (x, 0.0), feet, feet, NO_SLIP)
    said = reckoning.pose_covariance(360 * SECOND, base(x, 0.0), 0.0, NO_SLIP)
    assert said[0, 0] == pytest.approx(np.mean((truth - x) ** 2), rel=0.1)  # white noise and higher orders


@given(
    steps=st.lists(
        st.tuples(
            st.floats(-0.4, 0.4),
            st.floats(-0.4, 0.4),
            st.floats(-0.6, 0.6),
            st.integers(1, 10**10),
            st.floats(0.0, 0.5),
        ),
        max_size=30,
    ),
    lying=st.booleans(),
)
def test_covariance_is_symmetric_positive_definite_and_never_shrinks_in_the_plane(
    steps: list[tuple[float, float, float, int, float]], lying: bool
) -> None:
    reckoning, pose, stamp, twist = begun(), Pose2D(), 0, 0.0
    for dx, dy, turn, wait, more in steps:
        before, pose, stamp, twist = pose, pose @ Pose2D(dx, dy, turn), stamp + wait, twist + more
        reckoning.step(stamp, (pose.x, pose.y), [before, before], [pose, before], SlipSigns(twist, 0.0))
    covariance = reckoning.pose_covariance(stamp, base(pose.x, pose.y), pose.yaw, SlipSigns(twist, 0.1), lying)
    np.testing.assert_allclose(covariance, covariance.T, rtol=1e-9, atol=1e-18)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert covariance[5, 5] >= P.odometry_yaw_noise**2


def test_distance_is_the_way_of_the_point_between_the_feet() -> None:
    reckoning = begun()
    left, right = Pose2D(0.0, 0.12), Pose2D(0.0, -0.12)
    reckoning.step(SECOND, (0.0, 0.0), [left, right], [Pose2D(0.4, 0.12), right], NO_SLIP)
    reckoning.step(2 * SECOND, (0.0, 0.0), [left, right], [left, Pose2D(-0.2, -0.12)], NO_SLIP)
    assert reckoning.distance == pytest.approx(0.3)


def test_a_fall_makes_the_place_unsure_but_not_the_heading() -> None:
    reckoning = begun()
    before = reckoning.pose_covariance(SECOND, base(0, 0), 0.3, NO_SLIP)
    reckoning.fall()
    after = reckoning.pose_covariance(SECOND, base(0, 0), 0.3, NO_SLIP, lying=True)
    assert after[0, 0] - before[0, 0] == pytest.approx(P.odometry_fall_spread**2)
    assert after[5, 5] == before[5, 5]
    assert after[2, 2] == P.odometry_fall_spread**2


@pytest.mark.sim
def test_errors_against_the_truth_are_as_large_as_the_covariance_says() -> None:
    """Mean NEES of (x, y, yaw) over 20 random walks: inside the two-sided 95 % bounds of chi-square."""
    runs = 20
    looks = [bench.walk(100 + seed, 4.0, 2.0)[1] for seed in range(runs)]
    low, high = bench.bounds(runs)
    for time in range(2):
        values = [bench.nees(run[time][1], run[time][0]) for run in looks]
        assert low < np.mean(values) < high, f"look {time}: {values}"
