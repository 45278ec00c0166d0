"""The behaviour tree as data: what its nodes are, and what each said in the last decision."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence
from py_trees.decorators import Decorator


class NodeKind(IntEnum):
    """What a node does with its children."""

    SELECTOR = 0
    SEQUENCE = 1
    DECORATOR = 2
    LEAF = 3


class NodeStatus(IntEnum):
    """What a node said."""

    IDLE = 0
    """It was not asked."""
    RUNNING = 1
    SUCCESS = 2
    FAILURE = 3


STATUSES = {
    Status.INVALID: NodeStatus.IDLE,
    Status.RUNNING: NodeStatus.RUNNING,
    Status.SUCCESS: NodeStatus.SUCCESS,
    Status.FAILURE: NodeStatus.FAILURE,
}


@dataclass(frozen=True)
class TreeState:
    """All nodes, the root first, each before its children and these in the order in which they are asked.

    Attributes:
        stamp: Of the decision [ns].
        names: Of the nodes.
        parents: Index of each node's parent, -1 for the root.
        kinds: See `NodeKind`.
        statuses: See `NodeStatus`.
    """

    stamp: int
    names: tuple[str, ...]
    parents: tuple[int, ...]
    kinds: tuple[NodeKind, ...]
    statuses: tuple[NodeStatus, ...]


class TreeWatch:
    """Reads a tree whose shape does not change."""

    def __init__(self, root: Behaviour) -> None:
        """List the nodes."""
        self._nodes: list[Behaviour] = []
        self._parents: list[int] = []
        self._add(root, -1)
        self._names = tuple(node.name for node in self._nodes)
        self._kinds = tuple(_kind(node) for node in self._nodes)
        self._places = {id(node): index for index, node in enumerate(self._nodes)}

    def state(self, stamp: int, asked: Iterable[Behaviour] = ()) -> TreeState:
        """Return the tree after a decision.

        Args:
            stamp: Of the decision [ns].
            asked: The nodes that were asked; the others keep an old status that says nothing.
        """
        statuses = [NodeStatus.IDLE] * len(self._nodes)
        for node in asked:
            statuses[self._places[id(node)]] = STATUSES[node.status]
        return TreeState(stamp, self._names, tuple(self._parents), self._kinds, tuple(statuses))

    def _add(self, node: Behaviour, parent: int) -> None:
        index = len(self._nodes)
        self._nodes.append(node)
        self._parents.append(parent)
        for child in node.children:
            self._add(child, index)


def _kind(node: Behaviour) -> NodeKind:
    for kind, known in ((NodeKind.SELECTOR, Selector), (NodeKind.SEQUENCE, Sequence), (NodeKind.DECORATOR, Decorator)):
        if isinstance(node, known):
            return kind
    return NodeKind.LEAF
