"""The referee of a match between two robots: judges from the ground truth, and tells people what to do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_sim.judging import SECOND, FallWatch, OutWatch, Verdict, in_goal, phase_after
from tulip_sim.match_places import (
    OUTSIDE,
    Point,
    beside_touch_line,
    in_map_of,
    keeper_place,
    striker_and_ball,
)
from tulip_sim.match_report import LogLine, MatchReport, TrialRecord, decide
from tulip_sim.match_rules import COLOUR_NAMES, COLOURS, TEAMS, MatchRules, Role, striker_of
from tulip_sim.referee import Result
from tulip_sim.referee_packets import write_packet
from tulip_sim.situation import PlayerSituation, Removal, Situation, TeamSituation
from tulip_sim.truth import Truth
from tulip_strategy.interface import GamePhase


@dataclass(frozen=True)
class SetDown:
    """A robot shall be set on its feet.

    Attributes:
        robot: 0 or 1.
        pose: Where, in the world's map.
        role: What its team tells it to do from then on.
    """

    robot: int
    pose: Pose2D
    role: Role


@dataclass(frozen=True)
class Order:
    """What people shall do now.

    Attributes:
        robots: Those to be set down.
        ball: Where the ball shall be put [m], or None for where it is.
    """

    robots: tuple[SetDown, ...]
    ball: Point | None = None


class _Removed:
    """A robot that is out of play."""

    def __init__(self, reason: Removal, until: int) -> None:
        self.reason, self.until = reason, until


class MatchReferee:
    """Runs a match from its first trial to its last. Give it the truth about both robots at every control tick."""

    def __init__(self, rules: MatchRules, field: Field, seed: int) -> None:
        """Prepare the first trial.

        Args:
            rules: Of the match.
            field: Played on, in the world's map.
            seed: Of where the strikers and the balls are put.
        """
        self._rules, self._field, self._seed = rules, field, seed
        self._report = MatchReport()
        self._packets = 0
        self._next_packet = 0
        self._told: object = None
        self._now = 0
        self._orders: list[Order] = []
        self._in_hands_until = [0, 0]  # [ns]
        self._set_down_at: list[Pose2D | None] = [None, None]  # the last place of each
        self._scored: tuple[list[bool], list[bool]] = ([], [])
        self._began: int | None = None
        self._trial = 0
        self._next_trial()

    @property
    def report(self) -> MatchReport:
        """Everything so far."""
        return self._report

    @property
    def trial(self) -> int:
        """Number of the present trial, from 1 on."""
        return self._trial

    @property
    def roles(self) -> tuple[Role, Role]:
        """Of both robots in the present trial."""
        return (Role.STRIKER, Role.KEEPER) if self._striker == 0 else (Role.KEEPER, Role.STRIKER)

    @property
    def places(self) -> tuple[tuple[Pose2D, Pose2D], Point]:
        """Where robots and ball are put at the beginning of the present trial."""
        return self._places, self._ball_place

    @property
    def phase(self) -> GamePhase:
        """The game's phase at the last truth."""
        if self._result is not None:
            return GamePhase.FINISHED
        p = self._rules
        return phase_after(self._elapsed(), p.initial_time, p.ready_time, p.set_time)

    @property
    def played(self) -> float:
        """Time since the beginning of play in this trial [s]."""
        return self._played if self._result is not None else max(0.0, self._elapsed() - self._preparation())

    def verdict(self, robot: int) -> Verdict:
        """Return what there is to say about a robot now."""
        outcome = "" if self._result is None else self._result.value
        first, second = self._report.score
        fall = self._falls[robot]
        score = (first, second) if robot == 0 else (second, first)
        return Verdict(outcome, score, fall.since is not None, fall.falls, self.played)

    def take_orders(self) -> tuple[Order, ...]:
        """Return what people shall do since the last time."""
        orders, self._orders = tuple(self._orders), []
        return orders

    def update(self, truths: Sequence[Truth]) -> bytes | None:
        """Judge what is, given the truths about both robots; return the packet that is due, if one is."""
        now = self._now = truths[0].stamp
        if self._began is None:
            self._began = now
            self._touched = _touches(truths)
            self._say(f"trial {self._trial}: {self._name(self._striker)} strikes, {self._name(self._keeper)} keeps")
        if self._result is not None:
            if not self._report.finished and now - self._ended >= self._rules.finished_time * SECOND:
                self._next_trial()
                return self.update(truths)
        else:
            for robot in TEAMS:
                if now < self._in_hands_until[robot]:
                    self._falls[robot].lift()
                else:
                    self._falls[robot].see(truths[robot].base_orientation, now)
            if self.phase is GamePhase.PLAYING:
                self._watch(truths)
                self._judge(truths)
        return self._packet()

    def situation(self) -> Situation:
        """Return the game as it is now."""
        rules = self._rules
        teams = []
        for team in TEAMS:
            players = [PlayerSituation()] * rules.player_number
            removed = self._removed[team]
            if removed is not None:
                left = max(0, math.ceil((removed.until - self._now) / SECOND))
                players[-1] = PlayerSituation(removed.reason, left)
            teams.append(
                TeamSituation(
                    rules.team_numbers[team],
                    COLOURS[team],
                    self._report.score[team],
                    tuple(players),
                    tuple(self._scored[team]),
                    goalkeeper=rules.player_number if team == self._keeper else 0,
                )
            )
        return Situation(
            phase=self.phase,
            first_half=True,
            striker=self._striker,
            seconds_remaining=max(0, math.ceil(rules.playing_time - self.played)),
            phase_seconds=math.ceil(self._phase_left()),
            teams=(teams[0], teams[1]),
            packet_number=self._packets,
        )

    def _next_trial(self) -> None:
        """Begin the next trial with the next truth."""
        self._trial += 1
        self._striker = striker_of(self._trial)
        self._keeper = 1 - self._striker
        pair = (self._trial - 1) // 2  # both sides of a pair get the same start, each in its own map
        rng = np.random.default_rng([self._seed, 5, pair])
        robot, self._ball_place = striker_and_ball(rng, self._striker, self._field)
        keeper = keeper_place(self._keeper, self._field)
        self._places = (robot, keeper) if self._striker == 0 else (keeper, robot)
        self._began = None
        self._result: Result | None = None
        self._ended, self._played = 0, 0.0
        self._falls = tuple(FallWatch(self._rules.lying_tilt) for _ in TEAMS)
        self._outs = OutWatch(self._field)
        self._removed: list[_Removed | None] = [None, None]
        self._removals = [0, 0]
        self._touched = ((0, 0), (0, 0))
        self._plays = self._moved = False
        self._held_since: int | None = None
        self._told_fall = [False, False]
        roles = self.roles
        self._order([SetDown(team, self._places[team], roles[team]) for team in TEAMS], self._ball_place)

    def _watch(self, truths: Sequence[Truth]) -> None:
        """Look after the robots: who fell, who leaves the field, who may come back."""
        rules, now = self._rules, self._now
        if not self._plays:
            self._plays = True
            self._say(f"trial {self._trial}: play begins")
        ball = truths[0].ball_position
        if not self._moved and math.dist(ball[:2], self._ball_place) > rules.ball_moved:
            self._moved = True
            self._say(f"trial {self._trial}: the ball moves after {self.played:.1f} s")
        for robot in TEAMS:
            fall, removed = self._falls[robot], self._removed[robot]
            if removed is not None:
                if now >= removed.until:
                    self._set_back(robot, truths)
                continue
            if now < self._in_hands_until[robot]:
                continue
            place = truths[robot].footprint
            lies = fall.since is not None
            if lies and not self._told_fall[robot]:
                self._say(f"trial {self._trial}: {self._name(robot)} falls after {self.played:.1f} s")
            self._told_fall[robot] = lies
            if fall.lying_for(now) >= rules.lying_limit:
                self._remove(robot, Removal.INACTIVE, f"has lain for {rules.lying_limit:.0f} s", truths)
            elif self._is_off(place):
                self._remove(robot, Removal.LEFT_FIELD, "has left the field", truths)
            elif robot == self._keeper and not self._moved and self._leaves_area(place):
                self._say(f"trial {self._trial}: {self._name(robot)} left its goal area too early and is set back")
                self._order([SetDown(robot, self._places[robot], Role.KEEPER)])

    def _judge(self, truths: Sequence[Truth]) -> None:
        """End the trial if the rules do now."""
        ball, field, rules = truths[0].ball_position, self._field, self._rules
        goals = (field.opponent_goal, field.own_goal)  # attacked by the first and by the second team
        removed = self._removed[self._striker]
        if in_goal(ball, goals[self._striker], field):
            self._score(self._striker)
            self._end(Result.GOAL, truths)
        elif in_goal(ball, goals[self._keeper], field):
            self._score(self._keeper)
            self._end(Result.OWN_GOAL, truths)
        elif self._outs.leaves(ball):
            self._end(Result.OUT, truths)
        elif self.played >= rules.playing_time:
            self._end(Result.TIME, truths)
        elif self._is_held(truths):
            self._end(Result.HELD, truths)
        elif removed is not None and (
            self._removals[self._striker] > rules.most_removals
            or self.played + (removed.until - self._now) / SECOND >= rules.playing_time
        ):
            self._end(Result.FALLEN if removed.reason is Removal.INACTIVE else Result.LEFT, truths)

    def _is_held(self, truths: Sequence[Truth]) -> bool:
        """Tell whether the ball has rested at the goalkeeper's feet for too long."""
        rules, truth = self._rules, truths[self._keeper]
        speed = float(np.linalg.norm(truth.ball_linear_velocity))
        near = math.dist(truth.ball_position[:2], (truth.footprint.x, truth.footprint.y)) < rules.held_reach
        rests = self._removed[self._keeper] is None and near and speed < rules.held_speed
        if not rests:
            self._held_since = None
        elif self._held_since is None:
            self._held_since = self._now
        return self._held_since is not None and self._now - self._held_since >= rules.held_time * SECOND

    def _is_off(self, place: Pose2D) -> bool:
        margin = self._rules.leave_margin
        return abs(place.x) > self._field.length / 2.0 + margin or abs(place.y) > self._field.width / 2.0 + margin

    def _leaves_area(self, place: Pose2D) -> bool:
        """Tell whether a place of the goalkeeper is outside its goal area."""
        own, field, margin = in_map_of(self._keeper, place), self._field, self._rules.keeper_margin
        beyond = own.x - (field.own_goal.x + field.goal_area_depth)
        return max(beyond, abs(own.y) - field.goal_area_width / 2.0) > margin

    def _remove(self, robot: int, reason: Removal, words: str, truths: Sequence[Truth]) -> None:
        """Take a robot out of play and off the field."""
        seconds = self._rules.removal_time
        self._removed[robot] = _Removed(reason, self._now + round(seconds * SECOND))
        self._removals[robot] += 1
        self._say(f"trial {self._trial}: {self._name(robot)} {words} and is taken out for {seconds:.0f} s")
        self._put_beside(robot, OUTSIDE, truths)

    def _set_back(self, robot: int, truths: Sequence[Truth]) -> None:
        """Put a robot back into play, on the touch line."""
        self._removed[robot] = None
        self._say(f"trial {self._trial}: {self._name(robot)} is set back in")
        self._put_beside(robot, 0.0, truths)

    def _put_beside(self, robot: int, outside: float, truths: Sequence[Truth]) -> None:
        here, other = truths[robot].footprint, truths[1 - robot].footprint
        ball = truths[robot].ball_position
        occupied = [(other.x, other.y), (float(ball[0]), float(ball[1]))]
        bound_for = self._set_down_at[1 - robot]
        if bound_for is not None and self._now < self._in_hands_until[1 - robot]:
            occupied.append((bound_for.x, bound_for.y))
        pose = beside_touch_line(here.x, here.y, outside, occupied, self._field)
        self._order([SetDown(robot, pose, self.roles[robot])])

    def _order(self, robots: Sequence[SetDown], ball: Point | None = None) -> None:
        """Have robots set down; they are not judged until that is done."""
        self._orders.append(Order(tuple(robots), ball))
        for each in robots:
            self._in_hands_until[each.robot] = self._now + round(self._rules.hands_time * SECOND)
            self._set_down_at[each.robot] = each.pose

    def _score(self, team: int) -> None:
        first, second = self._report.score
        self._report.score = (first + 1, second) if team == 0 else (first, second + 1)

    def _end(self, result: Result, truths: Sequence[Truth]) -> None:
        """End the trial, and the match with it if it is decided."""
        self._played = self.played
        self._result, self._ended = result, self._now
        self._scored[self._striker].append(result is Result.GOAL)
        self._removed = [None, None]  # the next trial begins with both
        touches = [sum(now) - sum(before) for now, before in zip(_touches(truths), self._touched, strict=True)]
        report = self._report
        report.trials.append(
            TrialRecord(
                number=self._trial,
                striker=self._striker,
                result=result.value,
                seconds=round(self._played, 3),
                score=report.score,
                falls=(self._falls[self._striker].falls, self._falls[self._keeper].falls),
                removals=sum(self._removals),
                striker_touches=touches[self._striker],
                keeper_touches=touches[self._keeper],
            )
        )
        score, who = f"{report.score[0]}:{report.score[1]}", self._name(self._striker)
        self._say(f"trial {self._trial}, {who} strikes: {result.value} after {self._played:.1f} s, {score}")
        verdict = decide(report, self._rules.trials, self._rules.extra_pairs)
        if verdict is not None:
            report.winner, report.decided_by = verdict
            self._say(f"the match is over: {report.verdict}")
        elif self._trial >= self._rules.trials and self._trial % 2 == self._rules.trials % 2:
            self._say("the score is level: one more trial a side")

    def _packet(self) -> bytes | None:
        told = (self._trial, self.phase, tuple(each is not None for each in self._removed))
        if self._now < self._next_packet and told == self._told:
            return None
        self._told = told
        while self._next_packet <= self._now:
            self._next_packet += round(self._rules.packet_period * SECOND)
        packet = write_packet(self.situation(), self._rules.version)
        self._packets += 1
        return packet

    def _say(self, text: str) -> None:
        self._report.log.append(LogLine(round(self._now / SECOND, 3), self._trial, text, self._report.score))

    def _name(self, team: int) -> str:
        return COLOUR_NAMES[team]

    def _elapsed(self) -> float:
        return 0.0 if self._began is None else (self._now - self._began) / SECOND

    def _preparation(self) -> float:
        return self._rules.initial_time + self._rules.ready_time + self._rules.set_time

    def _phase_left(self) -> float:
        """Time left of the ready or set phase [s], else 0."""
        rules, phase = self._rules, self.phase
        if phase is GamePhase.READY:
            return rules.initial_time + rules.ready_time - self._elapsed()
        return self._preparation() - self._elapsed() if phase is GamePhase.SET else 0.0


def _touches(truths: Sequence[Truth]) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return for each robot how often its feet, and the rest of it, have met the ball since the world began."""
    first, second = ((sum(truth.foot_touches), truth.body_touches) for truth in truths)
    return first, second
