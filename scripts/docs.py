"""Write the generated parts of docs/architecture.md anew: the node graph and the tables of topics."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import re
from pathlib import Path

from tulip_ros.topics import markdown_graph, markdown_tables

PAGE = Path(__file__).resolve().parent.parent / "docs" / "architecture.md"


def render(text: str) -> str:
    """Return the page with its generated parts made anew."""
    for name, part in (("graph", markdown_graph()), ("topics", markdown_tables())):
        block = f"<!-- {name} -->\n{part}<!-- /{name} -->"
        pieces = re.split(rf"<!-- {name} -->\n.*?<!-- /{name} -->", text, flags=re.DOTALL)
        if len(pieces) != 2:
            raise ValueError(f"{PAGE.name} holds {len(pieces) - 1} blocks <!-- {name} -->; expected 1")
        text = block.join(pieces)
    return text


if __name__ == "__main__":
    PAGE.write_text(render(PAGE.read_text()))
    print(f"wrote {PAGE}")
