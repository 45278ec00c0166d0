"""Identify the robot's own body: hold static postures on one foot and record what the sensors tell."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import signal
import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer
from _progress import progress
from rich.console import Console

from tulip_motion.identification.experiment_plan import PlanParameters
from tulip_motion.identification.experiment_settings import ExperimentSettings
from tulip_motion.identification.progress import Progress
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
from tulip_ros.log_file import files_of
from tulip_sim.identify_graph import run_graph
from tulip_sim.identify_lockstep import run_lockstep

MODES = ("lockstep", "graph")
INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it

app = typer.Typer(help=__doc__, add_completion=False, no_args_is_help=True)


@app.callback()
def commands() -> None:
    """Keep `run` a command of its own."""


@app.command()
def run(
    postures: Annotated[int, typer.Option(help="On each foot.", min=9, max=100)] = PlanParameters.postures,
    mode: Annotated[str, typer.Option(help="lockstep (one process) or graph (nodes as processes)")] = MODES[0],
    driver: Annotated[
        str, typer.Option(help="What stands for the body in the graph; 'none' for the real one.")
    ] = "sim",
    body: Annotated[Path | None, typer.Option(help="Body file that is believed; none: robot.yaml.")] = None,
    secret: Annotated[
        int | None, typer.Option(help="Seed of another body that the simulated robot has (lockstep).", min=0)
    ] = None,
    seed: Annotated[int, typer.Option(help="Of all noise in the simulation.", min=0)] = 1,
    record: Annotated[Path | None, typer.Option(help="New folder for the recording.")] = None,
) -> None:
    """Drive the robot through postures on one foot, then on the other, and record it.

    The robot stands free on level ground. Ctrl-C makes it put its foot down and stand (graph). The exit code is 0 if
    every posture was held, 1 if some were not, 2 for bad input, 130 after Ctrl-C.
    """
    console = Console()
    try:
        if mode not in MODES:
            raise BadInputError(f"--mode is {mode!r}; expected one of {', '.join(MODES)}.")
        if mode == "graph" and secret is not None:
            raise BadInputError("--secret is for the simulation in one process; expected --mode lockstep with it.")
        settings = ExperimentSettings("" if body is None else str(body.absolute()), PlanParameters(postures))
        folder = record or Path("recordings") / f"{datetime.now():%Y%m%d_%H%M%S}_identify"
        with progress() as bar:
            task = bar.add_task("planning", total=2 * postures)

            def show(now: Progress) -> None:
                doing = f"{now.doing} {now.posture + 1} of {now.postures}" if now.posture >= 0 else now.doing
                bar.update(task, completed=now.held, description=f"{doing}, {now.seconds_left:.0f} s left")

            if mode == "graph":
                end = run_graph(settings, driver, seed, folder, show, console.print)
            else:
                end = run_lockstep(settings, seed, folder, show, secret)
    except (BadInputError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    console.print(f"held {end.held} of {end.postures} postures")
    if end.left_out:
        console.print(f"not still: {', '.join(str(number + 1) for number in end.left_out)}")
    if end.reason:
        console.print(f"aborted: {end.reason}")
    console.print(f"recording: {files_of(folder)[0]}", soft_wrap=True, highlight=False)
    raise typer.Exit(0 if end.held == end.postures else 1)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    app()
