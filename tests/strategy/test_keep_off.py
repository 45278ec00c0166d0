from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_strategy.behaviour.keep_off import in_kicks_way, kept_off
from tulip_strategy.parameters import StrategyParameters

PARAMETERS = StrategyParameters()
OFF, GAIN = PARAMETERS.keep_off, PARAMETERS.keep_off_gain
SPEEDS = st.floats(-0.5, 0.5)


def test_far_opponents_change_nothing() -> None:
    assert kept_off((0.4, 0.1, 0.3), [(3.0, 0.0), (0.0, -2.0)], PARAMETERS) == (0.4, 0.1, 0.3)


def test_speed_towards_somebody_falls_to_nothing_and_then_leads_away() -> None:
    for distance in (OFF + 0.2, OFF, OFF - 0.1):
        forward, left, turn = kept_off((0.4, 0.1, 0.3), [(distance, 0.0)], PARAMETERS)
        assert forward == pytest.approx(GAIN * (distance - OFF))
        assert (left, turn) == (0.1, 0.3)


@given(SPEEDS, SPEEDS, st.floats(0.3, 2.0), st.floats(-math.pi, math.pi))
def test_nobody_is_walked_into_and_the_way_past_stays_open(forward, left, distance, angle) -> None:
    place = (distance * math.cos(angle), distance * math.sin(angle))
    x, y, _ = kept_off((forward, left, 0.0), [place], PARAMETERS)
    towards, along = math.cos(angle), math.sin(angle)
    assert x * towards + y * along <= max(GAIN * (distance - OFF), forward * towards + left * along) + 1e-9
    assert x * towards + y * along <= GAIN * (distance - OFF) + 1e-9 or (x, y) == (forward, left)
    assert -x * along + y * towards == pytest.approx(-forward * along + left * towards, abs=1e-9)


def test_a_kick_is_held_back_where_the_leg_would_meet_somebody() -> None:
    near = PARAMETERS.kick_clear_distance - 0.05
    assert in_kicks_way(0.0, [(near, 0.1)], PARAMETERS)
    assert not in_kicks_way(0.0, [(near + 0.1, 0.0)], PARAMETERS)
    assert not in_kicks_way(0.0, [(0.0, near)], PARAMETERS)
