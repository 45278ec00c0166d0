"""The emulator's packets, as the robot reads them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_sim.referee import Referee, RefereeParameters
from tulip_sim.referee_packets import write_packet
from tulip_sim.situation import PlayerSituation, Removal, Situation, TeamSituation
from tulip_sim.truth import Truth
from tulip_strategy.game_controller import LAYOUTS, Packet, TeamColour, decode
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.interface import GamePhase, GameState, Penalty, SecondaryState

VERSIONS = sorted(LAYOUTS)
OWN = TeamSituation(
    25, TeamColour.MAGENTA, 2, (PlayerSituation(Removal.LEFT_FIELD, 17), PlayerSituation()), (True, False, True), 2
)
OTHER = TeamSituation(12, TeamColour.CYAN, 1, (PlayerSituation(),), (True,), 1)
SITUATION = Situation(GamePhase.SET, False, 1, -12, 5, (OTHER, OWN), 300)


def seen(situation: Situation, version: int, player: int = 1) -> GameState:
    game = GameInput(GameInputParameters(player_number=player))
    assert game.receive(write_packet(situation, version), 0) is None
    state = game.state(0)
    assert state is not None
    return state


@pytest.mark.parametrize("version", VERSIONS)
def test_a_situation_is_read_as_it_was_meant(version: int) -> None:
    state = seen(SITUATION, version)
    assert state == GameState(
        stamp=0,
        version=version,
        phase=GamePhase.SET,
        first_half=False,
        kick_off=True,
        secondary_state=SecondaryState.PENALTY_SHOOT,
        seconds_remaining=-12,
        own_score=2,
        opponent_score=1,
        penalty=Penalty.LEFT_FIELD if version >= 18 else Penalty.PICK_UP,
        seconds_till_unpenalised=17,
        goalkeeper=2 if version >= 12 else 0,
    )
    assert not seen(replace(SITUATION, striker=0), version).kick_off
    assert seen(SITUATION, version, player=2).penalty is Penalty.NONE
    assert seen(SITUATION, version, player=3).penalty is (Penalty.SUBSTITUTE if version >= 18 else Penalty.NONE)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("phase", GamePhase)
def test_phases_are_read_as_they_were_meant(version: int, phase: GamePhase) -> None:
    assert seen(replace(SITUATION, phase=phase), version).phase is phase


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    ("removal", "known", "else_"),
    [
        (Removal.INACTIVE, Penalty.INACTIVE, Penalty.PICK_UP),
        (Removal.LEFT_FIELD, Penalty.LEFT_FIELD, Penalty.PICK_UP),
        (Removal.MANUAL, Penalty.MANUAL, Penalty.PICK_UP),
    ],
)
def test_removals_are_told_as_the_nearest_penalty(
    version: int, removal: Removal, known: Penalty, else_: Penalty
) -> None:
    own = replace(OWN, players=(PlayerSituation(removal, 30),))
    assert seen(replace(SITUATION, teams=(OTHER, own)), version).penalty in (known, else_)


@pytest.mark.parametrize("version", VERSIONS)
def test_timeouts_and_stops_are_told_where_the_version_can(version: int) -> None:
    timeout = replace(SITUATION, secondary=SecondaryState.TIMEOUT)
    assert seen(timeout, version).secondary_state is SecondaryState.TIMEOUT
    assert seen(replace(SITUATION, stopped=True), version).stopped is (version >= 19)


@pytest.mark.parametrize("version", VERSIONS)
def test_scored_trials_and_counts_are_in_the_packet(version: int) -> None:
    packet = decode(write_packet(SITUATION, version))
    assert isinstance(packet, Packet)
    if version == 7:
        assert packet.penalty_shots == (1, 5)
        assert packet.sub_time == 5
    else:
        assert [(team.penalty_shot, team.single_shots) for team in packet.teams] == [(1, 1), (3, 5)]
        assert (packet.secondary_time, packet.packet_number) == (5, 300 - 256)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_referee_speaks_the_version_that_it_is_told(version: int) -> None:
    still = np.zeros(3)
    truth = Truth(
        stamp=0,
        base_position=np.array([-1.0, 0.0, 1.0]),
        base_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        base_linear_velocity=still,
        base_angular_velocity=still,
        joint_positions=np.zeros(14),
        joint_velocities=np.zeros(14),
        ball_position=still,
        ball_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        ball_linear_velocity=still,
        ball_angular_velocity=still,
        keeper=None,
        keeper_path=(),
        foot_touches=(0, 0),
        body_touches=0,
        keeper_touches=0,
        poles=True,
    )
    data = Referee(RefereeParameters(version=version), load_field()).update(truth)
    assert data is not None
    assert len(data) == LAYOUTS[version].size
    assert data[4] == version


def test_an_unknown_version_is_refused() -> None:
    with pytest.raises(ValueError, match="version is 9; expected one of: 7, 8, 12, 18, 19, 20"):
        RefereeParameters(version=9)
    with pytest.raises(ValueError, match="version is 9; expected one of: 7, 8, 12, 18, 19, 20"):
        write_packet(SITUATION, 9)


@pytest.mark.parametrize("version", VERSIONS)
def test_times_and_scores_beyond_a_field_are_written_as_near_as_it_goes(version: int) -> None:
    long = replace(SITUATION, seconds_remaining=36000, phase_seconds=3600)
    own = replace(OWN, players=(PlayerSituation(Removal.INACTIVE, 4000),))
    state = seen(replace(long, teams=(OTHER, own)), version)
    assert state.seconds_remaining == (36000 if version == 7 else 32767)
    assert state.seconds_till_unpenalised == (4000 if version == 7 else 255)
