"""Shots at the own goal: those of the bench, and one that the goalkeeper plays against."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from tulip_description.field import load_field
from tulip_sim.bench.shots import AFTER, IN_GOAL, SPEED, draw_shot, goes_in, keep
from tulip_sim.lockstep import Settings
from tulip_sim.perception import PerceptionParameters

pytestmark = pytest.mark.sim
FIELD = load_field()


def test_each_shot_goes_in_on_an_empty_field_and_is_as_slow_as_was_asked_for() -> None:
    for seed in range(1, 6):
        shot = draw_shot(seed)
        assert goes_in(shot, FIELD, seed, None)
        assert SPEED[0] <= math.hypot(*shot.velocity) <= SPEED[1]
        assert math.dist(shot.ball, (FIELD.own_goal.x, 0.0)) == pytest.approx(3.0)
    assert draw_shot(1) == draw_shot(1)
    assert AFTER > 3.2  # [s] the slowest shot that goes in takes so long


def test_a_figure_stops_what_comes_at_it() -> None:
    shot = draw_shot(1)
    way = IN_GOAL.x - shot.ball[0], IN_GOAL.y - shot.ball[1]
    speed = 2.0 / math.hypot(*way)
    straight = replace(shot, velocity=(speed * way[0], speed * way[1]))
    assert goes_in(straight, FIELD, 1, None)
    assert not goes_in(straight, FIELD, 1, IN_GOAL)


def test_the_goalkeeper_gets_in_the_way_of_a_shot() -> None:
    kept, fell, touches = keep(draw_shot(5), 5, Settings(perception=PerceptionParameters()))
    assert (kept, fell) == (True, False)
    assert touches > 0
