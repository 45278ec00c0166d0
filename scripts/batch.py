"""Play many trials or matches over seeds and parameter sets, on all cores or on a Ray cluster."""

from __future__ import annotations

import sys

import _environment

if __name__ == "__main__":
    ray_wanted = any(word.split("=")[0] == "--ray" for word in sys.argv)
    _environment.prepare(("batch", "ray") if ray_wanted else ("batch",))

import signal
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_writable, unknown
from tulip_sim.batch.jobs import PLAYS, Batch
from tulip_sim.batch.journal import Journal
from tulip_sim.batch.parameter_sets import DEFAULT, read_sets
from tulip_sim.batch.results import check_ending, summarize, write_results
from tulip_sim.batch.workers import play_here, play_on_ray
from tulip_sim.perception import EYES
from tulip_sim.scenario import SCENARIOS

TRIAL = "trial"
INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it
JOURNAL = ".journal"  # behind the name of the results file


def main(
    results: Annotated[Path, typer.Argument(help="File for the results; ends in .csv or .parquet.")],
    number: Annotated[int, typer.Option("--number", "-n", help="Games that each parameter set plays.", min=1)] = 20,
    first_seed: Annotated[int, typer.Option(help="Seed of the first game; the others follow.", min=0)] = 1,
    sets: Annotated[
        Path | None, typer.Option(help="YAML or JSON file of parameter sets, `set: {node: {name: value}}`.")
    ] = None,
    play: Annotated[str, typer.Option(help=", ".join(PLAYS))] = "trial",
    scenario: Annotated[
        str | None, typer.Option(help=f"Of a trial, {TRIAL} by default: {', '.join(SCENARIOS)}.", show_default=False)
    ] = None,
    eyes: Annotated[
        str, typer.Option(help="camera (pictures and vision), or features made up from the truth: degraded or ideal")
    ] = "camera",
    workers: Annotated[int | None, typer.Option(help="Processes; all cores by default.", min=1)] = None,
    ray: Annotated[str | None, typer.Option(help="Play on the Ray cluster at this address instead.")] = None,
) -> None:
    """Play; Ctrl-C ends it, and the same command goes on, also after a kill or a power cut."""
    console = Console()
    try:
        begin = scenario or TRIAL
        for kind, name, known in (("play", play, PLAYS), ("scenario", begin, SCENARIOS), ("eyes", eyes, EYES)):
            if name not in known:
                raise unknown(kind, name, known)
        if scenario is not None and not PLAYS[play].has_scenario:
            raise BadInputError(f"--scenario is {scenario}, but a {play} begins by its own rules; leave it out.")
        if ray is not None and workers is not None:
            raise BadInputError("--workers is for this machine; expected it without --ray.")
        check_ending(results)
        check_writable(results, "Results file")
        base = PLAYS[play].base(EYES[eyes])
        chosen = {DEFAULT: base} if sets is None else read_sets(sets, base, PLAYS[play].change)
        batch = Batch(play, begin if PLAYS[play].has_scenario else "", chosen, range(first_seed, first_seed + number))
        with Journal(results.with_name(results.name + JOURNAL), batch) as journal:
            try:
                run(batch, journal, workers, ray, console)
            finally:
                if journal.rows:
                    write_results(results, journal.rows)
            report(batch, journal, console)
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        print(f"stopped; {results} holds what was played, and the same command goes on", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    console.print(f"Wrote {results}", soft_wrap=True)


def run(batch: Batch, journal: Journal, workers: int | None, address: str | None, console: Console) -> None:
    """Play what is left, with a progress bar."""
    jobs, done = batch.jobs(), journal.done()
    left = [job for job in jobs if job not in done]
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=console) as bar:
        task = bar.add_task("games", total=len(jobs), completed=len(jobs) - len(left))
        rows = play_here(batch, left, workers) if address is None else play_on_ray(batch, left, address)
        for row in rows:
            journal.add(row)
            bar.advance(task)


def report(batch: Batch, journal: Journal, console: Console) -> None:
    """Print rates and means of each parameter set with their confidence intervals."""
    estimates = summarize(journal.rows, PLAYS[batch.play])
    table = Table("", *map(escape, estimates), title="95 % confidence intervals in brackets")
    table.add_row("games", *(str(sum(row["set"] == name for row in journal.rows)) for name in estimates))
    for figures in zip(*estimates.values(), strict=True):
        table.add_row(escape(figures[0].name), *map(str, figures))
    console.print(table)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    typer.run(main)
