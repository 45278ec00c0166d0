"""Camera and vision in a process of their own: the same trial, bit for bit."""

from __future__ import annotations

import multiprocessing

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_sim.lockstep import Lockstep
from tulip_sim.scenario import make_scenario
from tulip_sim.truth import Truth
from tulip_worldmodel.world_state import WorldState

pytestmark = pytest.mark.sim


def play(eyes_beside: bool) -> tuple[Truth, WorldState]:
    trial = Lockstep(make_scenario("trial", np.random.default_rng(5), load_field()), 5, eyes_beside=eyes_beside)
    try:
        while trial.stamp < 7_000_000_000:  # two seconds of play, in which the robot walks by what it sees
            trial.step()
        return trial.world.truth(), trial.world_model.state(trial.stamp)
    finally:
        trial.close()


def test_eyes_beside_give_the_same_trial_bit_for_bit_and_end_with_it():
    (truth, world), (other_truth, other_world) = play(False), play(True)
    np.testing.assert_array_equal(truth.base_position, other_truth.base_position)
    np.testing.assert_array_equal(truth.joint_positions, other_truth.joint_positions)
    assert world.robot.pose == other_world.robot.pose
    assert world.ball is not None and other_world.ball is not None
    np.testing.assert_array_equal(world.ball.covariance, other_world.ball.covariance)
    assert not multiprocessing.active_children()
