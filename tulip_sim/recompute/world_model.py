"""The world model, computed anew from recorded dead reckoning and features.

A recorded world state documents on which inputs it was computed: its stamp is that of the newest odometry, `picture`
that of the newest picture. Inputs are held back until a recorded state names them, so they are taken in the order of
the run, though a recorder that listens beside the nodes may have heard them in another one. A node answers each input
with a state; what none of its states names, it never got (its queue ran over), and is left out here as well.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from struct import unpack_from

import numpy as np

from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_motion.interface import Odometry
from tulip_motion.messages import odometry_from_message
from tulip_ros import topics
from tulip_ros.cdr import HEAD
from tulip_ros.serialized import after_header, time_at
from tulip_sim.recompute.heard import OVERDUE, UNIX_TIME, Heard, Made
from tulip_vision.features import Features
from tulip_worldmodel.landmark_geometry import rehearse
from tulip_worldmodel.messages import (
    features_from_message,
    map_to_odom_message,
    robot_pose_to_message,
    start_pose_from_message,
    world_state_to_message,
)
from tulip_worldmodel.world_model import WorldModel
from tulip_worldmodel.worldmodel_node import WorldModelNodeParameters

ODOMETRY, FEATURES, START = topics.ODOMETRY.name, topics.FEATURES.name, topics.START_POSE.name
STATE = topics.WORLD_STATE.name
NUMBERS = 85  # of odometry: place 3, orientation 4, covariance 36, velocities 3 and 3, covariance 36


class WorldModelStage:
    """Node worldmodel."""

    reads = frozenset((ODOMETRY, FEATURES, START))
    writes = frozenset((STATE, topics.ROBOT_POSE.name, topics.TF.name))
    told_by = frozenset((STATE,))

    def __init__(self, parameters: WorldModelNodeParameters, field: Field, start: Pose2D | None) -> None:
        """Wait for the first recorded state.

        Args:
            parameters: Of the node.
            field: As the robot's team sees it.
            start: Where the robot was told to stand at the beginning of its run; None where nobody noted it.
        """
        rehearse()  # here, so that a process beside inherits what is compiled
        self._parameters, self._field = parameters, field
        self._odometry: deque[Odometry] = deque()
        self._features: deque[Features] = deque()
        self._asked: deque[Heard] = deque()
        self._model: WorldModel | None = None
        self._start = start
        self._placed = False  # by somebody, during the recording
        self._newest = -1  # stamp of the newest odometry heard [ns]
        self._seen = -1  # stamp of the newest features heard [ns]
        self._newest_taken = self._seen_taken = -1  # the same of what was taken for states [ns]
        self._next_state = 0  # number of the next recorded state, if none is lost
        self._state_due = 0  # stamp of odometry from which the node's next state is due [ns]
        self._counts: Counter[str] = Counter()

    def hear(self, heard: Heard | Made) -> Iterator[Made]:
        """Hold an input until a recorded state names it."""
        if heard.name == START:
            pose = start_pose_from_message(heard.message)
            if pose is not None:
                yield from self._answer_all(None)
                self._odometry.clear()
                self._features.clear()
                self._start, self._placed, self._model = pose, True, None
            return
        if heard.name == ODOMETRY:
            odometry = odometry_of(heard)
            self._odometry.append(odometry)
            self._newest = odometry.stamp
        else:
            features = features_from_message(heard.message)
            self._features.append(features)
            self._seen = features.stamp
        yield from self._answer_all(heard.log_time)

    def answer(self, recorded: Heard) -> Iterator[Made]:
        """Compute the state anew as soon as its inputs are here."""
        self._asked.append(recorded)
        yield from self._answer_all(recorded.log_time)

    def finish(self) -> Iterator[Made]:
        """Yield the states whose inputs never came."""
        yield from self._answer_all(None)

    def shortcomings(self) -> dict[str, int]:
        """Return what could not be computed as it was, by reason."""
        return dict(self._counts)

    def _answer_all(self, now: int | None) -> Iterator[Made]:
        """Answer the recorded states whose inputs are here, and those that waited too long at log time `now` [ns]."""
        while self._asked:
            asked = self._asked[0]
            stamp, picture = asked.stamp, picture_of(asked)
            complete = self._newest >= stamp and (self._seen >= picture or picture == 0)
            if not complete and now is not None and now - asked.log_time < OVERDUE:
                return
            self._asked.popleft()
            yield from self._compute(asked, stamp, picture)

    def _compute(self, asked: Heard, stamp: int, picture: int) -> Iterator[Made]:
        model = self._model or self._begin(asked)
        # A lockstep loses nothing. Where a state is missing in the recording, it may have named what no other one does.
        told = asked.log_time >= UNIX_TIME and asked.record.sequence == self._next_state
        while self._odometry and self._odometry[0].stamp <= stamp:
            odometry = self._odometry.popleft()
            self._newest_taken = odometry.stamp
            if told and odometry.stamp < stamp and odometry.stamp >= self._state_due:
                self._counts["readings of odometry that the run's world model missed, and this one too"] += 1
            else:
                model.add_odometry(odometry)
        while self._features and self._features[0].stamp <= picture:
            features = self._features.popleft()
            self._seen_taken = features.stamp
            if told and features.stamp < picture:
                self._counts["features that the run's world model missed, and this one too"] += 1
            else:
                model.add_features(features)
        if self._newest_taken != stamp:
            self._counts["world states whose odometry is not recorded"] += 1
        if picture not in (0, self._seen_taken):
            self._counts["world states whose features are not recorded"] += 1
        self._next_state = asked.record.sequence + 1
        self._state_due = stamp + round(self._parameters.publish_period * 1e9)
        world = model.state(stamp)
        for name, message in (
            (STATE, world_state_to_message(world)),
            (topics.ROBOT_POSE.name, robot_pose_to_message(world)),
            (topics.TF.name, map_to_odom_message(world)),
        ):
            yield Made(name, asked.log_time, world.stamp, message)

    def _begin(self, first: Heard) -> WorldModel:
        """Make the core where the robot was set down, or where a recording that began later has it."""
        start = self._start
        if not self._placed and (first.record.sequence > 0 or picture_of(first) > 0):
            self._counts["begun in the middle of a run, where the world model knew more than a recording tells"] += 1
            start = None
        start = start or Pose2D(*(float(value) for value in first.message.robot_pose))
        self._model = WorldModel(self._parameters, self._field, start)
        return self._model


def odometry_of(heard: Heard | Made) -> Odometry:
    """Return recorded dead reckoning.

    Most of what is to be decoded is odometry: a header, a name, and one block of numbers. To read it as such takes a
    tenth of the time.
    """
    if isinstance(heard, Made) or heard.record.topic.type_name != topics.ODOMETRY.type_name:
        return odometry_from_message(heard.message)
    data = heard.record.data
    order = "<" if data[1] & 1 else ">"
    place = after_header(data)
    (length,) = unpack_from(f"{order}I", data, place)
    place += 4 + int(length)
    values = np.frombuffer(data, f"{order}f8", NUMBERS, place + (HEAD - place) % 8).astype(np.float64)
    return Odometry(
        heard.stamp,
        values[:3],
        values[3:7],
        values[43:46],
        values[46:49],
        0.0,
        values[7:43].reshape(6, 6),
        values[49:].reshape(6, 6),
    )


def picture_of(state: Heard) -> int:
    """Return the stamp of the newest picture used [ns], without decoding all of a recorded state."""
    return time_at(state.record.data, after_header(state.record.data))
