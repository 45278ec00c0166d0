"""Measure: run a bench, keep its figures and write docs/results.md anew."""

from __future__ import annotations

import sys

import _environment

if __name__ == "__main__":
    wants = {
        "bench": {"clik", "log", "vision"},
        "view": {"faces"},
        "bridge": {"faces"},
        "mujoco": {"drivers", "engines"},
    }
    _environment.prepare(tuple(extra for extra, benches in wants.items() if benches & set(sys.argv)))

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markdown import Markdown
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_writable, unknown
from tulip_sim.bench import (
    ball,
    batch,
    challenges,
    clik,
    control,
    drivers,
    dynamics,
    engines,
    faces,
    faults,
    head,
    identify,
    ilc,
    kick,
    latency,
    localization,
    log,
    match,
    odometry,
    push,
    referee,
    simcheck,
    soak,
    strategy,
    stress,
    transport,
    vision,
    walk,
)
from tulip_sim.bench.runner import Bench, Row, run, save, write_results
from tulip_view.fuzz import bench as fuzz

MODULES = (
    *(strategy, challenges, match, referee, batch, walk, push, kick, odometry, control, ilc, clik, stress, engines),
    *(simcheck, vision, localization, ball, head, latency, log, faces, faults, drivers, transport, identify, dynamics),
    *(fuzz, soak),
)
BENCHES = {module.BENCH.name: module.BENCH for module in MODULES}
DOCS = _environment.ROOT / "docs"


def chosen(bench: Bench, options: Sequence[str]) -> Bench:
    """Return a bench with what is played by options as NAME=VALUE.

    Raises:
        BadInputError: if the bench has none, or not these.
    """
    if not options:
        return bench
    if bench.choose is None:
        raise BadInputError(f"Bench {bench.name} has no options; leave out --option.")
    pairs = [each.partition("=") for each in options]
    if not all(name and sign for name, sign, _ in pairs):
        raise BadInputError(f"--option is {', '.join(options)}; expected NAME=VALUE.")
    try:
        return replace(bench, trials=bench.choose({name: value for name, _, value in pairs}))
    except ValueError as error:
        raise BadInputError(f"--option of bench {bench.name}: {error}.") from error


def main(
    name: Annotated[str, typer.Argument(help=f"One of {', '.join(BENCHES)}.")],
    workers: Annotated[int | None, typer.Option(help="Processes; all cores by default.", min=1)] = None,
    json_path: Annotated[Path | None, typer.Option("--json", help="Write the rows to this file, too.")] = None,
    option: Annotated[list[str] | None, typer.Option(help="NAME=VALUE of a bench that has some; repeatable.")] = None,
) -> None:
    """Run a bench."""
    try:
        if name not in BENCHES:
            raise unknown("bench", name, BENCHES)
        if json_path is not None:
            check_writable(json_path, "--json")
        bench = chosen(BENCHES[name], option or ())
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    console = Console()
    if bench.prepare is not None:
        try:
            bench.prepare(console.print)
        except RuntimeError as error:
            print(f"error: {error}", file=sys.stderr)
            raise typer.Exit(EXIT_BAD_INPUT) from None
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(name, total=len(bench.trials))

        def done(row: Row) -> None:
            bar.advance(task)
            figures = (f"{key} {value}" for key, value in row.items() if not isinstance(value, list | dict))
            console.print("  ".join(figures), highlight=False, soft_wrap=True, markup=False)

        rows = run(bench, workers, done)
    save(bench, rows, DOCS / "results")
    if bench.draw is not None:
        bench.draw(rows, DOCS / "results" / f"{bench.name}.png")
    write_results(list(BENCHES.values()), DOCS / "results", DOCS / "results.md")
    if json_path is not None:
        json_path.write_text(json.dumps(rows, indent=1) + "\n")
    console.print(Markdown("\n".join(bench.summarize(rows))))


if __name__ == "__main__":
    typer.run(main)
