"""The D-optimal choice of postures."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from tulip_description.robot import SIDES, load_robot
from tulip_motion.identification.posture_choice import choose, information, rows_of
from tulip_motion.identification.static_postures import PostureSolver
from tulip_motion.identification.weight_shift import weight_shift

ROBOT = load_robot()
EACH = 60


@pytest.fixture(scope="module")
def rows() -> np.ndarray:
    postures = []
    for side in ("left", "right"):
        start = weight_shift(ROBOT, side).lift.points[-1]
        postures += islice(PostureSolver(ROBOT, side).samples(np.random.default_rng(2), start), EACH)
    return rows_of(ROBOT, postures)


FEET = [side for side in SIDES for _ in range(EACH)]


def test_columns_are_the_unknown_base_parameters_and_two_mounting_angles(rows: np.ndarray):
    assert rows.shape == (2 * EACH, 2, 31 + 2)
    assert np.linalg.matrix_rank(rows.reshape(-1, 33)) == 33


def test_chosen_postures_tell_more_than_any_of_200_random_sets(rows: np.ndarray):
    rng = np.random.default_rng(3)
    chosen = information(rows, choose(rows, FEET, 15, rng))
    random = [
        information(rows, (*rng.permutation(EACH)[:15], *(EACH + rng.permutation(EACH)[:15]))) for _ in range(200)
    ]
    assert chosen > max(random) + 3.0  # nats of log det


def test_as_many_are_chosen_on_each_foot_and_none_twice(rows: np.ndarray):
    choice = choose(rows, FEET, 12, np.random.default_rng(4))
    assert len(set(choice)) == 24
    assert sum(index < EACH for index in choice) == 12


def test_no_single_exchange_on_a_foot_improves_the_choice(rows: np.ndarray):
    choice = choose(rows, FEET, 10, np.random.default_rng(5))
    best = information(rows, choice)
    for place, old in enumerate(choice):
        for new in range(2 * EACH):
            if new not in choice and FEET[new] == FEET[old]:
                exchanged = (*choice[:place], new, *choice[place + 1 :])
                assert information(rows, exchanged) <= best + 1e-4


def test_too_few_postures_and_too_few_candidates_are_refused(rows: np.ndarray):
    with pytest.raises(ValueError, match="expected 9 to 60"):
        choose(rows, FEET, 8, np.random.default_rng(0))
    with pytest.raises(ValueError, match="expected 9 to 60"):
        choose(rows, FEET, 61, np.random.default_rng(0))
