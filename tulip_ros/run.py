"""One way to run a node: parameters, topics, health, executor, clean end.

A node's module is thin:

    class VisionNode(ComponentNode):
        def __init__(self) -> None:
            super().__init__("vision")
            self.settings = self.load(VisionParameters())
            self.core = Vision(self.settings)
            self.features = self.sender(topics.FEATURES)
            self.listen(topics.CAMERA_IMAGE, self.on_image)

        def begin_anew(self) -> None:
            self.core = Vision(self.settings)

    if __name__ == "__main__":
        run(VisionNode)
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import monotonic
from typing import Any, NoReturn, TypeVar

import rclpy
from rclpy.clock import Clock, ClockType, JumpThreshold
from rclpy.duration import Duration
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from tulip_ros import parameters, transport
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, unknown
from tulip_ros.health import Health
from tulip_ros.keepsake import Keepsake
from tulip_ros.time import stamp_of
from tulip_ros.timeline import JUMP, Arrival, Timeline
from tulip_ros.topics import Topic

P = TypeVar("P")
N = TypeVar("N", bound=Node)

EXECUTOR_VARIABLE = "TULIP_EXECUTOR"
"""Environment variable that chooses the executor."""
EXECUTORS: dict[str, Callable[[], Executor]] = {
    "events": EventsExecutor,  # 38 us a callback with its publish
    "single": SingleThreadedExecutor,  # 215 us, the older and better known one
}
SPIN = 0.5  # [s] longest wait between two looks at whether to end
COLLECTION = 60.0  # [s] between two full collections of garbage, of 0.1 ms: without them free tuples add up to 5 MB


class ComponentNode(Node):
    """A node around a core."""

    def __init__(self, name: str, **options: Any) -> None:
        """Make the node.

        Args:
            name: Its name in the graph, as in `tulip_ros.nodes`.
            options: For rclpy's Node, as in `namespace`, `parameter_overrides`.
        """
        super().__init__(name, **options)
        self.health = Health(self)
        self.keepsake = Keepsake()
        self._timeline = Timeline()

    def load(self, defaults: P) -> P:
        """Declare a core's parameters and return them with the user's values.

        Args:
            defaults: The core's parameters dataclass, as in `VisionParameters()`.

        Raises:
            BadInputError: for an unknown name or an unfit value. `run` ends the node with exit code 2 then.
        """
        return parameters.declare(self, defaults)

    def sender(self, topic: Topic) -> Publisher:
        """Return the publisher of a topic. Its `publish` takes messages, or bytes of a serialized one."""
        return topic.publish_from(self)

    def listen(self, topic: Topic, callback: Callable[[Any], None], depth: int | None = None) -> Subscription:
        """Call back with each message of a topic; the diagnostics tell how many come, and when they are missed.

        When stamps jump back, the simulation was begun anew: `begin_anew` is called first, and messages from before
        that other topics still deliver are dropped. Latched topics tell no time, since their last message may be old,
        nor do topics of several senders, each of which is at another stamp.

        Args:
            topic: One of `tulip_ros.topics`.
            callback: Is given each message.
            depth: How many messages wait while this node is busy, if it needs more than the topic's own.
        """
        has_header = "header" in topic.message.get_fields_and_field_types()
        tells_time = has_header and not topic.quality.latched and len(topic.publishers) == 1
        see, name, watch = self._timeline.see, topic.name, self.health.expect(topic)

        def counted(message: Any) -> None:
            begin = monotonic()
            if tells_time:
                stamp = stamp_of(message)
                arrival = see(name, stamp)
                if arrival is Arrival.OLD:
                    self.health.count("messages from before time began anew")
                    return
                if arrival is Arrival.ANEW:
                    self._time_went_back()
                watch.stamp = max(watch.stamp, stamp)
            watch.count += 1
            callback(message)
            # The events executor of rclpy 7.1 fails where a callback asks when its message was sent.
            watch.served(monotonic() - begin)

        return topic.subscribe_from(self, counted, depth=depth)

    def follow_clock(self) -> None:
        """Begin anew when the node's clock jumps back: for a node that listens to nothing with a stamp."""
        threshold = JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-JUMP), on_clock_change=False)
        self._clock_jumps = self.get_clock().create_jump_callback(
            threshold, post_callback=lambda _: self._time_went_back()
        )

    def begin_anew(self) -> None:
        """Forget everything about the time before: the simulation was begun anew. For nodes to override."""

    def _time_went_back(self) -> None:
        self.get_logger().info("time went back: beginning anew")
        self.health.begin_anew()
        self.begin_anew()

    def every(self, period: float, callback: Callable[[], None]) -> Timer:
        """Call back every `period` [s] of wall-clock time: for sockets and keyboards, never for control."""
        return self.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))


