"""Tune the gait: search for better values of gait.yaml by walking in simulation, on all cores."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare(extras=("tune",))

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from tulip_motion.gait_file import PATH as GAIT
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_writable, unknown
from tulip_sim.tuner import StudyError, Tuner, default_settings
from tulip_sim.tuning import SPACE, Figures

INTERRUPTED = 130
STUDY = _environment.ROOT / "build" / "gait-study.jsonl"


def main(
    trials: Annotated[int, typer.Option(help="Gaits to try; 0 only shows (or applies) what was found.", min=0)] = 200,
    study: Annotated[Path, typer.Option(help="File of the study; it is gone on with if it exists.")] = STUDY,
    space: Annotated[
        str, typer.Option(help="Parameters to search over, with commas between; none: all of gait.yaml.")
    ] = "",
    apply: Annotated[
        bool,
        typer.Option(
            "--apply", help="Judge the best gaits in unseen worlds, and write the best of them into the gait file."
        ),
    ] = False,
    gait: Annotated[Path, typer.Option(help="The gait file that --apply writes.")] = GAIT,
    seeds: Annotated[int, typer.Option(help="Random worlds that each gait walks in.", min=1)] = 4,
    seconds: Annotated[float, typer.Option(help="Length of each walk.", min=1.0)] = 12.0,
    workers: Annotated[int | None, typer.Option(help="Processes; all cores by default.", min=1)] = None,
) -> None:
    """Tune the gait; Ctrl-C ends it, and the same command goes on."""
    console = Console()
    try:
        names = [name.strip() for name in space.split(",") if name.strip()] or list(SPACE)
        for name in names:
            if name not in SPACE:
                raise unknown("parameter to tune called", name, SPACE)
        if study == STUDY:
            study.parent.mkdir(exist_ok=True)
        check_writable(study, "--study")
        if apply:
            check_writable(gait, "--gait")
        tuner = Tuner(study, default_settings(seeds, seconds))
        if trials:
            search(tuner, trials, names, workers, console)
        if apply:
            confirm(tuner, workers, console)
        report(tuner, console)
        if apply:
            tuner.apply(gait)
            console.print(f"Wrote {gait}", soft_wrap=True)
    except (BadInputError, StudyError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        print(f"stopped; {study} holds what was tried, and the same command goes on", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None


def search(tuner: Tuner, trials: int, names: list[str], workers: int | None, console: Console) -> None:
    """Add trials to the study with a progress bar."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=console) as bar:
        task = bar.add_task("gaits", total=trials)

        def done(cost: float, figures: Figures) -> None:
            bar.advance(task)
            text = "  ".join(f"{name.replace('_', ' ')} {value:.3f}" for name, value in figures.as_dict().items())
            console.print(f"cost {cost:7.3f}  {text}", highlight=False, soft_wrap=True)
            bar.update(task, description=f"gaits, best cost {tuner.best().figures.cost:.3f}")

        tuner.run(trials, names, workers, done)


def confirm(tuner: Tuner, workers: int | None, console: Console) -> None:
    """Judge the best gaits in unseen worlds with a progress bar."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=console) as bar:
        task = bar.add_task("best gaits in unseen worlds", total=None)
        tuner.confirm(workers, lambda made, total: bar.update(task, completed=made, total=total))


def report(tuner: Tuner, console: Console) -> None:
    """Print the best gait beside the one that the search started from."""
    best = tuner.best()
    where = ", in unseen worlds" if best.unseen else ""
    console.print(f"Best of {tuner.finished}: cost {best.figures.cost:.3f}{where}", highlight=False)
    for name, value in best.figures.as_dict().items():
        console.print(f"  {name.replace('_', ' ')} {value:.3f}", highlight=False)
    table = Table("parameter", "start", "best", "bounds")
    for name, value in best.values.items():
        low, high = SPACE[name]
        table.add_row(name, f"{tuner.settings.base[name]:g}", f"{value:.4g}", f"{low:g} to {high:g}")
    console.print(table)


if __name__ == "__main__":
    typer.run(main)
