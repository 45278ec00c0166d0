"""The row of passages, and the ways back from each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.identification.experiment_plan import FootPlan, PlanParameters, make_plan
from tulip_motion.identification.passages import BOTH, QUINTIC_PEAK, Doing, Pace, Passage, passages
from tulip_motion.identification.progress import Hold, Progress

ROBOT = load_robot()
STANDING = standing_posture(ROBOT).joint_positions


@pytest.fixture(scope="module")
def plans() -> tuple[FootPlan, ...]:
    return make_plan(ROBOT, PlanParameters(postures=9, candidates=40))


def follow(row: list[Passage], joints: np.ndarray) -> np.ndarray:
    """Check that each passage begins where the one before ended, and return where the last one ends."""
    for passage in row:
        if passage.road is not None:
            assert passage.road.position(0.0) == pytest.approx(joints, abs=1e-3)
            joints = passage.road.position(1.0)
    return joints


def test_the_whole_row_is_connected_from_standing_to_standing(plans: tuple[FootPlan, ...]):
    row = list(passages(plans, Pace()))
    assert follow(row, STANDING) == pytest.approx(STANDING, abs=1e-3)
    assert row[-1].doing is Doing.STAND


def test_every_way_back_begins_where_its_passage_begins_and_ends_on_both_feet(plans: tuple[FootPlan, ...]):
    joints = STANDING
    for passage in passages(plans, Pace()):
        if passage.way_back:
            assert follow(list(passage.way_back), joints) == pytest.approx(STANDING, abs=1e-3)
            assert passage.way_back[-1].shares == (BOTH, BOTH)
        if passage.road is not None:
            joints = passage.road.position(1.0)


def test_all_postures_are_held_once_in_their_places(plans: tuple[FootPlan, ...]):
    postures = [visit.posture for plan in plans for visit in plan.visits]
    joints, held = STANDING, []
    for passage in passages(plans, Pace()):
        if passage.road is not None:
            joints = passage.road.position(1.0)
        if passage.doing is Doing.HOLD:
            held.append(passage.posture)
            assert joints == pytest.approx(postures[passage.posture].joint_positions)
            assert ("left", "right")[passage.stance] == postures[passage.posture].side
    assert held == list(range(18))


def test_no_joint_is_faster_than_the_pace(plans: tuple[FootPlan, ...]):
    for passage in passages(plans, Pace(joint_speed=0.4)):
        if passage.doing is Doing.MOVE and passage.road is not None:
            rates = [np.abs(passage.road.rate(share)).max() for share in np.linspace(0.0, 1.0, 101)]
            assert max(rates) * QUINTIC_PEAK / passage.time <= 0.4 * 1.01


def test_a_pace_of_zero_is_refused():
    with pytest.raises(ValueError, match="shift_time is 0"):
        Pace(shift_time=0.0)


def test_progress_survives_json():
    progress = Progress(Doing.HOLD, 3, 40, 2, (1,), 12.5, "", Hold(2, "left", 5, 9), False)
    assert Progress.from_dict(progress.as_dict()) == progress
    assert Progress.from_dict(replace(progress, hold=None).as_dict()).hold is None
    with pytest.raises(ValueError, match="missing or unknown"):
        Progress.from_dict({"doing": "hold"})
    with pytest.raises(ValueError, match="expected left or right"):
        Hold(0, "middle", 0, 1)  # type: ignore[arg-type]
