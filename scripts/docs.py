"""Write the generated parts of the pages anew: the node graph, tables of topics, diagnostics and faults, the trees."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import re
from collections.abc import Iterator
from pathlib import Path

from tulip_description.field import load_field
from tulip_ros.health_table import markdown_table as health_table
from tulip_ros.topics import markdown_graph, markdown_tables
from tulip_sim.fault_table import markdown_table as fault_table
from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_strategy.tree_drawing import mermaid

PAGES = Path(__file__).resolve().parent.parent / "docs"


def parts() -> Iterator[tuple[str, str, str]]:
    """Return the generated parts: page, name of the block, content."""
    yield "architecture.md", "graph", markdown_graph()
    yield "architecture.md", "topics", markdown_tables()
    yield "diagnostics.md", "health", health_table()
    yield "safety.md", "faults", fault_table()
    tree = Strategy(StrategyParameters(), load_field()).tree
    yield "strategy.md", "game", mermaid(tree, 0, depth=1)
    for name in STRATEGIES:
        yield "strategy.md", name, mermaid(tree, tree.names.index(name))


def render(page: str, text: str) -> str:
    """Return the text of a page with its generated parts made anew.

    Raises:
        ValueError: if a block is not in the text, or more than once.
    """
    for of, name, part in parts():
        if of != page:
            continue
        block = f"<!-- {name} -->\n{part}<!-- /{name} -->"
        pieces = re.split(rf"<!-- {name} -->\n.*?<!-- /{name} -->", text, flags=re.DOTALL)
        if len(pieces) != 2:
            raise ValueError(f"{page} holds {len(pieces) - 1} blocks <!-- {name} -->; expected 1")
        text = block.join(pieces)
    return text


if __name__ == "__main__":
    for page in sorted({page for page, _, _ in parts()}):
        path = PAGES / page
        path.write_text(render(page, path.read_text()))
        print(f"wrote {path}")
