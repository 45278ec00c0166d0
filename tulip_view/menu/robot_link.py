"""The menu's connection to a robot: one node, run by a thread of its own."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from threading import Event, Thread
from time import monotonic
from typing import Any

from rclpy.node import Node
from rclpy.serialization import deserialize_message

from tulip_description.quaternion import quaternion_yaw
from tulip_motion.messages import progress_from_message
from tulip_ros import topics
from tulip_ros.asking import Asker
from tulip_ros.raw_topic import RawTopic
from tulip_ros.run import session
from tulip_ros.serialized import time_at
from tulip_ros.topics import Topic
from tulip_strategy.messages import user_command_from_message
from tulip_strategy.user_input import Wish
from tulip_view.columns import MODES, name_of
from tulip_view.menu.node_health import NodeHealth
from tulip_view.menu.sight import Sight
from tulip_view.outcome import Outcome
from tulip_view.state_words import doing_words, game_words
from tulip_view.user_calls import UserCalls

SPIN = 0.1  # [s] longest wait between two looks at whether to end
OLD = 2.0  # [s] of wall-clock time after which what comes all the time counts as missing
KEPT = 20  # outcomes that are remembered
SEARCH = 1.0  # [s] between two looks for robots elsewhere, while there is none here
STEADY = (topics.MOTION_STATE, topics.DECISION, topics.GROUND_TRUTH)
LASTING = (topics.USER_COMMAND, topics.GAME_STATE, topics.IDENTIFICATION)


class RobotLink(Node):
    """Listens and calls services; see `Robot`. Messages are kept serialized, and decoded when somebody looks."""

    def __init__(self, robot: str = "") -> None:
        """Connect.

        Args:
            robot: Namespace of the robot; "" for one that is alone.
        """
        # Several menus may be open; none has anything to be asked for.
        super().__init__(f"menu_{os.getpid()}", enable_rosout=False, start_parameter_services=False)
        self._robot = robot
        self._outcomes: deque[Outcome] = deque(maxlen=KEPT)
        self._calls = UserCalls(self, Asker(self), "menu", robot, self._outcomes.appendleft)
        self._health = NodeHealth(self, robot)
        self._newest: dict[str, tuple[float, bytes]] = {}  # by topic: when it came [s], and what
        for topic in LASTING:
            topic.within(robot).subscribe_from(self, partial(self._keep, topic.name), raw=True, depth=1)
        # What comes fifty times a second waits in the middleware for the next look: to wake up for each is costly.
        self._steady = {
            topic.name: RawTopic(
                self,
                self.resolve_topic_name(topic.within(robot).name),
                topic.type_name,
                topic.quality,
                topic.quality.on_looking,
                waiting=1,
            )
            for topic in STEADY
        }
        self._elsewhere: tuple[float, list[str]] = (-math.inf, [])
        self.failure: BaseException | None = None
        """What ended the thread that runs this node."""

    def destroy_node(self) -> None:
        """End the subscriptions, then the node."""
        for each in self._steady.values():
            each.close()
        self._steady.clear()
        super().destroy_node()

    def _keep(self, name: str, data: bytes) -> None:
        self._newest[name] = monotonic(), data

    def look(self) -> Sight:
        """See `Robot`.

        Raises:
            RuntimeError: if nothing more will come, since the thread that runs this node has failed.
        """
        if self.failure is not None:
            raise RuntimeError("The menu's connection to ROS has failed.") from self.failure
        command, game = self._message(topics.USER_COMMAND), self._message(topics.GAME_STATE)
        motion, decision = self._message(topics.MOTION_STATE), self._message(topics.DECISION)
        progress = self._message(topics.IDENTIFICATION) if self._calls.reaches_experiment else None
        stamps = [time_at(data) for data in map(self._data, STEADY) if data is not None]
        return Sight(
            robot=self._robot,
            missing="" if self._calls.reaches_user_input else self._why_missing(),
            stop=str(self._calls.stop) if self._calls.stop.engaged else "",
            command=user_command_from_message(command) if command is not None else None,
            game=game_words(game) if game is not None else "",
            doing=doing_words(decision) if decision is not None else "",
            mode=name_of(MODES, motion.mode).lower() if motion is not None else "",
            reason="; ".join(filter(None, (motion.reason, *motion.notes))) if motion is not None else "",
            time=max(stamps) * 1e-9 if stamps else None,
            experiment=progress_from_message(progress) if progress is not None else None,
            outcomes=tuple(self._outcomes),
            **self._health.look(),
        )

    def emergency_stop(self, reason: str) -> None:
        """See `Robot`."""
        self._calls.emergency_stop(reason)

    def release(self) -> None:
        """See `Robot`."""
        self._calls.release()

    def wish(self, wish: Wish) -> None:
        """See `Robot`."""
        self._calls.wish(wish)

    def push(self, direction: str, size: float) -> None:
        """See `Robot`. Whoever can push it knows where the robot truly looks, even when it does not know itself."""
        truth = self._message(topics.GROUND_TRUTH)
        heading = 0.0
        if truth is not None:
            turn = truth.robot.orientation
            heading = quaternion_yaw((turn.x, turn.y, turn.z, turn.w))
        self._calls.push(direction, size, heading)

    def record(self, begin: bool) -> None:
        """See `Robot`."""
        self._calls.record(begin)

    def identify(self, begin: bool) -> None:
        """See `Robot`."""
        self._calls.identify(begin)

    def _data(self, topic: Topic) -> bytes | None:
        """Return the newest message of a topic, serialized; None if there is none, or none any more."""
        if topic.name in self._steady:
            for taken in self._steady[topic.name].take():
                self._keep(topic.name, taken.data)
        when, data = self._newest.get(topic.name, (-math.inf, b""))
        return data if data and (topic in LASTING or monotonic() - when < OLD) else None

    def _message(self, topic: Topic) -> Any:
        data = self._data(topic)
        return deserialize_message(data, topic.message) if data is not None else None

    def _why_missing(self) -> str:
        """Return where user input was looked for, where it is instead, and what to do."""
        if monotonic() - self._elsewhere[0] > SEARCH:
            served = [name for name, _ in self.get_service_names_and_types()]
            tail = f"/{topics.SET_USER_COMMAND.name}"
            found = sorted({name.removesuffix(tail).strip("/") for name in served if name.endswith(tail)})
            self._elsewhere = monotonic(), [name for name in found if name != self._robot]
        where = f"namespace /{self._robot}" if self._robot else "no namespace"
        domain = os.environ.get("ROS_DOMAIN_ID", "0")
        others = [f"--namespace {name}" if name else "no --namespace" for name in self._elsewhere[1]]
        instead = f" (but robots do with {', '.join(others)})" if others else ""
        return (
            f"node user_input does not run in {where} of ROS_DOMAIN_ID {domain}{instead}."
            " Start it, the menu goes on then: python3 scripts/launch.py"
        )


@contextmanager
def linked(robot: str) -> Iterator[RobotLink]:
    """Yield a connection that a thread keeps running meanwhile.

    Args:
        robot: Namespace of the robot; "" for one that is alone.

    Raises:
        BadInputError: if ROS cannot be started as its variables say.
    """
    made: Future[RobotLink] = Future()
    stop = Event()
    thread = Thread(target=_run, args=(lambda: RobotLink(robot), made, stop), name="robot link")
    thread.start()
    try:
        yield made.result()
    finally:
        stop.set()
        thread.join()


def _run(make: Callable[[], RobotLink], made: Future[RobotLink], stop: Event) -> None:
    try:
        with session(make, arguments=[], handle_signals=False) as (node, spin):
            made.set_result(node)
            while not stop.is_set():
                spin(SPIN)
    except BaseException as error:
        if made.done():
            made.result().failure = error
        else:
            made.set_exception(error)
