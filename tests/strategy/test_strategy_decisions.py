from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from kinematic_bench import game_state, motion_state, seen_object

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_motion.interface import HeadMode, MotionMode, Side, WalkMode
from tulip_strategy.interface import Decision, GamePhase, UserCommand, UserRequest
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_worldmodel.world_state import ObjectEstimate, RobotEstimate, WorldState

PLAY = UserCommand(0, UserRequest.PLAY)
TICK = 66_666_667  # [ns] 15 Hz
FIELD = load_field()
PARAMETERS = StrategyParameters()
ROBOT = Pose2D(1.0, 0.2, -0.2)  # faces the side of the goal that the keeper leaves free
KEEPER = seen_object(ROBOT, (4.4, 0.5), (0.0, 0.0))


def ball_at(x: float, y: float, age: float = 0.0) -> ObjectEstimate:
    """A resting ball, given in base_footprint."""
    return seen_object(ROBOT, ROBOT.transform((x, y)), (0.0, 0.0), age)


def world(ball: ObjectEstimate | None, stamp: int = 0) -> WorldState:
    return WorldState(stamp, RobotEstimate(ROBOT, np.eye(3) * 0.01, Pose2D(5.0, 5.0, 2.0) @ ROBOT), ball, (KEEPER,))


class Player:
    """Strategy with the last inputs at hand; each call is one tick later."""

    def __init__(self, parameters: StrategyParameters = PARAMETERS) -> None:
        self.strategy = Strategy(parameters, FIELD)
        self.stamp = 0

    def tick(
        self,
        ball: ObjectEstimate | None = None,
        phase: GamePhase = GamePhase.PLAYING,
        user: UserCommand = PLAY,
        mode: MotionMode = MotionMode.STAND,
        penalty: int = 0,
    ) -> Decision:
        self.stamp += TICK
        game = game_state(self.stamp, phase, penalty)
        return self.strategy.decide(self.stamp, world(ball, self.stamp), game, user, motion_state(self.stamp, mode))

    def ticks(
        self, seconds: float, ball: ObjectEstimate | None = None, mode: MotionMode = MotionMode.STAND
    ) -> list[Decision]:
        return [self.tick(ball, mode=mode) for _ in range(round(seconds * 1e9 / TICK))]


@pytest.mark.parametrize("phase", [GamePhase.INITIAL, GamePhase.READY, GamePhase.SET, GamePhase.FINISHED])
def test_robot_stands_in_every_phase_but_playing(phase: GamePhase) -> None:
    decision = Player().tick(ball_at(1.0, 0.0), phase)
    assert decision.walk.mode is WalkMode.STAND
    assert decision.kick is None
    assert phase.name.lower() in decision.tree


def test_robot_walks_to_its_place_in_ready_if_it_shall() -> None:
    player = Player(replace(PARAMETERS, walk_to_ready=True, ready_x=3.0))
    decisions = [player.tick(None, GamePhase.READY) for _ in range(30)]
    assert decisions[-1].walk.mode is WalkMode.WALK
    assert decisions[-1].walk.velocity[0] > 0.1


def test_penalised_robot_stands() -> None:
    decision = Player().tick(ball_at(1.0, 0.0), penalty=5)
    assert decision.walk.mode is WalkMode.STAND
    assert "penalised" in decision.tree


def test_robot_stands_before_the_first_world_state_and_the_first_packet() -> None:
    strategy = Strategy(PARAMETERS, FIELD)
    for seen, game in ((None, game_state(0)), (world(ball_at(1, 0)), None)):
        assert strategy.decide(0, seen, game, PLAY, None).walk.mode is WalkMode.STAND


def test_robot_keeps_to_the_last_packet_when_the_referee_falls_silent() -> None:
    strategy = Strategy(PARAMETERS, FIELD)
    late = 60 * 10**9
    silent = replace(game_state(0), stale=True)
    assert strategy.decide(late, world(ball_at(1, 0)), silent, PLAY, None).walk.mode is WalkMode.WALK


@pytest.mark.parametrize(
    ("request_", "mode"),
    [
        (UserRequest.STOP, WalkMode.STAND),
        (UserRequest.STAND, WalkMode.STAND),
        (UserRequest.LIMP, WalkMode.LIMP),
    ],
)
def test_the_user_comes_before_the_referee(request_: UserRequest, mode: WalkMode) -> None:
    assert Player().tick(ball_at(1.0, 0.0), user=UserCommand(0, request_)).walk.mode is mode


def test_walk_test_walks_with_the_users_velocity_inside_the_limits() -> None:
    player = Player()
    command = UserCommand(0, UserRequest.WALK_TEST, velocity=(1.0, 0.0, -2.0))
    for _ in range(60):
        decision = player.tick(None, GamePhase.INITIAL, user=command)
    assert decision.walk.velocity == pytest.approx((PARAMETERS.forward_speed, 0.0, -PARAMETERS.turning_speed))


