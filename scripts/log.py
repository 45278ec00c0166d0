"""A quick look into recordings: what they hold, their messages as text; cut a part out, merge several into one."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import fnmatch
import json
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer
import yaml
from _progress import progress
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, unknown
from tulip_ros.log_edit import cut as cut_log
from tulip_ros.log_edit import making_room
from tulip_ros.log_edit import merge as merge_logs
from tulip_ros.log_file import Log
from tulip_ros.log_summary import rhythms
from tulip_ros.message_text import select, without_nan

INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it
SECOND = 10**9  # [ns]
MIB = 2**20
WIDE = 160  # columns of a table that goes into a file or a pipe
DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # in C it is ten times as fast, where it was compiled

app = typer.Typer(help=__doc__, no_args_is_help=True, add_completion=False)

Recordings = Annotated[list[Path], typer.Argument(help="Folders of recordings, or MCAP files.")]
Recording = Annotated[Path, typer.Argument(help="Folder of a recording, or MCAP file.")]
Topics = Annotated[list[str] | None, typer.Option("--topic", "-t", help="Name or pattern (* ?); repeatable.")]
Begin = Annotated[float | None, typer.Option("--from", help="Seconds after the recording's begin.")]
End = Annotated[float | None, typer.Option("--to", help="Seconds after the recording's begin.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="New folder for the new recording.")]
Force = Annotated[bool, typer.Option("--force", help="Replace a recording that is there already.")]


@contextmanager
def told() -> Iterator[None]:
    """Turn errors into one line and an exit code."""
    try:
        yield
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    except BrokenPipeError:  # as in `log.py cat FILE | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit() from None


def output() -> Console:
    """Return where tables go: as wide as the terminal, or wide enough for all that they hold."""
    return Console() if sys.stdout.isatty() else Console(width=WIDE)


@app.command()
def info(files: Recordings) -> None:
    """Tell how long, how large and whole recordings are, what is in them, and what their recorder noted."""
    console = output()
    bad = 0
    for path in files:
        try:
            with Log(path) as log:
                show_info(log, console)
        except BadInputError as error:
            bad += 1
            print(f"error: {error}", file=sys.stderr)
    if bad:
        raise typer.Exit(EXIT_BAD_INPUT)


def show_info(log: Log, console: Console) -> None:
    """Print one recording's table."""
    first, last = log.span
    duration = (last - first) / SECOND
    messages = sum(topic.messages for topic in log.topics.values())
    size = sum(file.stat().st_size for file in log.files)
    table = Table(title=escape(str(log.path)), show_header=False, title_justify="left")
    rows = [
        ("ended", "yes, with its index; what is inside is checked when it is read, as by `topics`"),
        ("files", ", ".join(f"{file.name} ({file.stat().st_size / MIB:.1f} MiB)" for file in log.files)),
        ("size", f"{size / MIB:.1f} MiB" + (f", {size / MIB / duration * 60.0:.1f} MiB a minute" if duration else "")),
        ("duration", f"{duration:.2f} s"),
        ("begins", moment(first)),
        ("messages", f"{messages} on {len(log.topics)} topics"),
    ]
    for name, value in rows:
        table.add_row(name, escape(value))
    for note, values in log.metadata.items():
        text = "\n".join(f"{key}: {value}" for key, value in values.items())
        table.add_row(f"note {escape(note)}", escape(text))
    for each in log.attachments():
        table.add_row(f"file {escape(each.name)}", escape(f"{len(each.data)} B, {each.media_type}"))
    if not log.metadata:
        table.add_row("notes", "none: the recorder noted nothing about itself")
    console.print(table)
    rates = Table("topic", "messages", "1/s", box=None)
    for topic in log.topics.values():
        rates.add_row(topic.name, str(topic.messages), f"{topic.messages / duration:.1f}" if duration else "-")
    console.print(rates)


