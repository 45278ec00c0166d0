"""A graph of processes, well and broken on purpose: what its diagnostics and the doctor say."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from graph_trial import free_port
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from tulip_msgs.msg import Features
from tulip_ros import topics
from tulip_ros.finding import Level
from tulip_ros.graph_check import Diagnosis
from tulip_ros.graph_doctor import NAME, examine
from tulip_ros.health import LOOK
from tulip_ros.launch import Launcher
from tulip_ros.monitor import Monitor
from tulip_ros.run import session
from tulip_ros.time import stamp_of
from tulip_sim.match_graph import trial_plan
from tulip_sim.perception import PerceptionParameters

pytestmark = [pytest.mark.ros, pytest.mark.slow]
WAIT = 60.0  # [s] of wall-clock time for things that take a few
LATENCY = 0.5  # [s] of the graph's time on top, that features may take and a node waits for a busy processor


class Observer:
    """A running graph, and a node outside that listens to its diagnostics."""

    def __init__(self, launcher: Launcher, node: Node, spin: Callable[[float], None]) -> None:
        self.node, self.spin, self._launcher = node, spin, launcher
        names = [state.name for state in launcher.states()]
        self.monitor = Monitor(node, names)
        self.said: list[tuple[str, str, int]] = []  # node, words and stamp [ns]
        self.sums: list[DiagnosticArray] = []
        self.last_features = 0
        topics.DIAGNOSTICS.subscribe_from(node, self._on_diagnostics)
        topics.DIAGNOSTICS_AGG.subscribe_from(node, self.sums.append)
        topics.FEATURES.subscribe_from(node, self._on_features)

    def until(self, condition: Callable[[], object]) -> None:
        end = time.monotonic() + WAIT
        while not condition():
            self.spin(0.1)
            assert self._launcher.poll() == []
            assert time.monotonic() < end, f"it did not come to hold: {self.monitor.summary()}"

    def send(self, name: str, number: signal.Signals) -> None:
        os.kill(next(state.pid for state in self._launcher.states() if state.name == name), number)

    def wrong(self) -> list[Diagnosis]:
        return [each for each in examine(self.node, self.spin, 0.0) if each.level > Level.OK]

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.said += [(status.name, status.message, stamp_of(message)) for status in message.status]

    def _on_features(self, message: Features) -> None:
        self.last_features = stamp_of(message)


@contextmanager
def running(logs: Path) -> Iterator[Observer]:
    plan = trial_plan(1, "open", referee_port=free_port(), perception=PerceptionParameters())
    with (
        Launcher(plan, logs) as launcher,
        session(lambda: Node(NAME), ["test"], handle_signals=False) as (node, spin),
    ):
        observer = Observer(launcher, node, spin)
        observer.until(lambda: observer.monitor.summary().words == "all nodes are well")
        yield observer


@contextmanager
def other_program(name: str) -> Iterator[Node]:
    """Give a node of a participant of its own, as another process has."""
    context = Context()
    context.init()
    node = Node(name, context=context)
    yield node
    node.destroy_node()
    context.shutdown()


def test_doctor_says_all_well_then_names_each_fault_and_a_stopped_node_is_stale_and_missed(
    ros_domain: int, tmp_path: Path
) -> None:
    with running(tmp_path) as graph:
        for _ in range(5):  # a busy machine may make a message come late, which stays told for some seconds
            if not (wrong := graph.wrong()):
                break
        assert wrong == []
        first = graph.sums[-1].status[0]
        assert (first.name, first.level[0], first.message) == ("/robot", Level.OK, "all nodes are well")
        assert {"/robot/driver", "/robot/motion"} < {status.name for status in graph.sums[-1].status}

        stop_what_gives_features(graph)
        with other_program("driver"), other_program("stranger") as stranger:
            stranger.create_publisher(String, "odometry", 5)
            quality = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
            stranger.create_publisher(topics.WALK_COMMAND.message, "walk_command", quality)
            errors = [f"{each.part}: {each.words}" for each in graph.wrong() if each.level == Level.ERROR]
        for expected in (
            "/worldmodel: no features for",
            "2 nodes are called /driver",
            "/stranger uses /odometry as std_msgs/msg/String; expected nav_msgs/msg/Odometry",
            "/motion gets nothing of /walk_command: it asks /stranger for reliable",
            "/walk_command has 2 senders (/stranger, /strategy)",
        ):
            assert any(expected in each for each in errors), (expected, errors)
        graph.send("perception", signal.SIGCONT)
        graph.until(lambda: graph.monitor.summary().level < Level.ERROR)

        graph.send("driver", signal.SIGSTOP)
        graph.until(lambda: any("time stands still" in words for _, words, _ in graph.said))
        errors = [each.words for each in graph.wrong()]
        graph.send("driver", signal.SIGCONT)
        assert any("time stands still" in each or "/driver is missing" in each for each in errors), errors


def stop_what_gives_features(graph: Observer) -> None:
    """Stop it: the world model misses features within their time, and the aggregator names the node."""
    graph.said.clear()
    graph.send("perception", signal.SIGSTOP)
    graph.until(lambda: any("no features for" in words for name, words, _ in graph.said if name == "worldmodel"))
    stamp = next(stamp for name, words, stamp in graph.said if name == "worldmodel" and "no features" in words)
    # Looks come at the wall clock's times, which goes at least as fast as the graph's.
    missed = (stamp - graph.last_features) * 1e-9
    assert topics.FEATURES.missed_after < missed < topics.FEATURES.missed_after + 2.0 * LOOK + LATENCY
    graph.until(lambda: graph.monitor.reports()["perception"].level == Level.STALE)
    whole = graph.monitor.summary()
    assert whole.level == Level.ERROR
    assert whole.words.startswith("perception: says nothing for ")
    graph.until(lambda: graph.sums[-1].status[0].message.startswith("perception: says nothing for "))
