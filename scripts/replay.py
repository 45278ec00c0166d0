"""Play a recording back to its topics; or compute components anew on its inputs and say what differs."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import json
import signal
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_writable
from tulip_ros.keys import Keys
from tulip_ros.log_edit import making_room
from tulip_ros.log_file import Log
from tulip_ros.replay import ReplayParameters
from tulip_ros.replay_node import ReplayNode
from tulip_ros.run import session
from tulip_sim.recompute.run import COMPONENTS, Outcome, plain, recompute
from tulip_sim.recompute.verdict import HEADINGS, bounds_of, rows, truth_rows, violations

LINE = 0.2  # [s] between two lines that tell how far a replay is


def main(
    file: Annotated[Path, typer.Argument(help="The recording: its folder, or an MCAP file.")],
    rate: Annotated[float, typer.Option(help="Times the recorded speed.")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end.")] = False,
    start: Annotated[float, typer.Option(help="Seconds from the beginning.")] = 0.0,
    duration: Annotated[float, typer.Option(help="Seconds to play; 0 for the rest.")] = 0.0,
    topics: Annotated[
        list[str] | None, typer.Option(help="Regular expression of whole topic names; repeatable.")
    ] = None,
    exclude: Annotated[
        list[str] | None, typer.Option(help="Regular expression of whole topic names; repeatable.")
    ] = None,
    paused: Annotated[bool, typer.Option("--paused", help="Begin with a pause.")] = False,
    step: Annotated[float, typer.Option(help="Recorded seconds of one step.")] = ReplayParameters.step,
    anew: Annotated[
        str | None, typer.Option("--recompute", help=f"Play nothing; compute anew: {', '.join(COMPONENTS)}.")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="New folder for the recomputed recording.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an old recording in that folder.")] = False,
    no_output: Annotated[bool, typer.Option("--no-output", help="Only compare.")] = False,
    parameters: Annotated[
        list[Path] | None, typer.Option(help="YAML file for the components, over what was recorded; repeatable.")
    ] = None,
    bound: Annotated[
        list[str] | None, typer.Option(help="As in world_state:position=0.02 or truth:ball_recall=0.9; repeatable.")
    ] = None,
    json_path: Annotated[Path | None, typer.Option("--json", help="Write the comparison to this file.")] = None,
) -> None:
    """Replay, with keys: space pauses and resumes, s steps, + and - change the speed, q ends.

    With --recompute the exit code is 0 if all is as recorded or inside the bounds, 1 if not, 2 for bad input.
    """
    console = Console()
    try:
        if anew is None:
            if output or no_output or parameters or bound or json_path or force:
                raise BadInputError(
                    "--output, --no-output, --force, --parameters, --bound and --json are for --recompute."
                )
            settings = ReplayParameters(
                str(file), rate, loop, start, duration, tuple(topics or ()), tuple(exclude or ()), paused, step
            )
            play(settings, console)
            return
        if json_path is not None:
            check_writable(json_path, "--json")
        components = [name.strip() for name in anew.split(",") if name.strip()]
        limits = bounds_of(bound or ())
        base = file if file.is_dir() else file.with_suffix("")
        folder = None if no_output else output or base.with_name(f"{base.resolve().name}_recomputed")
        with Log(file) as log:
            begin = time.monotonic()
            if folder is None:
                outcome = compare(log, components, None, parameters or (), console)
            else:
                with making_room(folder, force, [file]):
                    outcome = compare(log, components, folder, parameters or (), console)
            took = time.monotonic() - begin
        wrong = violations(outcome, limits)
    except (BadInputError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    show(outcome, console)
    console.print(f"{outcome.seconds:.1f} s in {took:.1f} s: {outcome.seconds / took:.1f} times real time")
    if folder is not None:
        console.print(f"written to {folder}", highlight=False, soft_wrap=True)
    if json_path is not None:
        json_path.write_text(json.dumps({**plain(outcome), "violations": wrong}, indent=2) + "\n")
    for line in wrong:
        console.print(f"[bold]different:[/] {line}", highlight=False, soft_wrap=True)
    raise typer.Exit(1 if wrong else 0)


def play(settings: ReplayParameters, console: Console) -> None:
    """Play until the end, Ctrl-C or q."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with (
            session(lambda: ReplayNode(settings), arguments=[], handle_signals=False) as (node, spin),
            Keys() as keys,
        ):
            for name, reason in node.left_out.items():
                console.print(f"left out: {name}, {reason}", highlight=False, soft_wrap=True)
            told = 0.0
            while not node.player.ended:
                node.advance(spin)
                now = time.monotonic()
                if now - told > LINE:
                    told = now
                    key = keys.pressed()
                    if key == "q":
                        break
                    if key:
                        node.player.key(key)
                    tell(node, console)
            spin(LINE)  # the last messages leave
            late = node.player.lateness
    except KeyboardInterrupt:
        console.print("\nstopped")
        return
    if late:
        median = statistics.median(late) * 1e-6
        console.print(f"\n{len(late)} messages, {median:.2f} ms late in the median")


def tell(node: ReplayNode, console: Console) -> None:
    """Tell on a terminal how far the replay is."""
    schedule = node.player.schedule
    if schedule is not None and console.is_terminal:
        at = max(0.0, (schedule.position(time.monotonic_ns()) - node.player.passage.first) * 1e-9)
        state = "paused" if schedule.paused else f"{schedule.rate:g} x"
        console.print(f"{at:8.2f} s  {state}   ", end="\r", highlight=False)


def compare(
    log: Log, components: Sequence[str], folder: Path | None, files: Sequence[Path], console: Console
) -> Outcome:
    """Recompute, with a bar that shows how far it is."""
    columns = (TextColumn("recomputing"), BarColumn(bar_width=20), TextColumn("{task.completed:6.1f} s"))
    # Refreshed here, not by a thread of its own: with another thread, components could not have processes beside.
    with Progress(*columns, TimeElapsedColumn(), console=console, transient=True, auto_refresh=False) as bar:
        first, last = log.span
        task = bar.add_task("", total=(last - first) * 1e-9)
        progress: Callable[[float], None] = lambda done: bar.update(task, completed=done, refresh=True)  # noqa: E731
        return recompute(log, components, folder, files, progress)


def show(outcome: Outcome, console: Console) -> None:
    """Print the tables."""
    for title, headings, lines in (
        ("recorded and recomputed", HEADINGS, rows(outcome)),
        ("against the truth", ("robot", "figure", "recorded", "recomputed"), truth_rows(outcome)),
    ):
        if lines:
            table = Table(title=title, title_justify="left")
            for heading in headings:
                table.add_column(heading, overflow="fold")
            for cells in lines:
                table.add_row(*(escape(cell) for cell in cells))
            console.print(table)
    if outcome.lossy:
        console.print("Pictures are recorded with losses: vision cannot find exactly the same in them.")
    if not outcome.lockstep:
        console.print("A graph's recording: inputs were taken in the order that recorded outputs document.")
    for line in outcome.shortcomings:
        console.print(f"note: {line}", highlight=False, soft_wrap=True)


if __name__ == "__main__":
    typer.run(main)
