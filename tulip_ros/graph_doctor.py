"""Looks at the running graph for some seconds and tells what is wrong, as JSON: the part of the doctor that needs ROS.

python -m tulip_ros.graph_doctor SECONDS
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

from tulip_ros import topics
from tulip_ros.aggregation import Report
from tulip_ros.graph_check import Diagnosis, Endpoint, GraphFacts, check, declared, robots
from tulip_ros.health import version
from tulip_ros.monitor import report_from_status
from tulip_ros.run import session
from tulip_ros.time import NANOSECONDS, from_message

NAME = "doctor"
DISCOVERY = 1.5  # [s] of wall-clock time until all nodes and topics of one machine are known
UNKNOWN = "_NODE_NAME_UNKNOWN_"
LEAST = 2.5  # [s] of listening in which each node has reported at least twice


def examine(node: Node, spin: Callable[[float], None], seconds: float) -> list[Diagnosis]:
    """Look at a graph and return what was found.

    Args:
        node: Which is not part of the graph.
        spin: Waits up to so many seconds [s] for messages and handles them.
        seconds: How long to listen [s] of wall-clock time.
    """
    _wait(spin, DISCOVERY)
    stethoscope = _Stethoscope(node, GraphFacts(_node_names(node)))
    _wait(spin, DISCOVERY / 3)  # until the new subscriptions hear
    stethoscope.begin()
    _wait(spin, max(seconds, LEAST))
    return check(stethoscope.facts())


class _Stethoscope:
    """Listens to everything that comes often, and to diagnostics."""

    def __init__(self, node: Node, first: GraphFacts) -> None:
        self._node = node
        self._counts: Counter[str] = Counter()
        self._reports: dict[str, Report] = {}
        self._clock: list[tuple[float, int]] = []  # wall clock [s] and graph's time [ns]
        self._names = []
        clock = topics.CLOCK
        for name, topic in declared(first).items():
            if topic.rate and topic.message is not Image and name != clock.name:  # a picture is 0.9 MB
                types = {end.type_name for end in _publishers(node, name)}
                if types == {topic.type_name}:  # another type cannot be heard, and is told
                    topic.subscribe_from(node, self._counter(name), raw=True)
                    self._names.append(name)
        clock.subscribe_from(node, self._on_clock)
        for space in {"", *robots(first)}:
            topics.DIAGNOSTICS.within(space.strip("/")).subscribe_from(node, self._on_diagnostics)
        self.begin()

    def begin(self) -> None:
        """Count from here on."""
        self._counts.clear()
        self._clock.clear()
        self._begun = monotonic()

    def facts(self) -> GraphFacts:
        """Return what is known now."""
        elapsed = monotonic() - self._begun
        named = {name for name, _ in self._node.get_topic_names_and_types()}
        publishers = {name: tuple(_publishers(self._node, name)) for name in named}
        return GraphFacts(
            nodes=_node_names(self._node),
            publishers={name: ends for name, ends in publishers.items() if ends},
            subscribers={name: tuple(_endpoints(self._node.get_subscriptions_info_by_topic(name))) for name in named},
            rates={name: self._counts[name] / elapsed for name in self._names},
            pace=self._pace(publishers.get(topics.CLOCK.name, ())),
            reports=self._reports,
            version=version(),
        )

    def _pace(self, senders: tuple[Endpoint, ...]) -> float | None:
        if not senders:
            return None
        if len(self._clock) < 2:
            return 0.0
        (begin, first), (end, last) = self._clock[0], self._clock[-1]
        return max(0.0, (last - first) / NANOSECONDS / max(end - begin, 1e-3))

    def _counter(self, name: str) -> Callable[[bytes], None]:
        def count(_: bytes) -> None:
            self._counts[name] += 1

        return count

    def _on_clock(self, message: Clock) -> None:
        self._clock.append((monotonic(), from_message(message.clock)))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._reports[f"{status.hardware_id.rstrip('/')}/{status.name}"] = report_from_status(status)


def _node_names(node: Node) -> tuple[str, ...]:
    """Return the full names of all other nodes, without the tools of ROS that hide behind an underscore."""
    names = [f"{space.rstrip('/')}/{name}" for name, space in node.get_node_names_and_namespaces()]
    return tuple(name for name in names if not name.rpartition("/")[2].startswith("_") and name != f"/{NAME}")


def _publishers(node: Node, name: str) -> Iterator[Endpoint]:
    return _endpoints(node.get_publishers_info_by_topic(name))


def _endpoints(infos: list[Any]) -> Iterator[Endpoint]:
    for info in infos:
        if info.node_name in (NAME, UNKNOWN):
            continue
        quality: QoSProfile = info.qos_profile
        yield Endpoint(
            f"{info.node_namespace.rstrip('/')}/{info.node_name}",
            info.topic_type,
            quality.reliability == ReliabilityPolicy.RELIABLE,
            quality.durability == DurabilityPolicy.TRANSIENT_LOCAL,
        )


def _wait(spin: Callable[[float], None], seconds: float) -> None:
    end = monotonic() + seconds
    while (left := end - monotonic()) > 0.0:
        spin(left)


def main() -> None:
    """Examine the graph of this ROS domain and print what was found."""
    with session(lambda: Node(NAME, enable_rosout=False), arguments=[]) as (node, spin):
        found = examine(node, spin, float(sys.argv[1]) if len(sys.argv) > 1 else LEAST)
    json.dump([(each.level.name.lower(), each.part, each.words) for each in found], sys.stdout)


if __name__ == "__main__":
    main()