def test_kick_test_kicks_once_a_command_with_the_foot_named() -> None:
    player = Player()
    command = UserCommand(0, UserRequest.KICK_TEST, argument="left", sequence=4)
    first = player.tick(None, GamePhase.INITIAL, command)
    assert first.kick is not None
    assert first.kick.side is Side.LEFT
    after = [player.tick(None, GamePhase.INITIAL, command, MotionMode.KICK) for _ in range(20)]
    after += [player.tick(None, GamePhase.INITIAL, command) for _ in range(20)]
    assert [decision.kick for decision in after] == [None] * 40
    again = player.tick(None, GamePhase.INITIAL, replace(command, sequence=5, argument="right"))
    assert again.kick is not None
    assert again.kick.side is Side.RIGHT


def test_fallen_robot_stays_limp_until_the_user_lets_it_stand() -> None:
    player = Player()
    assert player.tick(ball_at(1.0, 0.0), mode=MotionMode.FALLEN).walk.mode is WalkMode.LIMP
    stand = UserCommand(0, UserRequest.STAND)
    assert player.tick(ball_at(1.0, 0.0), user=stand, mode=MotionMode.FALLEN).walk.mode is WalkMode.STAND


def test_unknown_strategy_stands() -> None:
    decision = Player().tick(ball_at(1.0, 0.0), user=replace(PLAY, strategy="zone defence"))
    assert decision.walk.mode is WalkMode.STAND
    assert decision.tree.startswith("robot > playing > unknown strategy")


def test_without_a_ball_it_sweeps_the_head_then_turns_round_then_changes_place() -> None:
    player = Player()
    sweep = player.ticks(PARAMETERS.sweep_time - 0.2)
    assert {(d.head.mode, d.walk.mode) for d in sweep} == {(HeadMode.SEARCH, WalkMode.STAND)}
    player.ticks(1.0)
    turn = player.tick()
    assert turn.walk.mode is WalkMode.WALK
    assert turn.walk.velocity[0] == 0.0
    assert turn.walk.velocity[2] > 0.1
    later = player.ticks(2.0 * math.pi / PARAMETERS.search_turn_speed)[-1]
    assert later.tree.endswith("go to the middle")


def test_a_lost_ball_is_looked_for_where_it_was_first() -> None:
    player = Player()
    player.tick(ball_at(1.5, -0.5))
    decision = player.tick(ball_at(1.5, -0.5, age=PARAMETERS.ball_lost_age + 0.1))
    assert decision.tree.endswith("look where it was")
    assert decision.head.mode is HeadMode.LOOK_AT
    assert decision.head.target == pytest.approx((1.5, -0.5, FIELD.ball_radius))
    turn = player.ticks(PARAMETERS.look_back_time + PARAMETERS.sweep_time + 2.0)[-1]
    assert turn.walk.velocity[2] < 0.0  # to the side where it went


def test_a_ball_seen_again_must_be_fresh() -> None:
    player = Player()
    assert "find ball" in player.tick(ball_at(1.5, 0.0, age=1.0)).tree
    assert "find ball" not in player.tick(ball_at(1.5, 0.0, age=0.1)).tree
    assert "find ball" not in player.tick(ball_at(1.5, 0.0, age=1.0)).tree


def test_an_estimate_that_drops_out_for_a_moment_changes_nothing() -> None:
    player = Player()
    player.tick(ball_at(1.5, 0.0))
    gone = player.ticks(PARAMETERS.ball_gone_time - 0.1)
    assert all("find ball" not in decision.tree for decision in gone)
    assert "find ball" in player.ticks(0.3)[-1].tree


def test_the_aim_does_not_turn_with_a_localization_that_jitters() -> None:
    """The yaw estimate jumps by 0.1 rad to either side; dead reckoning tells that the robot stands still."""
    strategy = Strategy(PARAMETERS, FIELD)
    odom = Pose2D(5.0, 5.0, 2.0) @ ROBOT
    turning = []
    for tick in range(100):
        pose = replace(ROBOT, yaw=ROBOT.yaw + 0.1 * (-1) ** tick)
        seen = WorldState(tick * TICK, RobotEstimate(pose, np.eye(3) * 0.01, odom), ball_at(0.7, 0.0), (KEEPER,))
        decision = strategy.decide(tick * TICK, seen, game_state(tick * TICK), PLAY, None)
        turning.append(decision.walk.velocity[2] / PARAMETERS.heading_gain)
    assert "attack" in decision.tree
    assert np.ptp(turning[50:]) < 0.02  # [rad] a tenth of the jitter


def kick_place(side: Side) -> ObjectEstimate:
    """The ball before a foot, on the line to the free side of the goal."""
    lateral = PARAMETERS.kick_lateral * (1 if side is Side.LEFT else -1)
    return ball_at(PARAMETERS.kick_ahead, lateral)


