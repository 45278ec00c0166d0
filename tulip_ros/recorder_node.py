"""Node "recorder": writes all topics, or those chosen, into a recording."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from tulip_ros import schemas, topics
from tulip_ros.bag import Bag
from tulip_ros.errors import BadInputError
from tulip_ros.run import ComponentNode, run
from tulip_ros.topics import Quality

LOOK = 0.5  # [s] between two looks for new topics and at the file
WAITING = 100  # messages of one topic that wait while a chunk is compressed
HIDDEN = re.compile(r"(^|/)_|^/parameter_events$")


@dataclass(frozen=True)
class RecorderParameters:
    """What the recorder writes, and where.

    Attributes:
        folder: New recordings without a path of their own are made in it.
        path: Folder of the recording to begin at the start; "" for a new one in `folder`.
        start: Begin a recording at the start; otherwise the service start_recording does.
        include: Regular expressions; a topic must match one of them (whole name). None: every topic.
        exclude: Regular expressions; a topic must match none of them.
        robots: Namespaces, below the node's own, of robots whose topics are subscribed before they appear.
    """

    folder: str = "recordings"
    path: str = ""
    start: bool = True
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    robots: tuple[str, ...] = ("",)

    def __post_init__(self) -> None:
        for expression in (*self.include, *self.exclude):
            try:
                re.compile(expression)
            except re.error as error:
                raise ValueError(f"{expression!r} is no regular expression: {error}") from error

    def wants(self, name: str) -> bool:
        """Return whether a topic is to be recorded.

        Args:
            name: Full name, as in /striker/odometry.
        """
        included = not self.include or any(re.fullmatch(each, name) for each in self.include)
        return included and not any(re.fullmatch(each, name) for each in self.exclude) and not HIDDEN.search(name)


class RecorderNode(ComponentNode):
    """Subscribes to serialized messages and writes them as they are."""

    def __init__(self, settings: RecorderParameters | None = None, namespace: str = "") -> None:
        """Make the node.

        Args:
            settings: Values to start from; ROS parameters replace them.
            namespace: Of the robot whose topics are subscribed before they appear.
        """
        super().__init__("recorder", namespace=namespace)
        self.settings = self.load(settings or RecorderParameters())
        self.bag: Bag | None = None
        self.inputs: dict[str, Subscription] = {}
        self.qualities: dict[str, tuple[str, Quality]] = {}
        self.create_service(topics.START_RECORDING.type, topics.START_RECORDING.name, self.on_start)
        self.create_service(topics.STOP_RECORDING.type, topics.STOP_RECORDING.name, self.on_stop)
        if self.settings.start:
            self.begin(self.settings.path)
        # The topics of this project are subscribed before anyone publishes, so that no first message is lost.
        expected = [topic.within(robot) for robot in self.settings.robots for topic in topics.TOPICS]
        for topic in {topic.name: topic for topic in expected}.values():
            self.subscribe(
                self.resolve_topic_name(topic.name), topic.type_name, topic.quality, ReliabilityPolicy.RELIABLE
            )
        self.every(LOOK, self.discover)

    def begin(self, path: str) -> Path:
        """Begin a recording and return its file.

        Args:
            path: Folder of the recording, or "" for a new one.

        Raises:
            BadInputError: if it cannot be written.
        """
        folder = Path(path) if path else Path(self.settings.folder) / datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
        self.bag = Bag(folder.absolute())
        self.get_logger().info(f"recording to {self.bag.path}")
        return self.bag.path

    def end(self) -> str:
        """End the recording and return what was written, in words."""
        bag, self.bag = self.bag, None
        if bag is None:
            return "nothing was being recorded"
        bag.close()
        return f"{bag.path}: {bag.messages} messages, {bag.size() / 1e6:.1f} MB"

    def discover(self) -> None:
        """Subscribe to topics that appeared, and look after the file."""
        for name, types in self.get_topic_names_and_types():
            if name not in self.inputs and len(types) == 1 and "/msg/" in types[0]:
                self.subscribe(name, types[0], *self.offered(name))
        if self.bag is None:
            return
        try:
            self.bag.flush()
            if not self.bag.has_space():
                self.health.count("disk full", f"recording ended, the disk is nearly full: {self.end()}")
        except OSError as error:
            self.give_up(error)

    def offered(self, name: str) -> tuple[Quality, ReliabilityPolicy]:
        """Return the quality that all publishers of a topic can serve."""
        profiles = [each.qos_profile for each in self.get_publishers_info_by_topic(name)]
        latched = bool(profiles) and all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in profiles)
        reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in profiles)
        return Quality(WAITING, latched), ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT

    def subscribe(self, name: str, type_name: str, quality: Quality, reliability: ReliabilityPolicy) -> None:
        """Record a topic from now on, if it is wanted and its type is known."""
        if name in self.inputs or not self.settings.wants(name):
            return
        try:
            message_class = schemas.message_class(type_name)
            schemas.definition(type_name)
        except LookupError as error:
            self.health.count("topics of unknown type", f"topic {name} is not recorded: {error}")
            return
        profile = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=WAITING,
            reliability=reliability,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if quality.latched else DurabilityPolicy.VOLATILE,
        )
        self.qualities[name] = (type_name, quality)
        self.inputs[name] = self.create_subscription(message_class, name, self.writer(name), profile, raw=True)

    def writer(self, name: str) -> Callable[[bytes], None]:
        """Return the callback that writes one topic's messages."""

        def write(data: bytes) -> None:
            if self.bag is None:
                return
            try:
                self.bag.add_topic(name, *self.qualities[name])
                self.bag.write(name, data, time.time_ns())
            except OSError as error:
                self.give_up(error)

        return write

    def give_up(self, error: OSError) -> None:
        """End a recording that cannot go on; what reached the disk can be recovered."""
        path = self.bag.path if self.bag else None
        self.bag = None
        self.health.count("write errors", f"recording {path} ended early: {error}")

    def on_start(self, request: Any, response: Any) -> Any:
        """Serve start_recording."""
        if self.bag is not None:
            response.success, response.message = False, f"{self.bag.path} is being recorded; stop it first"
            return response
        try:
            response.success, response.message = True, str(self.begin(request.path))
        except BadInputError as error:
            response.success, response.message = False, str(error)
        return response

    def on_stop(self, request: Any, response: Any) -> Any:
        """Serve stop_recording."""
        response.success = self.bag is not None
        try:
            response.message = self.end()
        except OSError as error:
            response.success, response.message = False, f"the recording could not be ended: {error}"
        return response

    def destroy_node(self) -> None:
        """End the recording, then the node."""
        if self.bag is not None:
            print(f"recorded {self.end()}", flush=True)  # ROS may have ended, and its log with it
        super().destroy_node()


if __name__ == "__main__":
    run(RecorderNode)
