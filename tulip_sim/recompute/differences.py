"""By how much recomputed messages differ from the recorded ones, topic by topic."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tulip_description.planar import wrap_angle
from tulip_ros import topics
from tulip_ros.cdr import without_gaps
from tulip_sim.recompute.heard import Made

NEAR = math.radians(2.0)
"""Two features of a kind that are closer than this are the same one."""


@dataclass
class Difference:
    """Of one topic.

    Attributes:
        recorded, recomputed: How many messages there are.
        equal: How many are equal, byte by byte.
        pairs: How many have a counterpart: the next one with the same stamp.
        largest: Of each quantity, over all pairs.
        squares: Sum of the squares of each quantity.
        first: Log time of the first message that differs [ns], or None.
    """

    recorded: int = 0
    recomputed: int = 0
    equal: int = 0
    pairs: int = 0
    largest: dict[str, float] = field(default_factory=dict)
    squares: dict[str, float] = field(default_factory=dict)
    first: int | None = None

    @property
    def is_none(self) -> bool:
        """Whether all messages are equal."""
        return self.equal == self.recorded == self.recomputed

    @property
    def unmatched(self) -> float:
        """Share of the messages that have no counterpart."""
        total = self.recorded + self.recomputed
        return (total - 2 * self.pairs) / total if total else 0.0

    def rms(self, name: str) -> float:
        """Return the root of the mean square of a quantity, over all pairs."""
        return math.sqrt(self.squares.get(name, 0.0) / self.pairs) if self.pairs else 0.0

    def see(self, quantities: Mapping[str, float]) -> None:
        """Take the quantities of a pair that differs."""
        for name, value in quantities.items():
            self.largest[name] = max(self.largest.get(name, 0.0), value)
            self.squares[name] = self.squares.get(name, 0.0) + value**2


class Comparison:
    """Pairs recorded and recomputed messages of one topic, in the order of their stamps."""

    def __init__(self, name: str) -> None:
        """Begin with none.

        Args:
            name: Of the topic, without namespace.
        """
        self.difference = Difference()
        self._type = next(topic.type_name for topic in topics.TOPICS if topic.name == name)
        self._measure = MEASURES.get(name)
        self._recorded: dict[int, deque[tuple[int, bytes, Any]]] = {}
        self._made: dict[int, deque[Made]] = {}

    def add_recorded(self, stamp: int, log_time: int, data: bytes, decode: Callable[[], Any]) -> None:
        """Take a recorded message; it is decoded only if it differs."""
        self.difference.recorded += 1
        waiting = self._made.get(stamp)
        if waiting:
            self._compare(log_time, data, decode, waiting.popleft())
            if not waiting:
                del self._made[stamp]
        else:
            self._recorded.setdefault(stamp, deque()).append((log_time, data, decode))

    def add_made(self, made: Made) -> bool:
        """Take a recomputed message; return whether it has a recorded counterpart already that is equal."""
        self.difference.recomputed += 1
        equal = self.difference.equal
        waiting = self._recorded.get(made.stamp)
        if waiting:
            self._compare(*waiting.popleft(), made)
            if not waiting:
                del self._recorded[made.stamp]
        else:
            self._made.setdefault(made.stamp, deque()).append(made)
        return self.difference.equal > equal

    def finish(self) -> None:
        """Note the first recorded message without a counterpart."""
        times = [entry[0] for waiting in self._recorded.values() for entry in waiting]
        if times:
            self._note(min(times))

    def _compare(self, log_time: int, data: bytes, decode: Callable[[], Any], made: Made) -> None:
        difference = self.difference
        difference.pairs += 1
        if data == made.data or self._same(data, made.data):
            difference.equal += 1
            return
        self._note(log_time)
        if self._measure is not None:
            difference.see(self._measure(decode(), made.message))

    def _same(self, data: bytes, made: bytes) -> bool:
        """Return whether two messages differ in nothing but the gaps between their numbers and behind the last one."""
        try:
            return without_gaps(self._type, data) == without_gaps(self._type, made)
        except ValueError:
            return False  # recorded by another definition

    def _note(self, log_time: int) -> None:
        first = self.difference.first
        self.difference.first = log_time if first is None else min(first, log_time)


def _states(one: Any, other: Any) -> dict[str, float]:
    moved = np.subtract(one.robot_pose, other.robot_pose)
    found = {"position [m]": math.hypot(moved[0], moved[1]), "heading [rad]": abs(wrap_angle(float(moved[2])))}
    if one.ball_known and other.ball_known:
        found["ball [m]"] = float(np.linalg.norm(np.subtract(one.ball.position, other.ball.position)))
    found["ball known"] = float(one.ball_known != other.ball_known)
    return found


def _features(one: Any, other: Any) -> dict[str, float]:
    """Match features of a kind, nearest first; `unmatched` is the share without a counterpart."""
    left, angles, matched = list(other.features), 0.0, 0
    for feature in one.features:
        alike = [(_angle(feature, each), index) for index, each in enumerate(left) if each.kind == feature.kind]
        angle, index = min(alike, default=(math.inf, -1))
        if angle < NEAR:
            matched += 1
            angles = max(angles, angle)
            left.pop(index)
    total = len(one.features) + len(other.features)
    return {"angle [rad]": angles, "unmatched": (total - 2 * matched) / total if total else 0.0}


def _angle(one: Any, other: Any) -> float:
    azimuth = wrap_angle(one.azimuth - other.azimuth)
    elevation = one.elevation - other.elevation
    if math.isnan(elevation):
        elevation = 0.0 if math.isnan(one.elevation) == math.isnan(other.elevation) else NEAR
    return math.hypot(azimuth * math.cos(one.elevation if math.isfinite(one.elevation) else 0.0), elevation)


def _poses(one: Any, other: Any) -> dict[str, float]:
    return _moved(
        one.pose.pose.position, one.pose.pose.orientation, other.pose.pose.position, other.pose.pose.orientation
    )


def _transforms(one: Any, other: Any) -> dict[str, float]:
    a, b = one.transforms[0].transform, other.transforms[0].transform
    return _moved(a.translation, a.rotation, b.translation, b.rotation)


def _moved(place: Any, turn: Any, other_place: Any, other_turn: Any) -> dict[str, float]:
    yaw = 2.0 * (math.atan2(turn.z, turn.w) - math.atan2(other_turn.z, other_turn.w))
    return {
        "position [m]": math.hypot(place.x - other_place.x, place.y - other_place.y),
        "heading [rad]": abs(wrap_angle(yaw)),
    }


def _walk(one: Any, other: Any) -> dict[str, float]:
    return {
        "velocity [m/s]": float(np.abs(np.subtract(one.velocity, other.velocity)).max()),
        "mode": float(one.mode != other.mode),
    }


def _head(one: Any, other: Any) -> dict[str, float]:
    return {
        "target [m]": float(np.linalg.norm(np.subtract(one.target, other.target))),
        "mode": float(one.mode != other.mode),
    }


def _decisions(one: Any, other: Any) -> dict[str, float]:
    return {"tree": float(one.tree != other.tree), "kick": float(one.kick_requested != other.kick_requested)}


def _trees(one: Any, other: Any) -> dict[str, float]:
    return {"statuses": float(list(one.statuses) != list(other.statuses))}


def _joints(one: Any, other: Any) -> dict[str, float]:
    return {"position [rad]": float(np.abs(np.subtract(one.position, other.position)).max())}


MEASURES: dict[str, Callable[[Any, Any], dict[str, float]]] = {
    topics.WORLD_STATE.name: _states,
    topics.FEATURES.name: _features,
    topics.ROBOT_POSE.name: _poses,
    topics.TF.name: _transforms,
    topics.WALK_COMMAND.name: _walk,
    topics.HEAD_COMMAND.name: _head,
    topics.DECISION.name: _decisions,
    topics.BEHAVIOUR_TREE.name: _trees,
    topics.HEAD_JOINT_COMMAND.name: _joints,
}
"""What is measured between two messages that differ, by topic: names with units; those without are 0, 1 or shares."""
