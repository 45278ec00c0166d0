"""The parts of the menu's screen. Words say everything; colours only stress it, for terminals that have none."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from tulip_motion.identification.progress import Progress
from tulip_strategy.interface import UserRequest
from tulip_view.menu.sight import Sight
from tulip_view.menu.speeds import Velocity
from tulip_view.state_words import wish_words

STYLES = {"ok": "green", "starting": "", "warning": "bold yellow", "error": "bold red", "silent": "bold red"}
VERDICTS = {"taken": "green", "sent": "green", "refused": "bold red", "not done": "bold red"}
KEYS = (
    "[l] EMERGENCY STOP  [o] release  [x] stop  [u] stand  [d] limp  [s] start",
    "[c] strategy  [w] walk test  [k] kick  [p] push  [r] record on/off  [i] identify",
    "[PgUp PgDn] nodes  [Ctrl-Q] quit",
)
NO_WALK_TEST = "walk    w begins the walk test; it walks by the arrow keys, q and e"
SHOWN_OUTCOMES = 2


def headline(sight: Sight) -> Text:
    """Return whose menu this is, and what matters most."""
    name = f" {sight.robot or 'TUlip'} "
    if sight.stop:
        words = f"{sight.stop}; o releases it, the robot stays limp then"
        lost = f" ({sight.missing})" if sight.missing else ""
        return Text.assemble((name, "bold reverse"), " ", (words, "bold reverse red"), lost)
    words = sight.missing or sight.sum
    state = "error" if sight.missing else sight.state
    return Text.assemble((name, "bold reverse"), " ", (state, STYLES[state]), f": {words}")


def state(sight: Sight) -> Table:
    """Return the game, what the robot does, the wish that holds, time and recording."""
    table = Table.grid(padding=(0, 1), expand=True)
    table.add_column(width=7)
    table.add_column(ratio=1, no_wrap=True, overflow="ellipsis")
    table.add_column(justify="right", no_wrap=True)
    command = sight.command
    wish = Text(wish_words(command) if command is not None else "-", "bold")
    if command is not None and command.request is UserRequest.LIMP:
        wish = Text(" LIMP ", "bold reverse red")
    elif command is not None and command.request is not UserRequest.PLAY:
        wish.append(f" (strategy {command.strategy})", "not bold")
    mode = Text.assemble((sight.mode or "no word from motion", "bold"), f": {sight.reason}" if sight.reason else "")
    time = f"time {int(sight.time)} s" if sight.time is not None else "no time"
    table.add_row("game", sight.game or "no word from game_input", time)
    table.add_row("wish", wish, _recording(sight.recording))
    table.add_row("does", sight.doing or "no word from strategy", _experiment(sight.experiment))
    table.add_row("legs", mode, "")
    return table


def walk(wanted: Velocity, in_walk_test: bool) -> Text:
    """Return the walk test's speeds and their keys."""
    if not in_walk_test:
        return Text(NO_WALK_TEST)
    forward, left, turning = (value or 0.0 for value in wanted)  # no minus before zero
    return Text.assemble(
        ("walk    ", ""),
        (f"forward {forward:+.2f}", "bold"),
        " ↑↓  ",
        (f"left {left:+.2f}", "bold"),
        " m/s ←→  ",
        (f"turn {turning:+.1f}", "bold"),
        " rad/s q e  space: 0",
    )


def outcomes(sight: Sight, hint: str) -> Text:
    """Return what came of the last wishes, or a hint."""
    lines = [Text(hint, "bold")] if hint else []
    for outcome in sight.outcomes:
        line = Text.assemble((f"{outcome.what}: ", ""), (outcome.verdict, VERDICTS[outcome.verdict]))
        lines.append(line.append(f" ({outcome.words})" if outcome.words else ""))
    return Text("\n").join(lines[:SHOWN_OUTCOMES])


def nodes(sight: Sight) -> Table:
    """Return the table of nodes."""
    table = Table(box=None, expand=True, padding=(0, 1, 0, 0), header_style="underline")
    table.add_column("node", no_wrap=True)
    table.add_column("state", no_wrap=True)
    table.add_column("fastest input [1/s]", no_wrap=True)
    table.add_column("cpu [%]", justify="right", no_wrap=True)
    table.add_column("restarts", justify="right", no_wrap=True)
    table.add_column("says", ratio=1, no_wrap=True, overflow="ellipsis")
    for line in sight.nodes:
        state = Text(line.state, STYLES[line.state])
        table.add_row(
            line.name, state, line.fastest_input, line.processor or "-", line.restarts or "-", Text(line.says)
        )
    return table


def said(sight: Sight) -> Text:
    """Return what nodes complained of last, with remedies."""
    lines = [
        Text.assemble(f"{each.time} ", (f"{each.node} {each.state}", STYLES[each.state]), f": {each.words}")
        for each in sight.said
    ]
    return Text("\n").join(lines) if lines else Text("no node has complained")


def _recording(file: str | None) -> Text:
    if file is None:
        return Text("no recorder")
    return Text("● RECORDING", "bold") if file else Text("not recording")


def _experiment(progress: Progress | None) -> Text:
    if progress is None:
        return Text("")
    how = f"aborted: {progress.reason}" if progress.reason else "ended" if progress.finished else progress.doing.value
    if progress.postures == 0:
        return Text("identification: i begins")
    left = "" if progress.finished else f", {progress.seconds_left:.0f} s left"
    return Text(f"identification {progress.held}/{progress.postures}, {how}{left}", "bold")
