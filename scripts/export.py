"""Make a time-aligned table of a recording: CSV, Parquet or MATLAB."""

from __future__ import annotations

import sys

import _environment

if __name__ == "__main__":
    _environment.prepare(("batch",) if any(word.endswith(".parquet") for word in sys.argv) else ())

import signal
from pathlib import Path
from typing import Annotated

import typer
from _progress import progress

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
from tulip_ros.log_file import Log
from tulip_view.columns import GROUPS
from tulip_view.recording import choose_robot, expected_messages, read
from tulip_view.table_files import check_target, files_of, write_table
from tulip_view.tables import LONGEST_GAP, make_table, native_times, regular_times, sources_of, topics_of

RATE = 50.0  # [Hz] of the rows, where nothing else is said: that of the control cycle's messages
INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it


def main(
    file: Annotated[Path, typer.Argument(help="Folder of the recording, or MCAP file.")],
    to: Annotated[Path, typer.Option(help="New file; ends in .csv, .parquet or .mat.")],
    groups: Annotated[str, typer.Option(help=f"Groups of columns: {', '.join(GROUPS)}.")] = ",".join(GROUPS),
    rate: Annotated[float | None, typer.Option(help="Rows a second [Hz]; 50 without --times-of.")] = None,
    times_of: Annotated[
        str | None, typer.Option(help="A row for each message of this topic, as in motion_state, instead of --rate.")
    ] = None,
    robot: Annotated[str | None, typer.Option(help="Of two robots: striker or keeper.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there already.")] = False,
) -> None:
    """Export; positions, speeds and torques are interpolated, states and decisions are those of the last message."""
    try:
        if rate is not None and times_of is not None:
            raise BadInputError("--rate and --times-of are two ways to choose the rows; expected one of them.")
        check_target(to, force)
        sources = sources_of([name.strip() for name in groups.split(",") if name.strip()])
        if not sources:
            raise BadInputError(f"--groups is empty; expected some of {', '.join(GROUPS)}.")
        with Log(file) as log:
            chosen = choose_robot(log, robot)
            native = None if times_of is None else times_of.removeprefix(f"/{chosen}/").lstrip("/")
            wanted = topics_of(sources, native)
            with progress() as bar:
                task = bar.add_task("reading", total=expected_messages(log, chosen, wanted))
                recording = read(log, chosen, wanted, lambda number: bar.advance(task, number))
                bar.update(task, description="aligning", total=None)
                times = (
                    regular_times(recording, RATE if rate is None else rate)
                    if native is None
                    else native_times(recording, native)
                )
                table = make_table(recording, sources, times)
                if len(table.columns) == 1:
                    raise BadInputError(
                        f"Recording {file} has none of the topics for --groups {groups}; expected one of "
                        f"{', '.join(source.topic.name for source in sources)}."
                    )
                bar.update(task, description="writing")
                write_table(table, to)
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        print(f"stopped; {to} was not written", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    if len(recording.robots) > 1:
        others = ", ".join(name for name in recording.robots if name != chosen)
        print(f"robot {chosen} (with --robot: {others})")
    if recording.runs > 1:
        print(f"time began anew {recording.runs - 1} times in this recording; the table holds the longest part")
    for line in recording.remarks:
        print(f"note: {line}")
    for line in table.left_out:
        print(f"left out, not in the recording: {line}")
    kinds = [column.alignment.value for column in table.columns[1:]]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
    print(f"between messages: {counts}; nothing over gaps longer than {LONGEST_GAP:g} s")
    print(f"wrote {len(table)} rows, {len(table.columns)} columns to {' and '.join(map(str, files_of(to)))}")


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    typer.run(main)
