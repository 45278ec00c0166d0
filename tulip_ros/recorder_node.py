"""Node "recorder": writes all topics, or those chosen, into a recording."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy

from tulip_ros import log_notes, parameters, schemas, topics
from tulip_ros.bag import FREE, Bag, Split
from tulip_ros.errors import BadInputError
from tulip_ros.lost_messages import LostMessages
from tulip_ros.mcap_file import COMPRESSIONS
from tulip_ros.node_parameters import ParameterAsker
from tulip_ros.picture_rate import PICTURE_RATE, PictureRate
from tulip_ros.raw_topic import HIDDEN, RawTopic, Taken, message_topics, offered
from tulip_ros.run import ComponentNode, run
from tulip_ros.serialized import time_at
from tulip_ros.topics import Quality

LOOK = 0.5  # [s] between two looks for new topics and nodes, and at the disk
WAIT = 20.0  # [s] at most for the nodes of `wait_for`
COLLECT = 0.02  # [s] between two times that waiting messages are taken: one waking for many is cheap
RECORDING = "recording"
"""Name of the figure in the recorder's diagnostics that tells the file being written; "" while there is none."""
PICTURES = {
    "compressed": (r"/(.*/)?camera/image_raw", r"/(.*/)?vision/picture"),
    "raw": (r"/(.*/)?camera/image_raw/compressed",),
    "both": (),
    "none": (r"/(.*/)?camera/image_raw", r"/(.*/)?camera/image_raw/compressed", r"/(.*/)?vision/picture"),
}
"""Which topics each choice of pictures leaves out."""
PICTURE = re.compile(r"/(.*/)?(camera/image_raw(/compressed)?|vision/picture)")


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
        pictures: "compressed" (10 KB each), "raw" (0.9 MB), "both" or "none".
        picture_rate: How many of each topic's pictures go into a second of the recording, by their stamps; 0: all.
        compression: Of the files: "zstd", or "none" for raw pictures of many cameras.
        sync: Have the disk keep what is written; without, a loss of power costs what the system had not written yet.
        split_size: Size of a file after which the recording goes on in another one [MB]; 0 for one file.
        split_time: Time in a file after which the recording goes on in another one [s]; 0 for one file.
        free_space: Disk space to leave free [MB].
        wait_for: Names of nodes without which time does not begin; the recorder serves once it surely hears them.
        notes: What goes into the recording about itself, as in "seed=1".
    """

    folder: str = "recordings"
    path: str = ""
    start: bool = True
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    robots: tuple[str, ...] = ("",)
    pictures: str = "compressed"
    picture_rate: float = PICTURE_RATE
    compression: str = "zstd"
    sync: bool = True
    split_size: float = 0.0
    split_time: float = 0.0
    free_space: float = FREE / 1e6
    wait_for: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not usable.
        """
        for expression in (*self.include, *self.exclude):
            try:
                re.compile(expression)
            except re.error as error:
                raise ValueError(f"{expression!r} is no regular expression: {error}") from error
        if self.pictures not in PICTURES:
            raise ValueError(f"pictures is {self.pictures!r}; expected one of {', '.join(PICTURES)}")
        if self.compression not in COMPRESSIONS:
            raise ValueError(f"compression is {self.compression!r}; expected one of {', '.join(COMPRESSIONS)}")
        if not self.free_space >= 0.0:
            raise ValueError(f"free_space is {self.free_space} MB; expected >= 0")
        for note in self.notes:
            if "=" not in note:
                raise ValueError(f"note {note!r} has no value; expected name=value")
        PictureRate(self.picture_rate)
        Split(int(self.split_size * 1e6), self.split_time)

    def wants(self, name: str) -> bool:
        """Return whether a topic is to be recorded.

        Args:
            name: Full name, as in /striker/odometry.
        """
        included = not self.include or any(re.fullmatch(each, name) for each in self.include)
        excluded = any(re.fullmatch(each, name) for each in (*self.exclude, *PICTURES[self.pictures]))
        return included and not excluded and not HIDDEN.search(name)


class _Input(RawTopic):
    """One subscription, and what is known of its messages."""

    def __init__(self, node: Node, name: str, type_name: str, quality: Quality, reliability: ReliabilityPolicy) -> None:
        super().__init__(node, name, type_name, quality, reliability)
        self.is_picture = PICTURE.fullmatch(name) is not None
        self.numbers = LostMessages()