def moment(stamp: int) -> str:
    """Return a log time [ns] for people: a date, or seconds of a simulation."""
    if stamp < 10**9 * SECOND:  # before 2001 nobody recorded anything: it is time of a simulation
        return f"{stamp / SECOND:.3f} s of simulated time"
    return datetime.fromtimestamp(stamp / SECOND, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


@app.command()
def topics(file: Recording) -> None:
    """Tell types, numbers and mean rates of all topics, and the largest gap between two messages of each."""
    with told(), Log(file) as log:
        with progress() as bar:
            task = bar.add_task("reading", total=sum(topic.messages for topic in log.topics.values()))
            found = rhythms(log, lambda number: bar.advance(task, number))
        begin = log.span[0]
        table = Table("topic", "type")
        for column in ("messages", "mean 1/s", "largest gap s", "at s", "KiB each"):
            table.add_column(column, justify="right")
        for name, rhythm in found.items():
            enough = rhythm.messages > 1
            table.add_row(
                name,
                log.topics[name].type_name,
                str(rhythm.messages),
                f"{rhythm.rate:.1f}" if rhythm.rate == rhythm.rate else "-",
                f"{rhythm.largest_gap:.3f}" if enough else "-",
                f"{(rhythm.gap_begins - begin) / SECOND:.2f}" if enough else "-",
                f"{rhythm.size / rhythm.messages / 1024:.2f}" if rhythm.messages else "-",
            )
        output().print(table)


@app.command()
def cat(
    file: Recording,
    topic: Topics = None,
    begin: Begin = None,
    end: End = None,
    fields: Annotated[str, typer.Option(help="Only these, as in header.stamp,robot_pose.0,ball.position.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object a line instead of YAML.")] = False,
    limit: Annotated[int | None, typer.Option("--number", "-n", help="End after so many messages.", min=1)] = None,
) -> None:
    """Print messages as YAML documents, or as JSON lines (NaN becomes null)."""
    with told(), Log(file) as log:
        names, (start, stop) = chosen(log, topic), window(log, begin, end)
        wanted = [field.strip() for field in fields.split(",") if field.strip()]
        for number, record in enumerate(log.records(names, start, stop), 1):
            content = select(log.decode(record), wanted)
            entry = {"topic": record.topic.name, "log_time": record.log_time, **content}
            if as_json:
                print(json.dumps(without_nan(entry), ensure_ascii=False))
            else:
                text = yaml.dump(entry, Dumper=DUMPER, sort_keys=False, allow_unicode=True, default_flow_style=None)
                print(text, end="---\n")
            if number == limit:
                break


@app.command()
def cut(
    file: Recording, folder: Output, topic: Topics = None, begin: Begin = None, end: End = None, force: Force = False
) -> None:
    """Write a part of a recording, by time and by topics, into a new recording."""
    with told(), Log(file) as log:
        names, (start, stop) = chosen(log, topic), window(log, begin, end)
        total = sum(log.topics[name].messages for name in names)
        with making_room(folder, force, [file]), progress() as bar:
            task = bar.add_task("cutting", total=total)
            written = cut_log(log, names, start, stop, folder, lambda number: bar.advance(task, number))
            if not written:
                print("warning: nothing lies in that time on those topics; the new recording is empty", file=sys.stderr)
    print(f"wrote {written} messages to {folder}")


@app.command()
def merge(files: Recordings, folder: Output, force: Force = False) -> None:
    """Write several recordings into one, in the order of time."""
    with told():
        if len(files) < 2:
            raise BadInputError(f"There is {len(files)} recording to merge; expected at least two.")
        logs: list[Log] = []
        try:
            logs.extend(Log(path) for path in files)
            total = sum(topic.messages for log in logs for topic in log.topics.values())
            with making_room(folder, force, files), progress() as bar:
                task = bar.add_task("merging", total=total)
                written = merge_logs(logs, folder, lambda number: bar.advance(task, number))
        finally:
            for log in logs:
                log.close()
    print(f"wrote {written} messages to {folder}")


def chosen(log: Log, patterns: list[str] | None) -> list[str]:
    """Return the names of topics that fit names or patterns; all without any.

    Raises:
        BadInputError: if one fits nothing.
    """
    if not patterns:
        return list(log.topics)
    names: dict[str, None] = {}
    for pattern in patterns:
        # Without a slash it is the name within a robot's namespace, of whichever robot.
        forms = (pattern,) if pattern.startswith(("/", "*")) else (f"/{pattern}", f"/*/{pattern}")
        found = [name for name in log.topics if any(fnmatch.fnmatchcase(name, form) for form in forms)]
        if not found:
            raise unknown("topic", forms[0], log.topics)
        names.update(dict.fromkeys(found))
    return list(names)


def window(log: Log, begin: float | None, end: float | None) -> tuple[int | None, int | None]:
    """Return log times [ns] for seconds after the recording's begin.

    Raises:
        BadInputError: if nothing lies between them.
    """
    first, last = log.span
    duration = (last - first) / SECOND
    if begin is not None and begin > duration:
        raise BadInputError(f"--from is {begin:g} s; expected at most {duration:.2f} s, when the recording ends.")
    if end is not None and end <= (begin or 0.0):
        raise BadInputError(f"--to is {end:g} s; expected more than --from ({begin or 0.0:g} s).")
    start = None if begin is None else first + round(begin * SECOND)
    return start, None if end is None else first + round(end * SECOND)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    app()
