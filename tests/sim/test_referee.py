from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_sim.referee import Referee, RefereeParameters, Result
from tulip_sim.referee_packets import write_packet
from tulip_sim.situation import Removal
from tulip_sim.truth import Truth
from tulip_strategy.game_controller import Packet, decode
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.interface import GamePhase

FIELD = load_field()
GOAL = FIELD.opponent_goal
TICK = 4_000_000  # [ns]
START = 5.0  # [s] of play, with the usual times
JUST_OVER = GOAL.x + 0.5 * FIELD.line_width + FIELD.ball_radius  # [m] from here on the ball is wholly over the line
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
LYING = (0.0, math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4))


def truth(seconds: float, ball: tuple[float, float, float] = (0.0, 0.0, 0.0935), **changes: Any) -> Truth:
    still = np.zeros(3)
    usual = Truth(
        stamp=round(seconds * 1e9),
        base_position=np.array([-1.0, 0.0, 1.0]),
        base_orientation=np.array(UPRIGHT),
        base_linear_velocity=still,
        base_angular_velocity=still,
        joint_positions=np.zeros(14),
        joint_velocities=np.zeros(14),
        ball_position=np.array(ball),
        ball_orientation=np.array(UPRIGHT),
        ball_linear_velocity=still,
        ball_angular_velocity=still,
        keeper=Pose2D(4.2, 0.3, math.pi),
        keeper_path=(),
        foot_touches=(3, 4),
        body_touches=1,
        keeper_touches=2,
        poles=True,
    )
    return replace(usual, **changes)


def playing(parameters: RefereeParameters | None = None) -> Referee:
    """A referee at the beginning of play."""
    referee = Referee(parameters or RefereeParameters(), FIELD)
    referee.update(truth(0.0))
    referee.update(truth(START))
    assert referee.phase is GamePhase.PLAYING
    return referee


def packet_of(referee: Referee) -> Packet:
    packet = decode(write_packet(referee.situation()))
    assert isinstance(packet, Packet)
    return packet


def test_phases_follow_each_other_with_their_durations_from_the_first_truth_on() -> None:
    referee = Referee(RefereeParameters(), FIELD)
    seen = []
    for tick in range(0, 1300):
        referee.update(truth(10.0 + tick * TICK * 1e-9))
        seen.append(referee.phase)
    counts = [seen.count(phase) for phase in GamePhase]
    assert counts == [250, 500, 500, 50, 0]
    assert seen == sorted(seen)


def test_packets_go_out_at_2_hz_and_at_once_when_the_phase_changes() -> None:
    referee = Referee(RefereeParameters(initial_time=0.75), FIELD)
    stamps = [tick * TICK for tick in range(500) if referee.update(truth(tick * TICK * 1e-9)) is not None]
    assert stamps == [0, 500_000_000, 752_000_000, 1_000_000_000, 1_500_000_000]


def test_game_input_understands_the_packets() -> None:
    referee = Referee(RefereeParameters(), FIELD)
    game = GameInput(GameInputParameters())
    data = referee.update(truth(0.0))
    assert data is not None
    assert game.receive(data, 0) is None
    state = game.state(0)
    assert state is not None
    assert (state.phase, state.kick_off, state.seconds_remaining) == (GamePhase.INITIAL, True, 150)


@pytest.mark.parametrize("y", [0.0, 1.29, -1.29])
def test_a_ball_wholly_over_the_line_between_the_posts_is_a_goal(y: float) -> None:
    referee = playing()
    referee.update(truth(START + 20.0, (JUST_OVER - 0.001, y, 0.09)))
    assert referee.outcome is None
    data = referee.update(truth(START + 20.004, (JUST_OVER + 0.001, y, 0.09)))
    outcome = referee.outcome
    assert outcome is not None
    assert outcome.result is Result.GOAL
    assert outcome.seconds == pytest.approx(20.004)
    assert (outcome.foot_touches, outcome.body_touches, outcome.keeper_touches, outcome.falls) == (7, 1, 2, 0)
    assert referee.score == (1, 0)
    assert referee.phase is GamePhase.FINISHED
    assert data is not None  # the end is told at once
    packet = packet_of(referee)
    assert (packet.state, packet.teams[0].score, packet.penalty_shots) == (4, 1, (1, 0))


