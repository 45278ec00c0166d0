"""Node "disturber": stands between a sender and its listeners, and does to messages what a bad network does.

The sender is started such that it knows each topic by the name that `sent` gives it; what arrives goes out under the
topic's own name. So every listener is the one that plays, and notices nothing but the messages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock

from tulip_ros import topics
from tulip_ros.errors import BadInputError, unknown
from tulip_ros.plan import Start
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import from_message, to_message
from tulip_ros.topics import Topic
from tulip_sim.disturbance import Disturbance


@dataclass(frozen=True)
class DisturberParameters:
    """Which messages suffer, from when on, and how."""

    topics: tuple[str, ...] = ("odometry",)  # names, as in tulip_ros/topics.py
    begin: float = 0.0  # [s] of the graph's time; before that all messages pass
    kind: str = "none"  # none, lost, late, doubled, out of order
    share: float = 0.2  # of the messages that are lost, doubled or overtaken
    hold: int = 1  # messages later that a late or overtaken one arrives
    clock_jump: float = 0.0  # [s] by which /clock, if it is among the topics, is put forward or back
    seed: int = 0


def sent(topic: str) -> str:
    """Return the name under which a disturbed topic's messages are sent."""
    return f"{topic}/sent"


def disturbed(plan: Iterable[Start], names: Iterable[str]) -> tuple[Start, ...]:
    """Return a plan whose senders send topics under the names that a disturber listens to."""
    names = tuple(names)
    by_name = {topic.name: topic for topic in topics.TOPICS}

    def renamed(start: Start) -> tuple[tuple[str, str], ...]:
        return tuple((name, sent(name)) for name in names if start.name in by_name[name].publishers)

    return tuple(replace(start, renamed=(*start.renamed, *renamed(start))) for start in plan)


class DisturberNode(ComponentNode):
    """Passes serialized messages on, or not."""

    def __init__(self) -> None:
        """Connect."""
        super().__init__("disturber")
        p = self._settings = self.load(DisturberParameters())
        known = {topic.name: topic for topic in topics.TOPICS}
        rng = np.random.default_rng(p.seed)
        for name in p.topics:
            if name not in known:
                raise unknown("topic", name, known)
            try:
                way: Disturbance[bytes] = Disturbance(p.kind, p.share, p.hold, rng)
            except ValueError as error:
                raise BadInputError(f"Parameters of node 'disturber': {error}") from error
            arriving = replace(known[name], name=sent(name))
            arriving.subscribe_from(self, self._passing(known[name], way), raw=True)

    def _passing(self, topic: Topic, way: Disturbance[bytes]) -> Callable[[bytes], None]:
        sender, p = self.sender(topic), self._settings

        def clock(data: bytes) -> None:
            time = from_message(deserialize_message(data, Clock).clock)
            jump = round(p.clock_jump * 1e9) if time >= p.begin * 1e9 else 0
            sender.publish(Clock(clock=to_message(max(0, time + jump))))

        def pass_on(data: bytes) -> None:
            begun = self.get_clock().now().nanoseconds >= p.begin * 1e9
            for message in way.pass_on(data) if begun else [data]:
                sender.publish(message)

        return clock if topic.message is Clock else pass_on


def main() -> None:
    """Run the node."""
    run(DisturberNode)


if __name__ == "__main__":
    main()
