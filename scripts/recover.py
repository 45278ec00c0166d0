"""Mend a recording that was cut or damaged: all that is whole goes into a new one beside it."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, DownloadColumn, Progress, TimeRemainingColumn
from rich.table import Table

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
from tulip_ros.log_file import files_of
from tulip_ros.recovery import Recovery, recover

SHOWN = 5  # damages of a file that are listed


def main(
    path: Annotated[Path, typer.Argument(help="Folder of a recording, or one MCAP file.")],
    output: Annotated[
        Path | None, typer.Option(help="New folder for what is saved; none: beside, NAME_recovered.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the recording that is in that folder.")] = False,
) -> None:
    """Save what is whole in a recording, and say what is lost. The old recording is never changed.

    The exit code is 0 when the recording is whole or was mended, 2 when nothing can be saved.
    """
    console = Console()
    try:
        size = sum(file.stat().st_size for file in files_of(path))
        with Progress(BarColumn(), DownloadColumn(), TimeRemainingColumn(), console=console, transient=True) as bar:
            task = bar.add_task("recovering", total=2 * size)
            result = recover(path, output, force, lambda count: bar.advance(task, count))
    except (BadInputError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    if result.output is None:
        console.print(f"{escape(str(path))} is whole: there is nothing to mend.", soft_wrap=True)
        return
    show(result, console)


def show(result: Recovery, console: Console) -> None:
    """Print what was wrong, what was saved, and what is lost."""
    for each in result.files:
        more = len(each.damages) - SHOWN
        damages = [*each.damages[:SHOWN], *([f"and {more} damages more"] if more > 0 else [])]
        what = "; ".join(damages) or "is whole"
        console.print(f"{each.source.name}: {what}", markup=False, highlight=False, soft_wrap=True)
        seconds = (each.last - each.first) * 1e-9
        console.print(
            f"  saved {sum(each.messages.values())} messages over {seconds:.2f} s, {each.metadata} notes,"
            f" {each.attachments} attached files; {each.damaged_bytes} bytes could not be used",
            highlight=False,
            soft_wrap=True,
        )
    saved: dict[str, int] = {}
    lost: dict[str, int] = {}
    for each in result.files:
        for topic, count in each.messages.items():
            saved[topic] = saved.get(topic, 0) + count
        for topic, count in each.lost.items():
            lost[topic] = lost.get(topic, 0) + count
    table = Table("topic", "saved", "lost", box=None)
    for topic in sorted({*saved, *lost}):
        table.add_row(escape(topic), str(saved.get(topic, 0)), str(lost.get(topic, 0)))
    console.print(table)
    if any(each.damages for each in result.files):
        console.print("After the last saved message, a recorder that was killed had at most one second more.")
    console.print(f"written: {escape(str(result.output))}", soft_wrap=True)


if __name__ == "__main__":
    typer.run(main)