class RecorderNode(ComponentNode):
    """Takes serialized messages and writes them as they are.

    Messages wait in the middleware until the node takes all of them at once; their numbers show what was lost.
    """

    def __init__(self, settings: RecorderParameters | None = None, namespace: str = "") -> None:
        """Make the node.

        Args:
            settings: Values to start from; ROS parameters replace them.
            namespace: Of the robot whose topics are subscribed before they appear.
        """
        super().__init__("recorder", namespace=namespace)
        self.settings = self.load(settings or RecorderParameters())
        self.bag: Bag | None = None
        self.health.show(RECORDING, "")
        self._rate = PictureRate(self.settings.picture_rate)
        self.inputs: dict[str, _Input] = {}
        self.lost: dict[str, int] = {}
        """Messages that were lost during the recording, by topic."""
        self.known: dict[str, dict[str, Any]] = {
            self.get_fully_qualified_name(): parameters.plain(self.settings),
        }
        """Parameters of nodes."""
        self._latched: dict[str, tuple[_Input, Taken]] = {}  # last message of each latched topic
        self._refused: set[str] = set()
        self._asker = ParameterAsker(self, self.learn)
        # The topics of this project are subscribed before anyone publishes, so that no first message is lost.
        expected = [topic.within(robot) for robot in self.settings.robots for topic in topics.TOPICS]
        for topic in {topic.name: topic for topic in expected}.values():
            self.subscribe(
                self.resolve_topic_name(topic.name), topic.type_name, topic.quality, ReliabilityPolicy.RELIABLE
            )
        if self.settings.start:
            self.begin(self.settings.path, from_now=False)
        self._awaited = {f"{self.get_namespace().rstrip('/')}/{name}" for name in self.settings.wait_for}
        self._serves = False
        self._waits_until = time.monotonic() + WAIT
        self.every(COLLECT, self.collect)
        self.every(LOOK, self.discover)
        self._serve()

    def begin(self, path: str, from_now: bool = True) -> Path:
        """Begin a recording and return its file.

        Args:
            path: Folder of the recording, or "" for a new one.
            from_now: Leave out what came before and was not taken yet, but for what latched topics said last.

        Raises:
            BadInputError: if it cannot be written.
        """
        settings = self.settings
        folder = Path(path) if path else Path(settings.folder) / datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
        if from_now:
            self.take()
        split = Split(int(settings.split_size * 1e6), settings.split_time)
        bag = Bag(folder.absolute(), split, int(settings.free_space * 1e6), settings.compression, settings.sync)
        try:
            own = dict(note.split("=", 1) for note in settings.notes)
            log_notes.explain(bag, {**own, "time": "of reception, in ns since 1970"})
            for name, values in self.known.items():
                log_notes.attach_parameters(bag, name, values)
        except OSError as error:
            raise BadInputError(
                f"Recording {bag.folder} cannot be written: {error.strerror}. Name another folder, or make room."
            ) from error
        self.bag, self.lost = bag, {}
        self.health.show(RECORDING, str(bag.path))
        now = time.time_ns()  # a recording that begins later begins with what holds then
        self.write([(source, message._replace(received=now)) for source, message in self._latched.values()])
        self.get_logger().info(f"recording to {self.bag.path}")
        return self.bag.path

    def end(self) -> str:
        """End the recording and return what was written, in words.

        Raises:
            OSError: if it could not be ended; what reached the disk can be recovered.
        """
        if self.bag is None:
            return "nothing was being recorded"
        self.write(self.take())
        bag = self._let_go()
        if bag is None:
            return "the recording ended early"
        bag.note(log_notes.LOST, {name: str(count) for name, count in sorted(self.lost.items())} or {"all": "0"})
        bag.close()
        lost = f", {sum(self.lost.values())} more were lost before" if self.lost else ""
        where = bag.path if len(bag.paths) == 1 else f"{bag.folder} ({len(bag.paths)} files)"
        return f"{where}: {bag.messages} messages, {bag.size() / 1e6:.1f} MB{lost}"

    def collect(self) -> None:
        """Write what came in, and have it on the disk in time."""
        messages = self.take()
        if self.bag is None:
            return
        self.write(messages)
        if self.bag is not None:
            try:
                self.bag.flush()
            except OSError as error:
                self.give_up(error)

    def take(self) -> list[tuple[_Input, Taken]]:
        """Take all messages that wait, in the order in which they came."""
        messages = [(each, message) for each in self.inputs.values() for message in each.take()]
        messages.sort(key=lambda pair: pair[1].received)
        for source, message in messages:
            if source.quality.latched:
                self._latched[source.name] = (source, message)
            missing = source.numbers.see(message.number, source.publishers)
            if missing:
                self.lost[source.name] = self.lost.get(source.name, 0) + missing
                self.health.count("lost messages", f"{missing} messages of {source.name} did not arrive", missing)
        return messages

    def write(self, messages: Iterable[tuple[_Input, Taken]]) -> None:
        """Write messages that were taken."""
        bag = self.bag
        if bag is None:
            return
        try:
            for source, message in messages:
                if source.is_picture and not self._rate.keeps(source.name, time_at(message.data)):
                    continue
                bag.add_topic(source.name, source.type_name, source.quality)
                bag.write(source.name, message.data, message.received, message.sent)
        except OSError as error:
            self.give_up(error)

    def learn(self, node: str, values: dict[str, Any]) -> None:
        """Note the parameters of a node.

        A node that answers has found the question's way back, which is younger than all subscriptions made at the
        start, and nodes learn of such things in the order in which they were made: its messages arrive from now on.
        """
        self.known[node] = values
        self._awaited.discard(node)
        if self.bag is not None:
            try:
                log_notes.attach_parameters(self.bag, node, values, time.time_ns())
            except OSError as error:
                self.give_up(error)

    def discover(self) -> None:
        """Subscribe to topics that appeared, ask nodes that appeared, and look after the disk."""
        for name, type_name in message_topics(self):
            if name not in self.inputs:
                self.subscribe(name, type_name, *offered(self, name))
        self._asker.look()
        self._serve()
        if self.bag is None:
            return
        try:
            if not self.bag.has_space():
                self.health.count("disk full", f"recording ended, the disk is nearly full: {self.end()}")
        except OSError as error:
            self.give_up(error)

    def subscribe(self, name: str, type_name: str, quality: Quality, reliability: ReliabilityPolicy) -> None:
        """Record a topic from now on, if it is wanted and its type is known."""
        if name in self.inputs or name in self._refused or not self.settings.wants(name):
            return
        try:
            schemas.definition(type_name)
            self.inputs[name] = _Input(self, name, type_name, quality, reliability)
        except LookupError as error:
            self._refused.add(name)
            self.health.count("topics of unknown type", f"topic {name} is not recorded: {error}")

    def _serve(self) -> None:
        """Offer the services, once every awaited node is heard: who waits for a recorder waits for them."""
        if self._serves or (self._awaited and time.monotonic() < self._waits_until):
            return
        self._serves = True
        if self._awaited:
            names = ", ".join(sorted(self._awaited))
            self.health.count("started without nodes", f"recording without word from {names}, after {WAIT:.0f} s")
        self.create_service(topics.STOP_RECORDING.type, topics.STOP_RECORDING.name, self.on_stop)
        self.create_service(topics.START_RECORDING.type, topics.START_RECORDING.name, self.on_start)

    def give_up(self, error: OSError) -> None:
        """End a recording that cannot go on; what reached the disk is kept."""
        bag = self._let_go()
        if bag is None:
            return
        try:
            bag.close()
        except OSError:
            pass  # the same, mostly: that is told below
        mend = "it is whole until then" if bag.ended else f"mend it: python3 scripts/recover.py {bag.folder}"
        reason = error.strerror or str(error)
        self.health.count("write errors", f"recording {bag.folder} ended early ({reason}); {mend}")

    def _let_go(self) -> Bag | None:
        """Write no more; return what was being written."""
        bag, self.bag = self.bag, None
        self.health.show(RECORDING, "")
        return bag

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
            try:
                told = f"recorded {self.end()}"
            except OSError as error:
                told = f"error: the recording could not be ended: {error.strerror or error}"
            print(told, flush=True)  # ROS may have ended, and its log with it
        for each in self.inputs.values():
            each.close()
        self.inputs.clear()
        super().destroy_node()


if __name__ == "__main__":
    run(RecorderNode)
