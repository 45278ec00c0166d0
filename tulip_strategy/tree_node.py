"""Shows a robot's behaviour tree in the terminal while it plays."""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic

from rclpy.node import Node
from rich.console import Console
from rich.live import Live

from tulip_msgs.msg import BehaviourTree
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.run import session
from tulip_strategy.messages import tree_from_message
from tulip_strategy.tree_drawing import terminal_tree

CONNECT = 10.0  # [s] of wall-clock time until a tree must have come
LOOK = 0.1  # [s] between two looks


class TreeNode(Node):  # type: ignore[misc]  # rclpy comes without types
    """Keeps the newest tree."""

    def __init__(self) -> None:
        """Listen."""
        super().__init__("tree")
        self.newest: BehaviourTree | None = None
        topic = topics.BEHAVIOUR_TREE
        self.create_subscription(topic.message, topic.name, self._take, topic.quality.profile())

    def _take(self, message: BehaviourTree) -> None:
        self.newest = message


def main(arguments: Sequence[str] | None = None, whole: bool = False) -> None:
    """Show the tree until Ctrl-C.

    Args:
        arguments: Command line with `--ros-args`, as in `-r __ns:=/striker`; the process's own by default.
        whole: Also show branches that were not asked.

    Raises:
        BadInputError: if no strategy is heard.
    """
    console = Console()
    with session(TreeNode, arguments) as (node, spin):
        end = monotonic() + CONNECT
        while node.newest is None:
            if monotonic() > end:
                raise BadInputError(
                    f"No behaviour tree comes on {node.resolve_topic_name(topics.BEHAVIOUR_TREE.name)} within"
                    f" {CONNECT:.0f} s. Start strategy (scripts/launch.py), in this namespace and with this"
                    " ROS_DOMAIN_ID."
                )
            spin(LOOK)
        with Live(console=console, auto_refresh=False, transient=True) as live:
            while True:
                live.update(terminal_tree(tree_from_message(node.newest), whole), refresh=True)
                spin(LOOK)
