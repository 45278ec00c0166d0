"""The emergency stop in a node: hears what others say of it, obeys, and repeats it for those that start later."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from threading import RLock

from rclpy.duration import Duration
from rclpy.node import Node

from tulip_description.emergency_stop import EmergencyStop, StopWord
from tulip_msgs.msg import EmergencyStop as EmergencyStopMessage
from tulip_ros import topics
from tulip_ros.finding import Finding, Level
from tulip_ros.time import header, stamp_of
from tulip_ros.topics import Topic

WAITING = 10  # words of several senders may come at once, and each of them counts
LONGEST = 100  # letters of a stranger's words that are shown


class StopLink:
    """One robot's emergency stop, from any thread."""

    def __init__(
        self,
        node: Node,
        by: str,
        obey: Callable[[StopWord], None] = lambda word: None,
        topic: Topic = topics.EMERGENCY_STOP,
        knows_time: bool = True,
    ) -> None:
        """Connect.

        Args:
            node: Has publisher and subscription.
            by: Who engages or releases it by this link, as in "menu".
            obey: Is told when a stop begins, is confirmed with other words, or ends.
            topic: Of the robot, if it is not in the node's own namespace.
            knows_time: Whether the node's clock is the robot's.
        """
        self._by, self._obey = by, obey
        self._clock = node.get_clock() if knows_time else None
        self._stop, self._lock = EmergencyStop(), RLock()
        self._sender = topic.publish_from(node)
        topic.subscribe_from(node, self._hear, depth=WAITING)

    @property
    def word(self) -> StopWord:
        """What counts."""
        return self._stop.word

    @property
    def engaged(self) -> bool:
        """Whether the emergency stop holds."""
        return self._stop.engaged

    def engage(self, reason: str, by: str = "") -> None:
        """Begin an emergency stop, or confirm the one that holds.

        Args:
            reason: In words.
            by: Who asks, if not who has this link.
        """
        with self._lock:
            self._stop.engage(by or self._by, reason, self._stamp(), now=time.time_ns())
            self._tell()
            self._obey(self.word)

    def release(self, by: str = "") -> None:
        """End the emergency stop.

        Raises:
            ValueError: if none holds.
        """
        with self._lock:
            self._stop.release(by or self._by, self._stamp(), now=time.time_ns())
            self._tell()
            self._obey(self.word)

    def wait_until_told(self, seconds: float) -> None:
        """Wait until all who listen have got the last word, so many seconds [s] at most."""
        self._sender.wait_for_all_acked(Duration(seconds=seconds))

    def finding(self) -> Finding | None:
        """Return what is to be said of it in the diagnostics."""
        if not self.engaged:
            return None
        return Finding(Level.ERROR, f"{self.word}: release it when nobody can come to harm")

    def _hear(self, message: EmergencyStopMessage) -> None:
        word = word_from_message(message)
        if not word.stamp:
            word = replace(word, stamp=self._stamp())
        with self._lock:
            held = self.engaged
            if self._stop.hear(word, time.time_ns()):
                if held or self.engaged:
                    self._obey(self.word)
                self._tell()

    def _stamp(self) -> int:
        return 0 if self._clock is None else int(self._clock.now().nanoseconds)

    def _tell(self) -> None:
        word = self.word
        self._sender.publish(
            EmergencyStopMessage(
                header=header(word.stamp),
                engaged=word.engaged,
                by=word.by,
                reason=word.reason,
                sequence=word.sequence,
            )
        )


def word_from_message(message: EmergencyStopMessage) -> StopWord:
    """Return what a message says."""
    by, reason, stamp = _plain(message.by), _plain(message.reason), max(stamp_of(message), 0)
    return StopWord(message.engaged, by, reason, stamp, message.sequence)


def _plain(words: str) -> str:
    """Return words without what could steer the terminal that shows them."""
    return "".join(letter for letter in words[:LONGEST] if letter.isprintable())
