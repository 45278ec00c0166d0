"""How good recorded and recomputed estimates are, where the recording holds what really was."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tulip_description.field import Field
from tulip_description.planar import wrap_angle
from tulip_description.robot import load_robot
from tulip_ros import topics
from tulip_ros.time import stamp_of
from tulip_sim.messages import truth_from_message
from tulip_sim.perception import Perception, PerceptionParameters
from tulip_sim.recompute.heard import UNIX_TIME, Heard, Made
from tulip_sim.truth import Truth
from tulip_vision.features import FeatureClass
from tulip_vision.lens import head_camera_lens

NEAREST = 30_000_000  # [ns] between a moment and the truth that it is judged by; the truth comes at 50 Hz
KEPT = 100  # truths: 2 s, longer than features take
RANGE = 4.0  # [m] up to which a ball in the picture is expected to be found
NEAR = math.radians(5.0)  # [rad] of azimuth within which a ball counts as found
JUDGED = 100_000_000  # [ns] between two states that are judged: estimates err for longer than that
FRESH = 0.5  # [s] since the ball was seen, up to which its place counts: it may have been kicked since
UPRIGHT = 0.5  # [rad] of the trunk's tilt up to which localization counts


@dataclass(frozen=True)
class Judgement:
    """Estimates against the truth; NaN where there was nothing to judge.

    Attributes:
        position: RMS of the robot's estimated position while it is upright [m].
        heading: The same of its heading [rad].
        ball: Median error of the ball's estimated place, relative to the robot, up to `FRESH` after it was seen [m].
        ball_recall: Share of the pictures that show the ball whole within `RANGE`, in which it was found.
        pictures_with_ball: How many pictures these are.
        latency: Median time from a picture to its features, by simulated log times [s].
    """

    position: float = math.nan
    heading: float = math.nan
    ball: float = math.nan
    ball_recall: float = math.nan
    pictures_with_ball: int = 0
    latency: float = math.nan

    def as_dict(self) -> dict[str, float | None]:
        """Return everything for JSON; what is not known is None."""
        values = asdict(self)
        return {name: None if math.isnan(value) else value for name, value in values.items()}


class _Sums:
    """Errors of one sort of estimates, as they come."""

    def __init__(self) -> None:
        self.position: list[float] = []
        self.heading: list[float] = []
        self.ball: list[float] = []
        self.found: list[bool] = []
        self.latency: list[float] = []
        self.next_state = 0
        """Stamp from which on the next state is judged [ns]."""

    def judgement(self) -> Judgement:
        def rms(values: list[float]) -> float:
            return math.sqrt(float(np.mean(np.square(values)))) if values else math.nan

        def median(values: list[float]) -> float:
            return float(np.median(values)) if values else math.nan

        recall = sum(self.found) / len(self.found) if self.found else math.nan
        return Judgement(
            rms(self.position), rms(self.heading), median(self.ball), recall, len(self.found), median(self.latency)
        )


JUDGED_TOPICS = frozenset((topics.WORLD_STATE.name, topics.FEATURES.name))


class _Moment:
    """What really was at one moment."""

    def __init__(self, heard: Heard, poles: bool) -> None:
        self.stamp = heard.stamp
        self._heard, self._poles = heard, poles

    @cached_property
    def truth(self) -> Truth:
        return truth_from_message(self._heard.message, self._poles)


class Judge:
    """Judges one robot."""

    def __init__(self, field: Field, judged: Collection[str] = JUDGED_TOPICS) -> None:
        """Begin.

        Args:
            field: As the robot's team sees it.
            judged: Topics whose messages count; those that are not computed anew need not.
        """
        self.reads = frozenset((topics.GROUND_TRUTH.name, *(set(judged) & JUDGED_TOPICS)))
        parameters = PerceptionParameters(ball_range=RANGE)
        self._perception = Perception(parameters, field, load_robot(), head_camera_lens())
        self._moments: deque[_Moment] = deque(maxlen=KEPT)
        self._waiting: dict[tuple[str, int], deque[tuple[Heard, _Moment]]] = {}
        self._shows_ball: dict[int, bool] = {}
        self._recorded, self._made = _Sums(), _Sums()
        self._poles = bool(field.poles)

    def take_recorded(self, heard: Heard) -> None:
        """Take a recorded message; it is judged when it turns out that its recomputed counterpart is another one."""
        if heard.name == topics.GROUND_TRUTH.name:
            self._moments.append(_Moment(heard, self._poles))
        elif heard.name in self.reads:
            _add_latency(self._recorded, heard)
            moment = self._moment(heard.stamp)
            if moment is not None:
                self._waiting.setdefault((heard.name, heard.stamp), deque()).append((heard, moment))

    def take_made(self, made: Made, equal: bool) -> None:
        """Take a recomputed message, which is equal to its recorded counterpart or not."""
        if made.name not in self.reads:
            return
        _add_latency(self._made, made)
        waiting = self._waiting.get((made.name, made.stamp))
        if waiting and equal:
            _, moment = waiting.popleft()
            self._judge((self._recorded, self._made), made, moment)
            return
        if waiting:
            self._judge((self._recorded,), *waiting.popleft())
        found = self._moment(made.stamp)
        if found is not None:
            self._judge((self._made,), made, found)

    def judgements(self) -> tuple[Judgement, Judgement]:
        """Return the figures of what was recorded and of what was recomputed, at the end."""
        for waiting in self._waiting.values():
            while waiting:
                self._judge((self._recorded,), *waiting.popleft())
        return self._recorded.judgement(), self._made.judgement()

    def _moment(self, stamp: int) -> _Moment | None:
        """Return the moment nearest to a stamp [ns]."""
        nearest: _Moment | None = None
        for each in reversed(self._moments):
            if nearest is not None and abs(each.stamp - stamp) > abs(nearest.stamp - stamp):
                break
            nearest = each
        return nearest if nearest is not None and abs(nearest.stamp - stamp) <= NEAREST else None

    def _judge(self, sums: Sequence[_Sums], message: Heard | Made, moment: _Moment) -> None:
        if message.name == topics.FEATURES.name:
            self._judge_features(sums, message.message, moment.truth)
        elif due := [each for each in sums if not 0 < each.next_state - message.stamp <= JUDGED]:
            for each in due:
                each.next_state = message.stamp + JUDGED
            _judge_state(due, message.message, moment.truth)

    def _judge_features(self, sums: Sequence[_Sums], features: Any, truth: Truth) -> None:
        stamp = stamp_of(features)
        if stamp not in self._shows_ball:
            self._shows_ball[stamp] = self._perception.ball_in_view(truth)
        if not self._shows_ball[stamp]:
            return
        x, y = truth.footprint.inverse().transform(truth.ball_position[:2])
        azimuth = math.atan2(y - features.camera_position[1], x - features.camera_position[0])
        balls = (each.azimuth for each in features.features if each.kind == FeatureClass.BALL)
        found = any(abs(wrap_angle(each - azimuth)) < NEAR for each in balls)
        for each in sums:
            each.found.append(found)


def _judge_state(sums: Sequence[_Sums], state: Any, truth: Truth) -> None:
    true = truth.footprint
    x, y = truth.base_orientation[:2].tolist()
    upright = 1.0 - 2.0 * (x * x + y * y) > math.cos(UPRIGHT)
    here = true.inverse().transform(truth.ball_position[:2])
    for each in sums:
        if upright:
            each.position.append(math.hypot(state.robot_pose[0] - true.x, state.robot_pose[1] - true.y))
            each.heading.append(wrap_angle(float(state.robot_pose[2]) - true.yaw))
        if state.ball_known and state.ball.age <= FRESH:
            each.ball.append(math.hypot(state.ball.position[0] - here[0], state.ball.position[1] - here[1]))


def _add_latency(sums: _Sums, message: Heard | Made) -> None:
    if message.name == topics.FEATURES.name and message.log_time < UNIX_TIME:
        sums.latency.append((message.log_time - message.stamp) * 1e-9)
