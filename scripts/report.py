"""Make a report of a recording: one HTML file that opens from disk; a PDF and pictures on request."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare(("report",))

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
from _progress import progress

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_new_file
from tulip_ros.log_file import Log
from tulip_view.recording import choose_robot, expected_messages, robots_in
from tulip_view.report.build import WANTED, Report, make_report

INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it


def main(
    file: Annotated[Path, typer.Argument(help="Folder of the recording, or MCAP file.")],
    to: Annotated[Path | None, typer.Option(help="The page; none: report.html in the recording's folder.")] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Also a PDF, beside the page.")] = False,
    png: Annotated[Path | None, typer.Option(help="Folder for each figure as a PNG, too.")] = None,
    robot: Annotated[str | None, typer.Option(help="Of two robots: striker or keeper.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there already.")] = False,
) -> None:
    """Tell what happened in a recording."""
    try:
        with Log(file) as log:
            chosen = choose_robot(log, robot)
            others = [name for name in robots_in(log) if name != chosen]
            page = to or _default(file, chosen if others else "")
            targets = [page, *([page.with_suffix(".pdf")] if pdf else [])]
            for target in targets:
                check_new_file(target, "--to", force)
            if png is not None and png.exists() and (not png.is_dir() or (any(png.iterdir()) and not force)):
                raise BadInputError(f"--png {png} is not an empty folder; name another one, or give --force.")
            with progress() as bar:
                task = bar.add_task("reading", total=expected_messages(log, chosen, WANTED))
                report = make_report(
                    log,
                    chosen,
                    lambda number: bar.advance(task, number),
                    lambda words: bar.update(task, description=words),
                )
                written = write(report, page, pdf, png, lambda words: bar.update(task, description=words, total=None))
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        print("stopped; the report is not complete", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    if others:
        print(f"robot {chosen} (with --robot: {', '.join(others)})")
    for line in report.remarks:
        print(f"note: {line}")
    for each in report.left_out:
        print(f"left out: {each.title} ({each.why})")
    for target in targets:
        print(f"wrote {target} ({target.stat().st_size / 2**20:.1f} MiB)")
    if png is not None:
        print(f"wrote {len(written)} pictures to {png}")


def write(report: Report, page: Path, pdf: bool, png: Path | None, working: Callable[[str], None]) -> list[Path]:
    """Write all that is wanted; an old file is replaced once the new one is complete.

    Raises:
        BadInputError: if something cannot be written, or the plotting library is missing.
    """
    try:
        from tulip_view.report.page import make_page
    except ModuleNotFoundError as error:
        raise BadInputError(
            f"The page needs the library {error.name}, which is not installed. Install the project's extra `report`: "
            "pip install -e '.[report]'"
        ) from error
    from tulip_view.report.paper import write_pdf, write_pngs

    part = page.with_name(page.name + ".part")
    try:
        working("writing the page")
        part.write_text(make_page(report), encoding="utf-8")
        os.replace(part, page)
        if pdf:
            working("writing the PDF")
            write_pdf(report, part)
            os.replace(part, page.with_suffix(".pdf"))
        if png is None:
            return []
        working("writing pictures")
        png.mkdir(parents=True, exist_ok=True)
        return write_pngs(report, png)
    except OSError as error:
        raise BadInputError(
            f"The report cannot be written: {error.strerror or error}. Make room, or name another file."
        ) from error
    finally:
        part.unlink(missing_ok=True)


def _default(file: Path, robot: str) -> Path:
    name = f"report_{robot}.html" if robot else "report.html"
    return file / name if file.is_dir() else file.with_suffix("").with_name(f"{file.stem}_{name}")


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    typer.run(main)
