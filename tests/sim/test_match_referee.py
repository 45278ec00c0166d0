"""The referee of a match judges made-up truths: goals, falls, removals, and who wins."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_sim.match_places import CLEARANCE, beside_touch_line, in_map_of, keeper_place, striker_and_ball
from tulip_sim.match_referee import MatchReferee, Order
from tulip_sim.match_report import MatchReport, TrialRecord, decide
from tulip_sim.match_rules import MatchRules, Role
from tulip_sim.truth import Truth
from tulip_strategy.game_controller import TeamColour
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.interface import GamePhase

FIELD = load_field()
LYING = (0.0, math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4))
OVER = FIELD.opponent_goal.x + 0.2  # [m] the ball is wholly over the goal line
RULES = MatchRules(trials=2, extra_pairs=0)
PREPARATION = RULES.initial_time + RULES.ready_time + RULES.set_time


class Game:
    """A referee, two robots that are where they are put, and a ball."""

    def __init__(self, rules: MatchRules = RULES) -> None:
        self.referee = MatchReferee(rules, FIELD, 1)
        self.time = 0.0
        self.orders: list[Order] = []
        self.packets: list[bytes] = []
        self.poses = list(self.referee.places[0])
        self.lying = [False, False]
        self.ball = (0.0, 0.0)
        self.touches = [(0, 0), (0, 0)]

    def truth(self, robot: int) -> Truth:
        still, pose = np.zeros(3), self.poses[robot]
        upright = (0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2))
        return Truth(
            stamp=round(self.time * 1e9),
            base_position=np.array([pose.x, pose.y, 0.2 if self.lying[robot] else 0.8]),
            base_orientation=np.array(LYING if self.lying[robot] else upright),
            base_linear_velocity=still,
            base_angular_velocity=still,
            joint_positions=np.zeros(14),
            joint_velocities=np.zeros(14),
            ball_position=np.array([*self.ball, 0.0935]),
            ball_orientation=np.array((0.0, 0.0, 0.0, 1.0)),
            ball_linear_velocity=still,
            ball_angular_velocity=still,
            keeper=None,
            keeper_path=(),
            foot_touches=self.touches[robot],
            body_touches=0,
            keeper_touches=0,
            poles=True,
        )

    def go(self, seconds: float, step: float = 0.1) -> None:
        """Let time pass; people carry out orders at once."""
        for _ in range(max(1, round(seconds / step))):
            self.time += step
            packet = self.referee.update([self.truth(0), self.truth(1)])
            if packet is not None:
                self.packets.append(packet)
            for order in self.referee.take_orders():
                self.orders.append(order)
                for each in order.robots:
                    self.poses[each.robot], self.lying[each.robot] = each.pose, False
                if order.ball is not None:
                    self.ball = order.ball

    def play(self) -> None:
        """Go on to the next play."""
        for _ in range(1000):
            if self.referee.phase is GamePhase.PLAYING:
                return
            self.go(0.1)
        raise AssertionError("no play begins")

    def said(self, words: str) -> int:
        return sum(words in line.text for line in self.referee.report.log)

    def heard_by(self, team: int) -> GameInput:
        heard = GameInput(GameInputParameters(RULES.team_numbers[team], 1, (TeamColour.CYAN, TeamColour.MAGENTA)[team]))
        assert heard.receive(self.packets[-1], 0) is None
        return heard


def playing(rules: MatchRules = RULES) -> Game:
    game = Game(rules)
    game.play()
    return game


def test_a_trial_begins_with_both_robots_and_the_ball_set_down_and_goes_through_all_phases() -> None:
    game = Game()
    phases = []
    for _ in range(round((PREPARATION + 1.0) / 0.1)):
        game.go(0.1)
        phases.append(game.referee.phase)
    assert phases == sorted(phases)
    assert set(phases) == {GamePhase.INITIAL, GamePhase.READY, GamePhase.SET, GamePhase.PLAYING}
    (order,) = game.orders
    assert [each.role for each in order.robots] == [Role.STRIKER, Role.KEEPER]
    assert order.ball is not None
    assert tuple(each.pose for each in order.robots) == game.referee.places[0]


def test_roles_change_with_each_trial_and_the_score_belongs_to_the_teams() -> None:
    game = playing()
    assert [team.goalkeeper for team in game.referee.situation().teams] == [0, RULES.player_number]
    game.ball = (OVER, 0.3)
    game.go(0.1)
    assert game.referee.report.score == (1, 0)
    game.play()
    assert game.referee.roles == (Role.KEEPER, Role.STRIKER)
    assert [team.goalkeeper for team in game.referee.situation().teams] == [RULES.player_number, 0]
    game.ball = (-OVER, 0.3)  # the second team attacks the other goal
    game.go(0.1)
    report = game.referee.report
    assert (report.score, report.winner, report.decided_by) == ((1, 1), None, "draw")
    assert [(each.striker, each.result) for each in report.trials] == [(0, "goal"), (1, "goal")]
    assert [str(line) for line in report.log][-2].endswith("trial 2, magenta strikes: goal after 0.1 s, 1:1")


def test_a_ball_in_the_strikers_own_goal_counts_for_the_other_team() -> None:
    game = playing()
    game.ball = (-OVER, 0.3)
    game.go(0.1)
    assert game.referee.report.score == (0, 1)
    assert game.referee.report.trials[0].result == "own goal"


@pytest.mark.parametrize(
    ("ball", "seconds", "result"), [((0.0, 3.4), 0.1, "out"), ((1.0, 1.0), RULES.playing_time + 1.0, "time")]
)
def test_a_trial_ends_without_a_goal(ball: tuple[float, float], seconds: float, result: str) -> None:
    game = playing()
    game.ball = ball
    game.go(seconds)
    assert [each.result for each in game.referee.report.trials] == [result]
    assert game.referee.report.score == (0, 0)


def test_a_ball_at_rest_at_the_keepers_feet_is_held_after_its_time_and_not_before() -> None:
    game = playing()
    keeper = game.poses[1]
    game.ball = (keeper.x - 0.3, keeper.y)
    game.go(RULES.held_time - 0.2)
    assert game.referee.report.trials == []
    game.ball = (keeper.x - 0.6, keeper.y)  # out of its reach: the time begins anew
    game.go(0.2)
    game.ball = (keeper.x - 0.3, keeper.y)
    game.go(RULES.held_time - 0.2)
    assert game.referee.report.trials == []
    game.go(0.5)
    assert game.referee.report.trials[0].result == "held"


def test_a_robot_that_lies_too_long_is_taken_out_told_so_and_set_back_at_the_line() -> None:
    game = playing()
    game.lying[1] = True
    game.go(RULES.lying_limit - 1.0)
    assert game.said("taken out") == 0
    game.go(1.5)
    assert game.said("magenta has lain for 20 s and is taken out for 30 s") == 1
    (down,) = game.orders[-1].robots
    assert down.robot == 1
    assert abs(down.pose.y) > FIELD.width / 2.0 + 0.3  # beside the touch line
    state = game.heard_by(1).state(0)
    assert state is not None and state.penalty != 0 and 28 <= state.seconds_till_unpenalised <= 30
    other = game.heard_by(0).state(0)
    assert other is not None and other.penalty == 0
    game.go(RULES.removal_time)
    (back,) = game.orders[-1].robots
    assert (back.robot, back.role) == (1, Role.KEEPER)
    assert abs(back.pose.y) == pytest.approx(FIELD.width / 2.0)
    state = game.heard_by(1).state(0)
    assert state is not None and state.penalty == 0
    assert game.referee.report.trials == []  # the trial went on meanwhile


def test_two_robots_that_are_taken_out_and_set_back_together_do_not_stand_in_one_another() -> None:
    game = playing()
    game.poses = [Pose2D(1.0, 1.0, 0.0), Pose2D(1.3, 1.0, 0.0)]
    game.ball = (2.0, 1.0)
    game.lying = [True, True]
    game.go(RULES.lying_limit + 0.5)
    assert game.said("is taken out") == 2
    for _ in range(2):
        assert math.dist((game.poses[0].x, game.poses[0].y), (game.poses[1].x, game.poses[1].y)) >= CLEARANCE
        game.go(RULES.removal_time)
    assert game.said("is set back in") == 2


def test_a_striker_that_cannot_come_back_in_time_ends_the_trial() -> None:
    game = playing()
    game.go(RULES.playing_time - RULES.removal_time - RULES.lying_limit + 2.0)
    game.lying[0] = True
    game.go(RULES.lying_limit + 1.0)
    record = game.referee.report.trials[0]
    assert (record.result, record.falls, record.removals) == ("fallen", (1, 0), 1)


def test_a_striker_taken_out_for_the_second_time_ends_the_trial() -> None:
    game = playing()
    for _ in range(2):
        game.poses[0] = Pose2D(0.0, FIELD.width / 2.0 + 0.6, 0.0)
        game.go(0.2)
        if game.referee.report.trials:
            break
        game.go(RULES.removal_time + RULES.hands_time + 0.5)
    assert game.said("cyan has left the field") == 2
    assert game.referee.report.trials[0].result == "striker left the field"


def test_a_keeper_that_leaves_its_area_too_early_is_set_back_once_and_may_leave_when_the_ball_has_moved() -> None:
    game = playing()
    game.poses[1] = Pose2D(2.5, 0.0, math.pi)
    game.go(3.0)
    assert game.said("set back") == 1
    assert game.poses[1] == keeper_place(1, FIELD)
    game.ball = (game.ball[0] + 0.3, game.ball[1])
    game.go(0.1)
    game.poses[1] = Pose2D(2.5, 0.0, math.pi)
    game.go(3.0)
    assert game.said("set back") == 1


def test_a_robot_in_peoples_hands_is_not_judged() -> None:
    game = playing()
    game.lying[1] = True
    game.go(1.0)
    game.ball = (OVER, 0.3)
    game.go(0.1)
    assert game.referee.report.trials[0].falls == (0, 1)
    game.referee.take_orders()
    game.go(RULES.finished_time)
    game.lying[1] = True  # lies until it is picked up
    game.go(0.5)
    game.lying[1] = False
    game.play()
    game.ball = (-OVER, 0.3)
    game.go(0.1)
    assert game.referee.report.trials[1].falls == (0, 0)


def test_touches_are_counted_for_each_trial_apart() -> None:
    game = playing()
    game.touches = [(2, 1), (1, 0)]
    game.ball = (OVER, 0.3)
    game.go(0.1)
    game.play()
    game.touches = [(2, 2), (1, 4)]
    game.ball = (-OVER, 0.3)
    game.go(0.1)
    counts = [(each.striker_touches, each.keeper_touches) for each in game.referee.report.trials]
    assert counts == [(3, 1), (4, 1)]


def test_a_level_score_is_followed_by_extra_trials_in_pairs_until_the_rules_end_them() -> None:
    game = Game(replace(RULES, extra_pairs=1))
    while not game.referee.report.finished:
        game.play()
        game.ball = (0.0, 3.4)
        game.go(0.1)
    assert len(game.referee.report.trials) == 4
    assert game.said("level") == 1
    assert (game.referee.report.winner, game.referee.report.decided_by) == (None, "draw")


def _record(number: int, result: str, seconds: float) -> TrialRecord:
    return TrialRecord(number, (number - 1) % 2, result, seconds, (0, 0), (0, 0), 0, 0, 0)


def test_who_wins() -> None:
    level = [_record(1, "goal", 40.0), _record(2, "goal", 30.0)]
    assert decide(MatchReport((1, 0), level[:1]), 2, 1) is None
    assert decide(MatchReport((2, 1), level), 2, 1) == (0, "goals")
    assert decide(MatchReport((1, 1), level), 2, 1) is None
    assert decide(MatchReport((1, 1), level), 2, 0) == (1, "fewer seconds to goal")
    extra = [*level, _record(3, "out", 3.0), _record(4, "goal", 3.0)]
    assert decide(MatchReport((1, 2), extra[:3]), 2, 1) is None
    assert decide(MatchReport((1, 2), extra), 2, 1) == (1, "extra trials")


def test_the_report_survives_the_way_through_plain_data() -> None:
    game = playing()
    game.ball = (OVER, 0.3)
    game.go(0.1)
    assert MatchReport.from_dict(game.referee.report.as_dict()) == game.referee.report


def test_both_sides_of_a_pair_get_the_same_start_with_the_ball_behind_the_striker() -> None:
    for seed in range(200):
        starts = [striker_and_ball(np.random.default_rng(seed), team, FIELD) for team in (0, 1)]
        own = [in_map_of(team, robot) for team, (robot, _) in enumerate(starts)]
        assert (own[0].x, own[0].y, own[0].yaw) == pytest.approx((own[1].x, own[1].y, own[1].yaw))
        robot, ball = starts[0]
        assert robot.inverse().transform(ball)[0] < 0.0
        assert robot.x < 0.0
        assert abs(ball[0]) < FIELD.length / 2.0 and abs(ball[1]) < FIELD.width / 2.0


def test_places_beside_the_line_keep_clear_of_poles_ball_and_the_other_robot() -> None:
    others = [(0.4, 3.4), (-1.5, 3.0)]
    for x in np.linspace(-5.0, 5.0, 41):
        pose = beside_touch_line(float(x), 0.1, 0.4, others, FIELD)
        things = [*others, *((pole.x, pole.y) for pole in FIELD.poles)]
        assert min(math.dist((pose.x, pose.y), thing) for thing in things) >= CLEARANCE
        assert abs(pose.x) <= FIELD.length / 2.0
        assert pose.transform((1.0, 0.0))[1] < pose.y  # looks to the field


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"trials": 0}, "trials is 0"), ({"team_numbers": (3, 3)}, "different"), ({"held_time": 0.0}, "held_time is 0")],
)
def test_rules_out_of_range_are_named(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        MatchRules(**changes)  # type: ignore[arg-type]
