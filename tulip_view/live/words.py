"""What the page says in words: the game, the behaviour tree, the nodes' health. As HTML, all foreign text escaped."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from diagnostic_msgs.msg import DiagnosticStatus

from tulip_ros import topics
from tulip_ros.aggregation import by_topic
from tulip_strategy.messages import tree_from_message
from tulip_strategy.tree_drawing import SIGNS
from tulip_strategy.tree_state import NodeStatus
from tulip_view.live.buffers import Buffers
from tulip_view.state_words import doing_words, game_words, stop_words, wish_words

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


def game(buffers: Buffers) -> str:
    """Return the emergency stop if it holds, the game and the user's wish in a few lines."""
    lines = []
    stop = buffers.newest(topics.EMERGENCY_STOP)
    if stop is not None and stop.engaged:
        lines.append(f'<b style="color:{RED}">{escape(stop_words(stop))}</b>')
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
    """Return a table of the nodes: how they are, their figures, what they say.

    The rate is that of the fastest input, the latency that of the slowest; which ones these are shows where the mouse
    rests on them.
    """
    if not buffers.health:
        return "no diagnostics"
    columns = ("node", "", "rate [1/s]", "latency [ms]", "processor [%]", "restarts")
    rows = [_row("th", [name.replace(" ", "<br>") for name in columns])]
    for name, (when, status) in sorted(buffers.health.items()):
        words, colour = LEVELS.get(status.level, ("unknown", RED))
        if buffers.now - when > SILENT:
            words, colour = "silent", RED
        values = {pair.key: pair.value for pair in status.values}
        cells = [escape(name), f'<b style="color:{colour}">{words}</b>']
        cells += [_greatest(by_topic(values, "rate"), "{:.0f}"), _greatest(by_topic(values, "latency"), "{:.1f}")]
        cells += [escape(values.get(key, "")) for key in ("processor [%]", "restarts")]
        rows.append(_row("td", cells))
        if status.message != "running":
            rows.append(f'<td colspan="{len(columns)}" style="color:{colour}">{escape(status.message)}</td>')
    lines = "".join(f"<tr>{row}</tr>" for row in rows)
    return f'<table style="border-spacing:0.6em 0.1em">{lines}</table>'


def _row(tag: str, cells: Sequence[str]) -> str:
    """Return the cells of a row: words to the left, figures to the right."""
    sides = ("left", "left", *("right" for _ in cells[2:]))
    return "".join(
        f'<{tag} style="vertical-align:top;text-align:{side}">{cell}</{tag}>'
        for side, cell in zip(sides, cells, strict=True)
    )


def _greatest(figures: dict[str, float], form: str) -> str:
    """Return the greatest figure, with its topic as what a mouse that rests there is told."""
    topic = max(figures, key=lambda each: figures[each], default="")
    return f'<span title="{escape(topic)}">{form.format(figures[topic])}</span>' if topic else ""
