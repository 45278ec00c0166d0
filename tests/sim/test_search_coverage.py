"""The search pattern sees the whole field: through the real lens, in sharp pictures, whatever the trunk does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_motion.head import HeadParameters
from tulip_sim.search_coverage import Coverage, CoverageParameters, search_coverage
from tulip_strategy.parameters import StrategyParameters
from tulip_vision.lens import head_camera_lens

FIELD, STRATEGY = load_field(), StrategyParameters()
DIRECTIONS = np.radians(np.arange(-180.0, 180.0, 5.0))
RANGES = np.geomspace(0.3, math.hypot(FIELD.length, FIELD.width), 24)
PARAMETERS = CoverageParameters(FIELD.ball_radius)


def coverage(
    parameters: CoverageParameters = PARAMETERS,
    duration: float = STRATEGY.sweep_time,
    turning: float = 0.0,
    head: HeadParameters | None = None,
) -> Coverage:
    return search_coverage(
        head or HeadParameters(), load_robot(), head_camera_lens(), DIRECTIONS, RANGES, duration, parameters, turning
    )


@pytest.mark.parametrize(("lowered", "lean"), [(0.0, 0.0), (0.05, 0.0), (0.0, 0.05), (0.0, -0.05)])
def test_one_sweep_sees_every_place_on_the_field_within_160_degrees_to_both_sides(lowered: float, lean: float) -> None:
    result = coverage(replace(PARAMETERS, lowered=lowered, lean=lean))
    inside = np.abs(DIRECTIONS) <= math.radians(160.0) + 1e-9
    assert result.seen[inside].all(), np.argwhere(~result.seen[inside])


def test_one_turn_of_the_body_sees_every_place_in_all_directions() -> None:
    result = coverage(duration=2.0 * math.pi / STRATEGY.search_turn_speed, turning=STRATEGY.search_turn_speed)
    assert result.seen.all(), np.argwhere(~result.seen)


def test_coverage_finds_the_gap_of_a_pattern_that_leaves_one() -> None:
    ranges = RANGES[RANGES < 0.4]
    flat = coverage(head=HeadParameters(search_tilt_near=0.7))
    assert not flat.seen[:, : len(ranges)].all()
    assert not coverage(duration=3.0).seen.all()


def test_a_place_counts_as_seen_when_three_pictures_have_shown_it() -> None:
    result = coverage(duration=4.0)
    assert np.array_equal(result.seen, result.pictures >= 3)
    assert np.array_equal(result.seen, ~np.isnan(result.first))
