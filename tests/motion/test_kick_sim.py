"""Every kind of kick on the simulated body, and cancelling in every phase. Physics only, no helper forces."""

from __future__ import annotations

import math

import pytest

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.interface import KickGoal, KickKind, MotionMode, Side, WalkCommand, WalkMode
from tulip_sim.bench.body import Body
from tulip_strategy.parameters import StrategyParameters

pytestmark = pytest.mark.sim
WALK = (0.25, 0.0, 0.0)


def standing(ball: tuple[float, float], seed: int = 1) -> Body:
    body = Body(seed, Pose2D(-2.0, 0.0, 0.0), (-2.0 + ball[0], ball[1]))
    body.go(0.5)
    return body


def walking(ball: tuple[float, float], seed: int = 1) -> Body:
    """A robot that walks, and the ball at a place in its base_footprint."""
    body = Body(seed, Pose2D(-2.0, 0.0, 0.0))
    body.go(0.5)
    body.go(3.0, WALK)
    body.world.place_ball(*body.world.truth().footprint.transform(ball))
    return body


def direction_error(body: Body, wanted: float) -> float:
    """Degrees; the robot faced along x at the start."""
    return math.degrees(wrap_angle(body.ball_direction - wanted))


@pytest.mark.parametrize(("side", "direction"), [(Side.LEFT, -0.2), (Side.RIGHT, 0.1)])
def test_a_forward_kick_sends_the_ball_where_and_as_fast_as_wanted(side: Side, direction: float) -> None:
    ball = (0.36, 0.13 if side is Side.LEFT else -0.13)  # not where it is expected
    body = standing(ball)
    assert body.motion.start_kick(KickGoal(side, direction, 3.2, ball=ball)) == ""
    progress = body.motion.kick_progress
    assert progress is not None and progress.running
    body.go(4.0)
    assert body.motion.mode is MotionMode.STAND
    assert body.ball_speed == pytest.approx(3.2, rel=0.08)
    assert abs(direction_error(body, direction)) < 5.0
    progress = body.motion.kick_progress
    assert progress is not None
    assert (progress.running, progress.phase, progress.reason) == (False, 1.0, "")


def test_a_slow_forward_kick_sends_the_ball_slowly() -> None:
    body = standing((0.34, 0.12))
    assert body.motion.start_kick(KickGoal(Side.LEFT, 0.0, 1.5)) == ""
    body.go(4.5)
    assert body.motion.mode is MotionMode.STAND
    assert body.ball_speed == pytest.approx(1.5, rel=0.1)


@pytest.mark.parametrize("side", Side)
def test_a_side_kick_sends_the_ball_to_its_side(side: Side) -> None:
    outward = 1.0 if side is Side.LEFT else -1.0
    body = standing((0.5, 0.0))
    x, y = body.motion.expected_ball(KickKind.SIDE, side)
    body.world.place_ball(-2.0 + x, y)
    assert body.motion.start_kick(KickGoal(side, outward * 0.5 * math.pi, 1.7, KickKind.SIDE)) == ""
    body.go(4.5)
    assert body.motion.mode is MotionMode.STAND
    assert body.ball_speed > 1.5
    assert abs(direction_error(body, outward * 0.5 * math.pi)) < 5.0


@pytest.mark.parametrize("side", Side)
def test_strategy_lines_the_ball_up_where_a_forward_kick_expects_it(side: Side) -> None:
    strategy = StrategyParameters()
    outward = 1.0 if side is Side.LEFT else -1.0
    body = standing((2.0, 0.0))
    body.go(1.5, (0.0, 0.0, 0.0))  # the feet as a walk leaves them
    body.go(2.5)
    expected = body.motion.expected_ball(KickKind.FORWARD, side)
    assert expected == pytest.approx((strategy.kick_ahead, outward * strategy.kick_lateral), abs=0.01)


@pytest.mark.parametrize("side", Side)
def test_a_walking_kick_sends_the_ball_ahead_and_the_robot_walks_on(side: Side) -> None:
    ball = (0.7, 0.12 if side is Side.LEFT else -0.12)
    body = walking(ball)
    assert body.motion.start_kick(KickGoal(side, 0.0, 1.4, KickKind.WALKING, ball)) == ""
    phases = []
    for _ in range(40):
        body.go(0.1, WALK)
        assert body.motion.mode is MotionMode.WALK
        progress = body.motion.kick_progress
        assert progress is not None
        phases.append(progress.phase)
    assert (progress.running, progress.reason) == (False, "")
    assert phases == sorted(phases)
    assert any(0.0 < phase < 1.0 for phase in phases)
    assert body.ball_speed > 1.0
    assert abs(direction_error(body, 0.0)) < 8.0  # the heading at the start is known to some degrees
    body.go(3.0)
    assert body.motion.mode is MotionMode.STAND


