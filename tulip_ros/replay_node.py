"""Node "replay": publishes a recording's messages as they were, with /clock."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tulip_ros import schemas
from tulip_ros.errors import BadInputError
from tulip_ros.latched import quality_of
from tulip_ros.log_file import Log, Record
from tulip_ros.player import Handler, Player
from tulip_ros.replay import ReplayParameters, playable
from tulip_ros.run import ComponentNode, run


class ReplayNode(ComponentNode):
    """Publishes recorded messages, serialized as they are."""

    def __init__(self, settings: ReplayParameters | None = None) -> None:
        """Open the recording.

        Args:
            settings: Values to start from; ROS parameters replace them.

        Raises:
            BadInputError: if it cannot be read, or nothing would be played.
        """
        super().__init__("replay")
        self.settings = p = self.load(settings or ReplayParameters())
        self.log = open_log(p)
        names, self.left_out = playable(self.log)
        self.left_out = {name: reason for name, reason in self.left_out.items() if p.wants(name)}
        for name, reason in self.left_out.items():
            self.get_logger().warning(f"topic {name} is left out: {reason}")
        self.player = Player(self, self.log, {name: self._publisher(name) for name in names if p.wants(name)}, p)

    def advance(self, spin: Callable[[float], None]) -> None:
        """Play on."""
        self.player.advance(spin)

    def destroy_node(self) -> None:
        """Close the recording, and end."""
        self.log.close()
        super().destroy_node()

    def _publisher(self, name: str) -> Handler:
        topic = self.log.topics[name]
        message_class = schemas.message_class(topic.type_name)
        sender = self.create_publisher(message_class, name, quality_of(topic).profile())

        def publish(record: Record) -> None:
            sender.publish(record.data)

        return publish


def open_log(settings: ReplayParameters) -> Log:
    """Open the recording that parameters name.

    Raises:
        BadInputError: if none is named, or it cannot be read.
    """
    if not settings.file:
        raise BadInputError("Parameter file is empty; expected the folder or file of a recording.")
    return Log(Path(settings.file))


if __name__ == "__main__":
    run(ReplayNode, ReplayNode.advance)
