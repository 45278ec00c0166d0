"""What the page says in words: the game, the behaviour tree, the nodes' health. As HTML, all foreign text escaped."""

from __future__ import annotations

import math
from html import escape

from diagnostic_msgs.msg import DiagnosticStatus

from tulip_ros import topics
from tulip_strategy.messages import tree_from_message
from tulip_strategy.tree_drawing import SIGNS
from tulip_strategy.tree_state import NodeStatus
from tulip_view.live.buffers import Buffers
from tulip_view.state_words import doing_words, game_words, wish_words

GREEN, YELLOW, RED, DIM = "#2b8a3e", "#b26b00", "#c92a2a", "#868e96"
MARKS = {
    NodeStatus.IDLE: (DIM, " "),
    NodeStatus.RUNNING: (YELLOW, "▶"),
    NodeStatus.SUCCESS: (GREEN, "✓"),
    NodeStatus.FAILURE: (DIM, "✗"),  # the branches that do not apply: nothing to worry about
}
LEVELS = {
    DiagnosticStatus.OK: ("ok", GREEN),
    DiagnosticStatus.WARN: ("warning", YELLOW),
    DiagnosticStatus.ERROR: ("error", RED),
    DiagnosticStatus.STALE: ("stale", RED),
}
SILENT = 3.0  # [s] without diagnostics, which come each second
RATE = "rate "
FIGURES = ("latency", "processor", "restarts")
"""Values of a node's diagnostics that are shown beside its rate, by the beginning of their keys."""


def game(buffers: Buffers) -> str:
    """Return the game and the user's wish in a few lines."""
    lines = []
    for title, topic, words in (
        ("user", topics.USER_COMMAND, wish_words),
        ("game", topics.GAME_STATE, game_words),
        ("doing", topics.DECISION, doing_words),
    ):
        message = buffers.newest(topic)
        if message is not None:
            lines.append(f"{title}: <b>{escape(words(message))}</b>")
    return "<br>".join(lines) or "no game"


def tree(buffers: Buffers) -> str:
    """Return the branches of the behaviour tree that were asked."""
    message = buffers.newest(topics.BEHAVIOUR_TREE)
    if message is None:
        return "no behaviour tree"
    state = tree_from_message(message)
    levels: dict[int, int] = {}
    lines = []
    for index, (name, parent, kind, status) in enumerate(
        zip(state.names, state.parents, state.kinds, state.statuses, strict=True)
    ):
        if parent >= 0 and (parent not in levels or status is NodeStatus.IDLE):
            continue
        levels[index] = levels[parent] + 1 if parent >= 0 else 0
        colour, mark = MARKS[status]
        lines.append(
            f'<div style="margin-left:{0.8 * levels[index]:.1f}em;color:{colour}">'
            f"{mark} {SIGNS[kind]} {escape(name)}</div>"
        )
    return "".join(lines)


def health(buffers: Buffers) -> str:
    """Return a table of the nodes: how they are, their fastest input, what else they tell of themselves."""
    if not buffers.health:
        return "no diagnostics"
    rows = []
    for name, (when, status) in sorted(buffers.health.items()):
        words, colour = LEVELS.get(status.level, ("unknown", RED))
        if buffers.now - when > SILENT:
            words, colour = "silent", RED
        figures = {pair.key: pair.value for pair in status.values}
        rates = {key.split()[1]: _number(value) for key, value in figures.items() if key.startswith(RATE)}
        fastest = max(rates, key=lambda topic: rates[topic], default="")
        shown = [f"{rates[fastest]:.0f}/s {fastest}"] if fastest else []
        shown += [f"{key} {value}" for key, value in figures.items() if key.startswith(FIGURES)]
        says = "" if status.message == "running" else f"<br>{escape(status.message)}"
        rows.append(
            f'<tr><td style="vertical-align:top">{escape(name)}</td>'
            f'<td style="vertical-align:top;color:{colour}"><b>{words}</b></td>'
            f"<td>{escape(', '.join(shown))}{says}</td></tr>"
        )
    return f'<table style="border-spacing:0.5em 0.1em">{"".join(rows)}</table>'


def _number(words: str) -> float:
    """Return a number that somebody else wrote; NaN for one that is none."""
    try:
        return float(words)
    except ValueError:
        return math.nan
