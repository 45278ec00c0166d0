"""Pushes that a robot survives by stepping, standing and walking, on the simulated body."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.footsteps import Footstep, foot_beside
from tulip_motion.interface import MotionMode, Side
from tulip_motion.parameters import MotionParameters
from tulip_motion.stabilizer import SupportArea
from tulip_motion.walking import must_step
from tulip_sim.bench.body import Body

P = MotionParameters()
START = Pose2D(0.0, 40.0, 0.0)  # off the field, where nothing is in the way
DIRECTIONS = {"forward": 0.0, "left": 0.5 * math.pi, "back": math.pi, "right": -0.5 * math.pi}
FEET = (foot_beside(Pose2D(), Side.LEFT, P.stance_width), foot_beside(Pose2D(), Side.RIGHT, P.stance_width))
MIDDLE = (P.zmp_forward, 0.0)


def push(body: Body, direction: float, impulse: float) -> None:
    """Push the torso for 0.1 s with an impulse [N s]."""
    force = 10.0 * impulse
    body.world.push([force * math.cos(direction), force * math.sin(direction), 0.0], 100)


def test_a_robot_steps_when_its_dcm_is_beyond_the_share_of_the_support_that_ankles_may_use() -> None:
    for direction in np.linspace(-math.pi, math.pi, 24, endpoint=False):
        unit = (math.cos(direction), math.sin(direction))
        reaches = [r for r in np.arange(0.0, 0.5, 0.002) if not must_step(P, FEET, _beyond(unit, float(r)))]
        assert max(reaches) == reaches[-1] == pytest.approx(0.002 * (len(reaches) - 1))  # one border, no holes
        edge = next(r for r in np.arange(0.0, 0.5, 0.002) if _outside(_beyond(unit, float(r))))
        assert max(reaches) == pytest.approx(P.ankle_share * edge, abs=0.004)


def _beyond(unit: tuple[float, float], way: float) -> tuple[float, float]:
    return MIDDLE[0] + way * unit[0], MIDDLE[1] + way * unit[1]


def _outside(point: tuple[float, float]) -> bool:
    nearest, _ = SupportArea.of(P, *FEET).nearest(point)
    return math.dist(nearest, point) > 1e-9


def test_whether_to_step_is_the_same_wherever_the_feet_stand() -> None:
    at = Pose2D(3.0, -2.0, 1.3)
    moved = (Footstep(Side.LEFT, at @ FEET[0].pose), Footstep(Side.RIGHT, at @ FEET[1].pose))
    for x in np.linspace(-0.2, 0.3, 11):
        for y in np.linspace(-0.4, 0.4, 11):
            assert must_step(P, moved, at.transform((float(x), float(y)))) is must_step(P, FEET, (float(x), float(y)))


@pytest.mark.sim
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_pushed_while_standing_it_stays_upright_and_stands_again(direction: str) -> None:
    body = Body(0, START, ball=(0.0, 0.0))
    body.go(1.0)
    before = feet_apart(body)
    push(body, DIRECTIONS[direction], 9.0)
    body.go(5.0)
    assert not body.fallen, body.motion.state().reason
    assert body.motion.mode is MotionMode.STAND
    # Along the soles the ankles cannot hold it; sideways the feet stand wide enough.
    stepped = direction in ("forward", "back")
    assert (body.motion.state().step_count > 0) is stepped
    expected = P.stance_width if stepped else before
    assert feet_apart(body) == pytest.approx(expected, abs=P.closing_tolerance + 0.02 if stepped else 0.005)


def feet_apart(body: Body) -> float:
    """Return the distance between the soles [m]."""
    left, right = body.motion.state().soles[:, :2, 3]
    return float(np.linalg.norm(left - right))


@pytest.mark.sim
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_pushed_while_walking_it_walks_on(direction: str) -> None:
    body = Body(1, START, ball=(0.0, 0.0))
    body.go(3.0, (0.3, 0.0, 0.0))
    push(body, DIRECTIONS[direction], 8.0)
    body.go(4.0, (0.3, 0.0, 0.0))
    assert not body.fallen, body.motion.state().reason
    assert body.motion.mode is MotionMode.WALK
    assert np.all(body.greatest_efforts <= load_robot().effort_limits)
    before = body.world.truth().base_position
    body.go(2.0, (0.3, 0.0, 0.0))
    assert np.linalg.norm(body.world.truth().base_position - before) == pytest.approx(0.6, abs=0.1)


@pytest.mark.sim
def test_a_light_push_while_standing_is_held_by_the_ankles() -> None:
    body = Body(0, START, ball=(0.0, 0.0))
    body.go(1.0)
    push(body, 0.0, 2.0)
    body.go(2.0)
    assert body.motion.mode is MotionMode.STAND
    assert body.motion.state().step_count == 0