@pytest.mark.parametrize("side", list(Side))
def test_a_ball_before_a_foot_is_kicked_once_after_standing(side: Side) -> None:
    player = Player()
    decisions = player.ticks(2.0, kick_place(side))
    kicks = [decision.kick for decision in decisions if decision.kick is not None]
    assert len(kicks) == 1
    assert kicks[0].side is side
    assert abs(kicks[0].direction) <= PARAMETERS.kick_direction_limit
    ball = ROBOT.transform(kick_place(side).position)
    across = ball[1] + math.tan(ROBOT.yaw + kicks[0].direction) * (FIELD.opponent_goal.x - ball[0])
    assert -0.5 * FIELD.goal_width < across < 0.5 - PARAMETERS.opponent_radius  # past the keeper, who stands at 0.5
    begun = next(index for index, decision in enumerate(decisions) if decision.kick is not None)
    assert all(decision.walk.mode is WalkMode.STAND for decision in decisions[1 : begun + 1])
    during = player.ticks(2.0, kick_place(side), MotionMode.KICK)
    assert all(decision.kick is None and decision.walk.mode is WalkMode.STAND for decision in during)
    assert all(decision.head.mode is HeadMode.LOOK_AT for decision in during)
    after = player.tick(ball_at(2.0, 0.0))
    assert "kick under way" not in after.tree


def test_a_refused_kick_is_tried_again() -> None:
    player = Player()
    decisions = player.ticks(PARAMETERS.kick_start_limit + 1.5, kick_place(Side.RIGHT))
    assert sum(decision.kick is not None for decision in decisions) == 2


def test_no_kick_while_motion_control_still_walks() -> None:
    decisions = Player().ticks(PARAMETERS.kick_settle_limit - 0.3, kick_place(Side.RIGHT), MotionMode.WALK)
    assert all(decision.kick is None for decision in decisions)


def test_a_robot_unsure_of_its_place_glances_at_landmarks_while_it_tracks_the_ball() -> None:
    outwards = Pose2D(2.25, 1.6, math.pi / 2.0)  # the ball ahead has no landmark beside it
    others = (seen_object(outwards, (4.4, 0.0), (0.0, 0.0)),)  # nobody has to look for the keeper
    for spread, glances in ((0.01, False), (0.3, True)):
        strategy = Strategy(PARAMETERS, FIELD.without_poles())
        decisions = []
        for tick in range(100):
            robot = RobotEstimate(outwards, np.eye(3) * spread**2, outwards)
            seen = WorldState(tick * 20_000_000, robot, seen_object(outwards, (2.05, 2.6), (0.0, 0.0)), others)
            decisions.append(strategy.decide(seen.stamp, seen, game_state(seen.stamp), PLAY, None))
        assert {decision.head.mode for decision in decisions} == {HeadMode.TRACK}
        assert any(decision.head.glance is not None for decision in decisions) is glances


def test_the_last_steps_before_a_kick_keep_the_ball_in_view() -> None:
    ball = ball_at(PARAMETERS.kick_ahead + 0.05, 0.0)
    decisions = Player().ticks(1.0, ball, MotionMode.WALK)
    assert any("line up" in decision.tree for decision in decisions)
    assert {decision.head.mode for decision in decisions} == {HeadMode.LOOK_AT}


def test_velocities_keep_the_limits_and_change_no_faster_than_allowed() -> None:
    player = Player()
    rng = np.random.default_rng(1)
    last = np.zeros(3)
    for _ in range(400):
        ball = ball_at(float(rng.uniform(-2, 2)), float(rng.uniform(-2, 2)))
        velocity = np.array(player.tick(ball, mode=MotionMode.WALK).walk.velocity)
        assert -PARAMETERS.backward_speed <= velocity[0] <= PARAMETERS.forward_speed
        assert abs(velocity[1]) <= PARAMETERS.sideways_speed
        assert abs(velocity[2]) <= PARAMETERS.turning_speed
        step = np.abs(velocity - last)
        limits = (PARAMETERS.forward_acceleration, PARAMETERS.sideways_acceleration, PARAMETERS.turning_acceleration)
        stopped = not velocity.any()  # STAND is an order of its own; the legs stop by themselves
        assert stopped or (step <= np.array(limits) * TICK * 1e-9 + 1e-12).all()
        last = velocity


def test_parameters_that_contradict_each_other_are_named() -> None:
    with pytest.raises(ValueError, match=r"kick_wait_ahead is 0.47; expected less than standoff, which is 0.45"):
        StrategyParameters(standoff=0.45)
    with pytest.raises(ValueError, match=r"forward_speed is -1.0; expected > 0"):
        StrategyParameters(forward_speed=-1.0)
    with pytest.raises(ValueError, match=r"kick_range is nan; expected a finite number"):
        StrategyParameters(kick_range=math.nan)