# The weight is shifted until 0.8 s, the foot lifted and taken back until 1.15 s; it meets the ball at about 1.3 s, has
# slowed down at 1.45 s and stands at 2.2 s; the weight is back at 2.8 s.
@pytest.mark.parametrize("moment", [0.05, 0.79, 0.85, 1.0, 1.14, 1.25, 1.29, 1.32, 1.6, 2.5])
def test_a_forward_kick_can_be_cancelled_in_every_phase_and_the_robot_stands(moment: float) -> None:
    body = standing((0.34, 0.12))
    assert body.motion.start_kick(KickGoal(Side.LEFT, 0.0, 3.2)) == ""
    body.go(moment)
    assert body.motion.cancel_kick() == ""
    body.go(3.2)
    assert body.motion.mode is MotionMode.STAND
    assert body.greatest_tilt < 0.1
    progress = body.motion.kick_progress
    assert progress is not None
    assert (progress.running, progress.reason) == (False, "cancelled on request")
    if moment < 1.1:
        assert body.ball_speed < 0.1  # the ball was not struck
    assert body.motion.cancel_kick() == "no kick is under way"


@pytest.mark.parametrize("moment", [1.05, 1.25, 1.32])
def test_a_side_kick_can_be_cancelled_in_every_phase_and_the_robot_stands(moment: float) -> None:
    body = standing((0.112, -0.34))
    assert body.motion.start_kick(KickGoal(Side.RIGHT, -0.5 * math.pi, 1.7, KickKind.SIDE)) == ""
    body.go(moment)
    assert body.motion.cancel_kick() == ""
    body.go(3.2)
    assert body.motion.mode is MotionMode.STAND
    assert body.greatest_tilt < 0.1


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_a_walking_kick_can_be_cancelled_and_the_robot_walks_on(phase: float) -> None:
    body = walking((0.7, 0.12))
    assert body.motion.start_kick(KickGoal(Side.LEFT, 0.0, 1.4, KickKind.WALKING, (0.7, 0.12))) == ""
    for _ in range(1000):
        progress = body.motion.kick_progress
        assert progress is not None
        if progress.phase >= phase:
            break
        body.go(0.004, WALK)
    assert body.motion.cancel_kick() == ""
    body.go(3.0, WALK)
    assert body.motion.mode is MotionMode.WALK
    progress = body.motion.kick_progress
    assert progress is not None
    assert (progress.running, progress.reason) == (False, "cancelled on request")


def test_a_second_kick_is_refused_while_one_is_under_way() -> None:
    body = standing((0.34, 0.12))
    assert body.motion.start_kick(KickGoal(Side.LEFT)) == ""
    body.go(0.3)
    assert body.motion.start_kick(KickGoal(Side.LEFT)) == "another kick is under way"


def test_kicks_are_refused_in_the_wrong_mode() -> None:
    body = standing((0.34, 0.12))
    assert "a walking kick starts from WALK" in body.motion.start_kick(
        KickGoal(Side.LEFT, 0.0, 1.2, KickKind.WALKING, (0.6, 0.12))
    )
    body.go(1.5, WALK)
    assert "a forward kick starts from STAND" in body.motion.start_kick(KickGoal(Side.LEFT))
    assert "needs it" in body.motion.start_kick(KickGoal(Side.LEFT, 0.0, 1.2, KickKind.WALKING))
    refusal = body.motion.start_kick(KickGoal(Side.LEFT, 0.0, 1.2, KickKind.WALKING, (-0.5, 0.12)))
    assert "no left step of the next 8 reaches the ball" in refusal


def test_a_walking_kick_ends_with_a_reason_when_the_robot_is_told_to_stop() -> None:
    body = walking((1.2, 0.12))
    assert body.motion.start_kick(KickGoal(Side.LEFT, 0.0, 1.2, KickKind.WALKING, (1.2, 0.12))) == ""
    body.go(3.0)
    progress = body.motion.kick_progress
    assert progress is not None
    assert (progress.running, progress.reason) == (False, "the robot was told to stop walking")


def test_a_walking_kick_under_way_is_carried_out_although_the_robot_is_told_to_stop() -> None:
    body = walking((0.7, 0.12))
    assert body.motion.start_kick(KickGoal(Side.LEFT, 0.0, 1.4, KickKind.WALKING, (0.7, 0.12))) == ""
    for _ in range(1000):
        progress = body.motion.kick_progress
        if progress is None or progress.phase > 0.1:
            break
        body.go(0.004, WALK)
    body.go(3.0)
    progress = body.motion.kick_progress
    assert progress is not None
    assert (body.motion.mode, progress.running, progress.reason) == (MotionMode.STAND, False, "")
    assert body.ball_speed > 1.0


def test_a_kick_ends_with_the_reason_of_limpness() -> None:
    body = standing((0.34, 0.12))
    assert body.motion.start_kick(KickGoal(Side.LEFT)) == ""
    body.go(0.5)
    body.tick(WalkCommand(0, WalkMode.LIMP))
    progress = body.motion.kick_progress
    assert progress is not None
    assert (progress.running, progress.reason) == (False, "limp on request")
