"""What each node reports, read from the programs for the documentation: inputs, checks and events."""

from __future__ import annotations

import ast
import importlib.util
from collections.abc import Iterator
from pathlib import Path

from tulip_ros.nodes import DRIVER, DRIVERS, NODES, ROBOT
from tulip_ros.topics import heard_by


def markdown_table() -> str:
    """Return a table of the robot's nodes and its drivers: what each misses, tells and counts."""
    lines = ["| node | misses, after so long | tells | counts |", "| --- | --- | --- | --- |"]
    modules = {DRIVER: [entry.module for entry in DRIVERS.values()]}
    modules |= {name: [NODES[name].module] for name in ROBOT}
    for name, own in modules.items():
        missed = [f"`{topic.name}` {topic.missed_after:g} s" for topic in heard_by(name) if topic.missed_after]
        sources = [ast.parse(path.read_text()) for path in _files(own)]
        told = dict.fromkeys(words for source in sources for words in _checks(source))
        counted = dict.fromkeys(words for source in sources for words in _events(source))
        cells = (", ".join(missed), "; ".join(told), ", ".join(sorted(counted)))
        lines.append(f"| {name} | {' | '.join(cell or '-' for cell in cells)} |")
    return "\n".join(lines) + "\n"


def _files(modules: list[str]) -> Iterator[Path]:
    """Yield the files of modules, and of those that they import from their own package and that report, too."""
    waiting, seen = list(modules), set()
    while waiting:
        module = waiting.pop(0)
        spec = importlib.util.find_spec(module)
        if module in seen or spec is None or spec.origin is None:
            continue
        seen.add(module)
        path = Path(spec.origin)
        text = path.read_text()
        if module not in modules and "health." not in text:
            continue
        yield path
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == module.split(".")[0]:
                waiting.append(node.module)


def _calls(source: ast.AST, method: str) -> Iterator[ast.expr]:
    """Yield the first argument of each call of `health.METHOD`."""
    for node in ast.walk(source):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == method:
            if ast.unparse(node.func.value).split(".")[-1] == "health" and node.args:
                yield node.args[0]


def _checks(source: ast.AST) -> Iterator[str]:
    """Yield what each check tells, from the first line of its docstring."""
    functions = {node.name: node for node in ast.walk(source) if isinstance(node, ast.FunctionDef)}
    for argument in _calls(source, "check"):
        if isinstance(argument, ast.Attribute) and argument.attr in functions:
            words = (ast.get_docstring(functions[argument.attr]) or "").partition("\n")[0]
            yield words.removeprefix("Tell ").rstrip(".")


def _events(source: ast.AST) -> Iterator[str]:
    """Yield the names of the events that are counted; what is only known when one happens becomes three dots."""
    for argument in _calls(source, "count"):
        if isinstance(argument, ast.Constant):
            yield str(argument.value)
        elif isinstance(argument, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "..." for part in argument.values)
