"""Draws a behaviour tree: in a terminal with what each node says now, and as a diagram for a page."""

from __future__ import annotations

from rich.tree import Tree

from tulip_strategy.tree_state import NodeKind, NodeStatus, TreeState

SIGNS = {NodeKind.SELECTOR: "?", NodeKind.SEQUENCE: "→", NodeKind.DECORATOR: "◇", NodeKind.LEAF: ""}
"""As is usual for behaviour trees: a selector asks until one works, a sequence goes on while all do."""
STYLES = {
    NodeStatus.IDLE: ("dim", " "),
    NodeStatus.RUNNING: ("bold yellow", "▶"),
    NodeStatus.SUCCESS: ("green", "✓"),
    NodeStatus.FAILURE: ("red", "✗"),
}


def terminal_tree(state: TreeState, whole: bool = False) -> Tree:
    """Return the tree for a terminal.

    Args:
        state: The tree after a decision.
        whole: Also nodes that were not asked.
    """
    drawn: list[Tree | None] = []
    root = Tree("")
    for name, parent, kind, status in zip(state.names, state.parents, state.kinds, state.statuses, strict=True):
        style, mark = STYLES[status]
        label = f"[{style}]{mark} {SIGNS[kind]} {name}".replace("  ", " ") + f"[/{style}]"
        if parent < 0:
            root.label = label
            drawn.append(root)
            continue
        above = drawn[parent]
        hidden = above is None or (not whole and status is NodeStatus.IDLE)
        drawn.append(None if hidden or above is None else above.add(label))
    return root


def mermaid(state: TreeState, root: int = 0, depth: int | None = None) -> str:
    """Return a branch of the tree as a Mermaid flow chart.

    Args:
        state: The tree.
        root: Index of the branch's first node.
        depth: How many levels below that are drawn; None for all.
    """
    lines = ["```mermaid", "flowchart LR"]
    levels = {root: 0}
    for index, (name, parent, kind) in enumerate(zip(state.names, state.parents, state.kinds, strict=True)):
        if index != root and (parent not in levels or levels[parent] == depth):
            continue
        levels[index] = levels[parent] + 1 if index != root else 0
        text = f"{SIGNS[kind]} {name}".strip()
        left, right = ("([", "])") if kind is NodeKind.LEAF else ("[", "]")
        lines.append(f'    n{index}{left}"{text}"{right}')
        if index != root:
            lines.append(f"    n{parent} --> n{index}")
    return "\n".join([*lines, "```", ""])
