"""The field: its measures, the geometry that follows, and what a malformed file is told."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from tulip_description.field import FIELD_FILE, CrossingKind, FieldError, load_field
from tulip_description.keeper import keeper_parts

EXACT = 1e-12  # [m] only rounding remains


def test_measures_are_those_of_adult_size_2013():
    field = load_field()
    assert (field.length, field.width, field.border, field.line_width) == (9.0, 6.0, 0.7, 0.05)
    assert (field.goal_width, field.goal_height, field.goal_colour) == (2.6, 1.8, "yellow")
    assert (field.penalty_mark_distance, field.centre_circle_diameter) == (2.1, 1.5)
    assert field.penalty_marks == ((-2.4, 0.0), (2.4, 0.0))
    assert (field.carpet_length, field.carpet_width) == pytest.approx((10.4, 7.4), abs=EXACT)


def test_goals_have_the_inner_width_between_their_posts_and_the_opponents_lies_at_plus_x():
    field = load_field()
    for goal, x in ((field.own_goal, -4.5), (field.opponent_goal, 4.5)):
        left, right = goal.posts
        assert left.x == right.x == goal.x == x
        assert (left.y - left.radius) - (right.y + right.radius) == pytest.approx(field.goal_width, abs=EXACT)
        assert abs(goal.back) == pytest.approx(4.5 + field.goal_depth, abs=EXACT)
        assert goal.back * x > 0.0
    assert field.goal_posts == (*field.own_goal.posts, *field.opponent_goal.posts)


def _arms(field, x: float, y: float) -> list[float]:
    """Directions [rad] in which a line or the circle's tangent leaves a point."""
    arms = []
    for line in field.line_segments:
        along = np.array([math.cos(line.direction), math.sin(line.direction)])
        offset = np.array([x, y]) - line.start
        if abs(along[0] * offset[1] - along[1] * offset[0]) > EXACT:
            continue
        position = float(along @ offset)
        if -EXACT <= position < line.length - EXACT:
            arms.append(line.direction)
        if EXACT < position <= line.length + EXACT:
            arms.append(line.direction + math.pi)
    circle = field.centre_circle
    if abs(math.hypot(x - circle.x, y - circle.y) - circle.radius) < EXACT:
        tangent = math.atan2(y - circle.y, x - circle.x) + math.pi / 2.0
        arms += [tangent, tangent + math.pi]
    return arms


def _same_direction(a: float, b: float) -> bool:
    return math.cos(a - b) > 1.0 - 1e-12


def test_kind_and_orientation_of_each_crossing_follow_from_the_lines_that_leave_it():
    field = load_field()
    arm_count = {CrossingKind.L: 2, CrossingKind.T: 3, CrossingKind.X: 4}
    for crossing in field.crossings:
        arms = _arms(field, crossing.x, crossing.y)
        assert len(arms) == arm_count[crossing.kind], crossing
        if crossing.kind is CrossingKind.L:
            middle = sum(np.array([math.cos(arm), math.sin(arm)]) for arm in arms)
            assert _same_direction(math.atan2(middle[1], middle[0]), crossing.orientation), crossing
        elif crossing.kind is CrossingKind.T:
            stems = [arm for arm in arms if not any(_same_direction(arm + math.pi, other) for other in arms)]
            assert len(stems) == 1 and _same_direction(stems[0], crossing.orientation), crossing
        else:
            assert any(_same_direction(arm, crossing.orientation) for arm in arms), crossing


def test_no_meeting_of_two_lines_is_left_out():
    field = load_field()
    listed = {(round(crossing.x, 9), round(crossing.y, 9)) for crossing in field.crossings}
    ends = {(round(x, 9), round(y, 9)) for line in field.line_segments for x, y in (line.start, line.end)}
    on_circle = {(0.0, 0.75), (0.0, -0.75)}
    assert ends | on_circle == listed
    assert len(field.crossings) == len(listed) == 16


def test_field_is_the_same_seen_from_both_sides_except_for_its_poles():
    field = load_field()
    turned = {(round(-crossing.x, 9), round(-crossing.y, 9), crossing.kind) for crossing in field.crossings}
    assert turned == {(round(crossing.x, 9), round(crossing.y, 9), crossing.kind) for crossing in field.crossings}
    assert field.poles[0].colours != field.poles[1].colours