def _spin(spinner: Executor, timeout: float) -> None:
    """Wait up to so many seconds for work and do it; the program's own signal handlers run after that.

    One that raised inside a callback would have rclpy report the callback as failed.
    """
    came: list[int] = []
    own = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    own = {number: handler for number, handler in own.items() if callable(handler)}
    for number in own:
        signal.signal(number, lambda it, _: came.append(it))
    try:
        spinner.spin_once(timeout_sec=timeout)
    finally:
        for number, handler in own.items():
            signal.signal(number, handler)
    if came:
        signal.raise_signal(came[0])


@contextmanager
def session(
    make_node: Callable[[], N],
    arguments: Sequence[str] | None = None,
    executor: str | None = None,
    handle_signals: bool = True,
) -> Iterator[tuple[N, Callable[[float], None]]]:
    """Start ROS, make a node, and end both cleanly.

    Args:
        make_node: Makes the node; called after ROS was started.
        arguments: Command line with `--ros-args`; the process's own by default.
        executor: "events" or "single"; by default what TULIP_EXECUTOR says, else "events".
        handle_signals: Let SIGINT and SIGTERM end ROS; otherwise the program sees to them itself.

    Yields:
        The node, and a function that waits up to so many seconds for work and does it.

    Raises:
        BadInputError: for an unknown executor, or arguments or parameters that cannot be used.
    """
    choice = executor or os.environ.get(EXECUTOR_VARIABLE, "events")
    if choice not in EXECUTORS:
        raise unknown("executor", choice, EXECUTORS)
    transport.use_profile()
    if not handle_signals:  # a program with words of its own; who asked asks again, or says that no answer came
        warnings.filterwarnings("ignore", "failed to send response", RuntimeWarning)
    try:
        rclpy.init(
            args=list(sys.argv if arguments is None else arguments),
            signal_handler_options=SignalHandlerOptions.ALL if handle_signals else SignalHandlerOptions.NO,
        )
        node = make_node()
    except (rclpy_implementation.RCLError, rclpy_implementation.UnknownROSArgsError) as error:
        rclpy.try_shutdown()
        raise BadInputError(f"ROS refuses the arguments: {error}") from error
    except BaseException:
        rclpy.try_shutdown()
        raise
    spinner = EXECUTORS[choice]()
    spinner.add_node(node)
    try:
        if handle_signals or threading.current_thread() is not threading.main_thread():
            yield node, lambda timeout: spinner.spin_once(timeout_sec=timeout)
        else:
            yield node, lambda timeout: _spin(spinner, timeout)
    finally:
        spinner.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()


def run(
    make_node: Callable[[], N],
    advance: Callable[[N, Callable[[float], None]], None] | None = None,
    arguments: Sequence[str] | None = None,
) -> NoReturn:
    """Run a node until SIGINT or SIGTERM, then end the process.

    Exit codes: 0 after a signal, 2 for bad input (message, no traceback); any other error ends with its traceback.

    Args:
        make_node: Makes the node.
        advance: For a node with a loop of its own: called again and again with the node and a function that waits
            up to so many seconds [s] for messages and handles them. By default the node only handles messages.
        arguments: As for `session`.
    """
    try:
        with session(make_node, arguments) as (node, spin):
            # What was made by now stays. To look through its 77 000 objects takes the garbage collector 50 ms, now and
            # then, which is longer than a command to the legs lives.
            gc.collect()
            gc.freeze()
            collected = monotonic()
            while rclpy.ok():
                if advance is None:
                    spin(SPIN)
                else:
                    advance(node, spin)
                if monotonic() - collected > COLLECTION:
                    gc.collect()
                    collected = monotonic()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except rclpy_implementation.RCLError:
        if rclpy.ok():
            raise
        # A signal shut ROS down in the middle of a callback, which then could not publish: that is a clean end.
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(EXIT_BAD_INPUT) from None
    raise SystemExit(0)
