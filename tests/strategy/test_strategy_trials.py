from __future__ import annotations

import pytest
from kinematic_bench import BAD_LEGS, PERFECT_LEGS, KinematicTrial, Legs, Outcome

SEEDS = range(1, 21)


def outcomes(legs: Legs) -> list[Outcome]:
    return [KinematicTrial(seed, legs).run(150.0) for seed in SEEDS]


@pytest.mark.parametrize("legs", [PERFECT_LEGS, BAD_LEGS], ids=["perfect legs", "bad legs"])
def test_18_of_20_trials_end_with_a_goal_within_150_seconds(legs: Legs) -> None:
    played = outcomes(legs)
    assert sum(outcome.result == "goal" for outcome in played) >= 18, [outcome.result for outcome in played]


def test_the_ball_is_kicked_into_the_goal_and_dribbled_there() -> None:
    played = [outcome for outcome in outcomes(PERFECT_LEGS) if outcome.result == "goal"]
    assert sum(outcome.kicks > 0 for outcome in played) >= 0.9 * len(played)
    assert all(any(path.endswith("dribble") for path in outcome.path) for outcome in played)


def test_the_same_seed_gives_the_same_trial() -> None:
    first, second = KinematicTrial(7, BAD_LEGS), KinematicTrial(7, BAD_LEGS)
    assert first.run() == second.run()
    assert first.robot == second.robot
    assert first.ball.tolist() == second.ball.tolist()
    assert first.decision == second.decision


def test_the_tree_does_not_chatter() -> None:
    """A change of mind more often than every 1.5 s, on average, would keep the legs from getting anywhere."""
    for outcome in outcomes(PERFECT_LEGS):
        assert len(outcome.path) < 5 + outcome.seconds / 1.5
