"""A recording behind the driver's contract: the body's topics as they were recorded, so that today's nodes run on them.

Joint commands are heard by nobody: a recorded body cannot be moved.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

from rclpy.publisher import Publisher

from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log, Record
from tulip_ros.player import Handler, Player
from tulip_ros.replay import ReplayParameters, playable
from tulip_ros.replay_node import open_log
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of
from tulip_sim.messages import lens_to_message
from tulip_sim.recompute.decoding import decoded
from tulip_sim.recompute.heard import Heard
from tulip_vision.lens import head_camera_lens
from tulip_vision.messages import picture_to_message

WAIT = 0.1  # [s] between two looks at the graph


@dataclass(frozen=True)
class LogDriverNodeParameters(ReplayParameters):
    """What is played, and how."""

    robot: str = ""  # namespace of the robot in the recording; "" for one that is alone
    wait_for: tuple[str, ...] = ("motion",)  # nodes that must be in the graph before time begins
    start_bound: float = 30.0  # [s] of wall-clock time to wait for them


class LogDriverNode(ComponentNode):
    """Publishes what a driver published."""

    def __init__(self) -> None:
        """Open the recording and connect it."""
        super().__init__("driver")
        p = self._settings = self.load(LogDriverNodeParameters())
        self.log = open_log(p)
        names, left_out = playable(self.log)
        space = f"/{p.robot.strip('/')}/" if p.robot.strip("/") else "/"
        handlers: dict[str, Handler] = {}
        for topic in topics.published_by("driver"):
            name = topic.name if topic.name.startswith("/") else f"{space}{topic.name}"
            if name in left_out and p.wants(name):
                self.health.count("topics left out", f"topic {name} is left out: {left_out[name]}")
            elif name in names and p.wants(name):
                handlers[name] = _as_recorded(self.sender(topic))
        if f"{space}{topics.JOINT_STATES.name}" not in handlers:
            raise BadInputError(
                f"Recording {self.log.path} holds no {space}{topics.JOINT_STATES.name} of a robot; expected one of a"
                f" whole robot, and its namespace in parameter robot. Topics: {', '.join(self.log.topics) or 'none'}."
            )
        self._give_pictures(space, handlers)
        self.player = Player(self, self.log, handlers, p)
        self._begun = False

    def advance(self, spin: Callable[[float], None]) -> None:
        """Play on, once the nodes of `wait_for` are there."""
        if not self._begun:
            self._await_nodes(spin)
            self._begun = True
        self.player.advance(spin)

    def destroy_node(self) -> None:
        """Close the recording, and end."""
        self.log.close()
        super().destroy_node()

    def _give_pictures(self, space: str, handlers: dict[str, Handler]) -> None:
        """Give vision pictures and a lens where the recording holds compressed pictures alone."""
        compressed, raw = f"{space}{topics.CAMERA_COMPRESSED.name}", f"{space}{topics.CAMERA_IMAGE.name}"
        if compressed in handlers and raw not in handlers:
            handlers[compressed] = _decompressed(self.log, handlers[compressed], self.sender(topics.CAMERA_IMAGE))
        if f"{space}{topics.CAMERA_INFO.name}" not in handlers:
            self._lens = self.sender(topics.CAMERA_INFO)
            self._lens.publish(lens_to_message(head_camera_lens(), 0))

    def _await_nodes(self, spin: Callable[[float], None]) -> None:
        p, own = self._settings, self.get_namespace().rstrip("/")
        end = time.monotonic() + p.start_bound
        missing = {f"{own}/{name}" for name in p.wait_for}
        while missing and time.monotonic() < end:
            spin(WAIT)
            missing -= {f"{space.rstrip('/')}/{name}" for name, space in self.get_node_names_and_namespaces()}
        if missing:
            self.health.count("started without nodes", f"time begins without {', '.join(sorted(missing))}")


def _as_recorded(sender: Publisher) -> Handler:
    def publish(record: Record) -> None:
        sender.publish(record.data)

    return publish


def _decompressed(log: Log, compressed: Handler, sender: Publisher) -> Handler:
    def publish(record: Record) -> None:
        compressed(record)
        heard = Heard(topics.CAMERA_COMPRESSED.name, record, log)
        sender.publish(picture_to_message(decoded(heard), stamp_of(heard.message)))

    return publish


def main() -> NoReturn:
    """Run the driver until SIGINT or SIGTERM."""
    run(LogDriverNode, LogDriverNode.advance)


if __name__ == "__main__":
    main()
