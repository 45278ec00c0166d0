"""The swing foot when place and time of its landing change on the way, as step adjustment does."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tulip_description.planar import Pose2D
from tulip_motion.gait import FootMotion, SwingFoot
from tulip_motion.parameters import MotionParameters

P = MotionParameters()
DT = P.control_period
DURATION = P.step_time - P.double_support_time


def swing(changes: list[tuple[float, float, float, float]]) -> tuple[list[FootMotion], list[float]]:
    """Swing to landings that change at times [s]: (when, x [m], y [m], landing time [s]); follow the time as Walking.

    Returns:
        The foot at each tick, and the time that remained then [s].
    """
    foot = SwingFoot(Pose2D(0.0, 0.1), DURATION, P.swing_height, P.landing_speed)
    target, wanted, landing, time = Pose2D(0.1, 0.1), DURATION, DURATION, 0.0
    most = P.max_step_time_rate * DT
    motions, left = [], []
    while landing - time > DT:
        if landing - time > P.placement_freeze_time:
            for when, x, y, at in changes:
                if when <= time:
                    target, wanted = Pose2D(x, y), max(at, time + P.placement_freeze_time)
            landing += min(max(wanted - landing, -most), most)
        left.append(landing - time)
        motions.append(foot.advance(target, landing - time, DT))
        time += DT
    return motions, left


changes_of_landing = st.lists(
    st.tuples(st.floats(0.0, 0.3), st.floats(-0.2, 0.3), st.floats(0.0, 0.25), st.floats(0.08, 0.45)), max_size=4
).map(sorted)


@settings(max_examples=150)
@given(changes_of_landing)
def test_position_and_velocity_are_continuous_and_belong_together(
    changes: list[tuple[float, float, float, float]],
) -> None:
    motions, _ = swing(changes)
    for before, after in itertools.pairwise(motions):
        # Within a tick the jerk is constant: position and velocity are those of the integral of the acceleration.
        start, speed, acceleration = map(np.array, (before.position, before.velocity, before.acceleration))
        jerk = (after.acceleration - acceleration) / DT
        velocity = speed + DT * acceleration + DT**2 / 2.0 * jerk
        position = start + DT * speed + DT**2 / 2.0 * acceleration + DT**3 / 6.0 * jerk
        np.testing.assert_allclose(after.velocity, velocity, atol=1e-9)
        np.testing.assert_allclose(after.position, position, atol=1e-9)


@settings(max_examples=150)
@given(changes_of_landing)
def test_the_sole_is_never_below_the_ground_before_it_lands(changes: list[tuple[float, float, float, float]]) -> None:
    motions, _ = swing(changes)
    heights = np.array([motion.position[2] for motion in motions])
    assert heights.min() >= -1e-4  # the steps of one tick
    assert heights.max() <= 1.05 * P.swing_height


@settings(max_examples=150)
@given(changes_of_landing)
def test_it_arrives_at_the_last_target_at_rest(changes: list[tuple[float, float, float, float]]) -> None:
    motions, left = swing(changes)
    assert left[-1] > DT
    last = motions[-1]
    frozen = [motion for motion, remaining in zip(motions, left, strict=True) if remaining > P.placement_freeze_time]
    assert frozen
    assert abs(last.position[2]) < 2e-3
    assert np.abs(last.velocity[:2]).max() < 0.15 * max(np.abs(m.velocity[:2]).max() for m in motions) + 1e-9


def test_a_landing_brought_forward_comes_down_at_once_and_one_put_off_stays_up() -> None:
    usual, _ = swing([])
    early, _ = swing([(0.1, 0.1, 0.1, 0.2)])
    late, _ = swing([(0.1, 0.1, 0.1, 0.4)])
    assert len(early) < len(usual) < len(late)
    tick = round(0.16 / DT)
    assert early[tick].position[2] < usual[tick].position[2]
    tick = round(0.25 / DT)
    assert late[tick].position[2] > usual[tick].position[2]