def test_poles_stand_on_the_border_and_can_be_left_out():
    field = load_field()
    assert [(pole.x, pole.y) for pole in field.poles] == [(0.0, 3.4), (0.0, -3.4)]
    assert field.poles[0].height == pytest.approx(0.6, abs=EXACT)
    assert field.without_poles().poles == ()
    assert field.without_poles().goal_posts == field.goal_posts


@pytest.mark.parametrize(
    ("keys", "value", "words"),
    [
        (("field",), None, ["field is None", "length"]),
        (("field", "length"), 9.0, ["field.length", "value", "sure"]),
        (("field", "length"), {"value": "nine", "sure": "high"}, ["field.length", "'nine'", "metres"]),
        (("field", "length"), {"value": True, "sure": "high"}, ["field.length", "True"]),
        (("field", "length"), {"value": float("nan"), "sure": "high"}, ["field.length", "nan"]),
        (("field", "length"), {"value": -9.0, "sure": "high"}, ["field.length", "-9", "> 0"]),
        (("field", "length"), {"value": 9.0, "sure": "perhaps"}, ["field.length.sure", "assumed"]),
        (("field", "lenght"), {"value": 9.0, "sure": "high"}, ["unknown lenght", "length"]),
        (("field", "goal_area_width"), {"value": 7.0, "sure": "high"}, ["goal_area_width", "less than 6"]),
        (("goal", "depth"), {"value": 0.9, "sure": "high"}, ["goal_depth", "border"]),
        (("ball", "colour"), {"value": "pink", "sure": "high"}, ["ball.colour", "pink", "orange"]),
        (("poles", "list"), None, ["poles.list", "[]"]),
        (("poles", "list", 0, "colours"), [], ["poles.list[0].colours", "upwards"]),
        (("poles", "list", 0, "y"), 9.0, ["pole", "(0, 9)", "on the carpet"]),
        (("poles", "list", 0, "y"), 1.0, ["pole", "(0, 1)", "outside the lines"]),
    ],
)
def test_malformed_entry_is_refused_by_name_of_file_and_entry(tmp_path: Path, keys, value, words):
    content = yaml.safe_load(FIELD_FILE.read_text(encoding="utf-8"))
    parent = content
    for key in keys[:-1]:
        parent = parent[key]
    parent[keys[-1]] = value
    file = tmp_path / "other.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(FieldError) as refusal:
        load_field(file)
    for word in ("other.yaml", *words):
        assert word in str(refusal.value)


def test_missing_entry_missing_file_and_broken_yaml_are_refused(tmp_path: Path):
    content = yaml.safe_load(FIELD_FILE.read_text(encoding="utf-8"))
    del content["goal"]["height"]
    file = tmp_path / "field.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(FieldError, match="goal lacks height"):
        load_field(file)
    with pytest.raises(FieldError, match="cannot be read"):
        load_field(tmp_path / "absent.yaml")
    file.write_text("field: {length: [", encoding="utf-8")
    with pytest.raises(FieldError, match="is not YAML"):
        load_field(file)


def test_keeper_stands_on_the_ground_is_symmetric_and_no_box_is_inside_another():
    parts = keeper_parts("magenta")
    low = {part.name: np.array(part.centre) - np.array(part.size) / 2.0 for part in parts}
    high = {part.name: np.array(part.centre) + np.array(part.size) / 2.0 for part in parts}
    lowest, highest = np.min(list(low.values()), axis=0), np.max(list(high.values()), axis=0)
    assert lowest[2] == pytest.approx(0.0, abs=EXACT)
    assert highest[2] == pytest.approx(1.3, abs=EXACT)
    assert -lowest[1] == pytest.approx(highest[1], abs=EXACT)
    for a in low:
        for b in low:
            if a < b:
                overlap = np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])
                assert overlap.min() < 1e-9, (a, b)
    with pytest.raises(ValueError, match="cyan or magenta"):
        keeper_parts("green")
