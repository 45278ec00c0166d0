"""Falling on the simulated body: recognized early, limp, set upright by the referee's hands, walking again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_motion.interface import KickGoal, MotionMode, Side, WalkCommand, WalkMode
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench.body import Body

pytestmark = pytest.mark.sim
START = Pose2D(0.0, 40.0, 0.4)
STAND = WalkCommand(0, WalkMode.STAND)
BEFORE_TOE = 0.217 + 0.095 + 0.03  # [m] a ball's centre ahead of base_footprint: toe, radius, and what is free between


def tilt_of(body: Body) -> float:
    x, y = body.world.truth().base_orientation[:2].tolist()
    return math.acos(min(1.0, 1.0 - 2.0 * (x * x + y * y)))


def limp(body: Body, seconds: float) -> None:
    """Let time pass for a robot that has fallen."""
    for _ in range(round(seconds / 0.004)):
        body.tick(STAND)


@pytest.mark.parametrize("seed", range(3))
def test_after_a_fall_and_the_referees_hands_the_robot_stands_and_walks_again(seed: int) -> None:
    rng = np.random.default_rng([seed, 1])
    body = Body(seed, START, ball=(0.0, 0.0))
    body.go(0.3)
    body.go(2.0, (0.3, 0.0, 0.0))
    before = body.motion.odometry()
    direction = rng.uniform(-math.pi, math.pi)
    body.world.push([350.0 * math.cos(direction), 350.0 * math.sin(direction), 0.0], 100)
    body.go(3.0, (0.3, 0.0, 0.0))
    assert body.motion.mode is MotionMode.FALLEN
    assert body.motion.state().reason.startswith("falls: the torso leans")
    assert tilt_of(body) < 0.6  # it was told before the robot lay

    limp(body, 2.0)
    assert body.motion.mode is MotionMode.FALLEN
    assert body.world.truth().base_position[2] < 0.8
    command = body.motion.tick(body.world.sensors())
    assert not command.stiffness.any() and not command.effort.any() and command.damping.all()
    lying = body.motion.odometry()
    assert lying.covariance[0, 0] > before.covariance[0, 0] + 0.2

    steps = body.motion.state().step_count
    body.world.set_upright()
    limp(body, 1.0)
    assert body.motion.mode is MotionMode.STAND
    assert body.motion.state().reason == ""
    start, counted = body.world.truth().base_position[:2], body.motion.odometry()
    body.go(5.0, (0.3, 0.0, 0.0))
    assert body.motion.mode is MotionMode.WALK
    way = float(np.linalg.norm(body.world.truth().base_position[:2] - start))
    assert way > 1.0
    assert body.motion.state().step_count > steps
    after = body.motion.odometry()
    assert float(np.linalg.norm(after.position[:2] - counted.position[:2])) == pytest.approx(way, abs=0.03)
    assert after.distance > before.distance + 1.0


@pytest.mark.parametrize("seed", range(3))
def test_no_false_alarm_in_survived_pushes_fast_walking_and_kicks(seed: int) -> None:
    rng = np.random.default_rng([seed, 2])
    ball = (BEFORE_TOE, 40.0 + 0.5 * MotionParameters().stance_width) if seed == 0 else (0.0, 0.0)
    body = Body(seed, Pose2D(0.0, 40.0, 0.0), ball)
    body.go(0.5)
    if seed == 0:
        assert body.motion.start_kick(KickGoal(Side.LEFT, speed=3.0)) == ""
        body.go(4.0)
    for _ in range(2):
        direction = rng.uniform(-math.pi, math.pi)
        body.world.push([50.0 * math.cos(direction), 50.0 * math.sin(direction), 0.0], 100)
        body.go(1.5, (0.2, 0.0, 0.0))
    body.go(3.0, (0.6, 0.0, 0.0))
    assert not body.fallen, body.motion.state().reason


def test_a_robot_that_falls_while_limp_on_request_says_so() -> None:
    body = Body(0, START, ball=(0.0, 0.0))
    body.go(0.3)
    body.world.push([200.0, 0.0, 0.0], 100)
    for _ in range(500):
        body.tick(WalkCommand(0, WalkMode.LIMP))
    assert body.motion.mode is MotionMode.FALLEN
    assert body.motion.state().reason == "limp on request; then it fell"


@pytest.mark.parametrize("gait", ["dcm", "paper"])
def test_steps_are_counted_on_after_a_fall(gait: str) -> None:
    body = Body(0, START, ball=(0.0, 0.0), parameters=MotionParameters(gait=gait))
    body.go(0.3)
    body.go(3.0, (0.2, 0.0, 0.0))
    body.world.push([0.0, 400.0, 0.0], 100)
    body.go(3.0, (0.2, 0.0, 0.0))
    assert body.motion.mode is MotionMode.FALLEN
    before = body.motion.state().step_count
    assert before >= 4
    body.world.set_upright()
    limp(body, 1.0)
    assert body.motion.mode is MotionMode.STAND
    assert body.motion.state().step_count == before
    body.go(2.0, (0.2, 0.0, 0.0))
    assert body.motion.state().step_count > before