@pytest.mark.parametrize(
    "ball", [(JUST_OVER + 0.01, 1.35, 0.09), (JUST_OVER + 0.01, 0.0, 1.9), (0.0, 3.13, 0.09), (-2.0, -3.13, 0.09)]
)
def test_a_ball_over_a_line_elsewhere_is_out(ball: tuple[float, float, float]) -> None:
    referee = playing()
    referee.update(truth(START + 1.0, ball))
    assert referee.outcome is not None
    assert referee.outcome.result is Result.OUT
    assert referee.score == (0, 0)


def test_a_ball_on_the_line_is_neither_goal_nor_out() -> None:
    referee = playing()
    for ball in ((JUST_OVER - 0.001, 0.0, 0.09), (0.0, 3.1, 0.09), (4.55, 2.0, 0.09)):
        referee.update(truth(START + 1.0, ball))
    assert referee.outcome is None


def test_play_goes_on_after_an_out_ball_if_it_shall_and_counts_each_once() -> None:
    referee = playing(RefereeParameters(ends_when_ball_is_out=False))
    for seconds, y in ((1.0, 3.2), (1.1, 3.3), (1.2, 0.0), (1.3, -3.2)):
        referee.update(truth(START + seconds, (0.0, y, 0.09)))
    assert referee.outcome is None
    assert referee.outs == 2


def test_a_ball_in_the_own_goal_counts_for_the_others() -> None:
    referee = playing()
    referee.update(truth(START + 1.0, (-JUST_OVER - 0.01, 0.2, 0.09)))
    assert referee.outcome is not None
    assert referee.outcome.result is Result.OWN_GOAL
    assert referee.score == (0, 1)


def test_nothing_counts_before_play_begins() -> None:
    referee = Referee(RefereeParameters(), FIELD)
    referee.update(truth(0.0))
    referee.update(truth(4.9, (JUST_OVER + 0.1, 0.0, 0.09)))
    assert referee.outcome is None
    assert referee.score == (0, 0)


def test_the_trial_ends_with_the_time() -> None:
    referee = playing()
    referee.update(truth(START + 149.999))
    assert packet_of(referee).seconds_remaining == 1
    assert referee.outcome is None
    referee.update(truth(START + 150.0))
    assert referee.outcome is not None
    assert referee.outcome.result is Result.TIME
    assert packet_of(referee).seconds_remaining == 0


def test_a_robot_lying_for_30_s_ends_the_trial_and_one_that_gets_up_does_not() -> None:
    referee = playing()
    lying = np.array(LYING)
    referee.update(truth(START + 1.0, base_orientation=lying))
    referee.update(truth(START + 30.9, base_orientation=lying))
    referee.update(truth(START + 30.95))
    referee.update(truth(START + 31.1, base_orientation=lying))
    assert referee.outcome is None
    assert referee.falls == 2
    referee.update(truth(START + 61.2, base_orientation=lying))
    assert referee.outcome is not None
    assert referee.outcome.result is Result.FALLEN
    assert referee.outcome.falls == 2


def test_a_penalty_is_in_the_packets_until_its_time_is_over() -> None:
    referee = playing(RefereeParameters(player_number=2))
    referee.remove(Removal.INACTIVE, 30.0)
    player = packet_of(referee).teams[0].players[1]
    assert (player.penalty, player.seconds) == (5, 30)
    referee.update(truth(START + 29.5))
    assert packet_of(referee).teams[0].players[1].seconds == 1
    referee.update(truth(START + 30.0))
    assert packet_of(referee).teams[0].players[1].penalty == 0


def test_restart_begins_the_next_trial_and_keeps_the_score() -> None:
    referee = playing()
    referee.update(truth(START + 1.0, (JUST_OVER + 0.1, 0.0, 0.09)))
    referee.restart()
    referee.update(truth(0.0))
    assert referee.phase is GamePhase.INITIAL
    assert referee.outcome is None
    assert referee.score == (1, 0)
    referee.update(truth(START))
    referee.update(truth(START + 3.0, (JUST_OVER + 0.1, 0.0, 0.09)))
    assert referee.score == (2, 0)
    assert packet_of(referee).penalty_shots == (3, 0)


def test_parameters_out_of_range_are_named() -> None:
    with pytest.raises(ValueError, match=r"playing_time is -1 s; expected > 0"):
        RefereeParameters(playing_time=-1)
    with pytest.raises(ValueError, match="both 25"):
        RefereeParameters(opponent_number=25)
