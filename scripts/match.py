"""Play one trial of the dribble and kick competition, record it, and say who scored and how."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import json
import os
import signal
import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_writable, unknown
from tulip_sim.lockstep import Settings
from tulip_sim.match_graph import play_graph
from tulip_sim.match_lockstep import play_lockstep
from tulip_sim.perception import PerceptionParameters
from tulip_sim.scenario import SCENARIOS
from tulip_sim.trial import TrialSummary
from tulip_strategy.game_controller import REFEREE_PORT

MODES = ("graph", "lockstep")
EYES = {"camera": None, "degraded": PerceptionParameters(), "ideal": PerceptionParameters.ideal()}
INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it
LONGEST = 155.0  # [s] preparation and 150 s of play


def main(
    seed: Annotated[int, typer.Option(help="Of the scenario and of all noise.", min=0)] = 1,
    mode: Annotated[str, typer.Option(help="graph (nodes as processes) or lockstep (one process)")] = "graph",
    scenario: Annotated[str, typer.Option(help=", ".join(SCENARIOS))] = "trial",
    record: Annotated[Path | None, typer.Option(help="New folder for the recording.")] = None,
    no_record: Annotated[bool, typer.Option("--no-record", help="Record nothing.")] = False,
    json_path: Annotated[Path | None, typer.Option("--json", help="Write the summary to this file.")] = None,
    parameters: Annotated[list[Path] | None, typer.Option(help="YAML file for the nodes (graph); repeatable.")] = None,
    referee_port: Annotated[
        int, typer.Option(help="UDP port of the referee (graph).", min=1, max=65535)
    ] = REFEREE_PORT,
    logs: Annotated[Path | None, typer.Option(help="Folder for one log file a node (graph).")] = None,
    eyes: Annotated[
        str,
        typer.Option(help="camera (pictures and vision), or features made up from the truth: degraded or ideal"),
    ] = "camera",
) -> None:
    """Play one trial. The exit code is 0 after a goal, 1 without one, 2 for bad input, 130 after Ctrl-C."""
    folder: Path | None = None
    console = Console()
    try:
        if mode not in MODES:
            raise BadInputError(f"--mode is {mode!r}; expected one of {', '.join(MODES)}.")
        if scenario not in SCENARIOS:
            raise unknown("scenario", scenario, SCENARIOS)
        if eyes not in EYES:
            raise BadInputError(f"--eyes is {eyes!r}; expected one of {', '.join(EYES)}.")
        if mode != "graph" and (parameters or logs):
            raise BadInputError("--parameters and --logs are for nodes; expected --mode graph with them.")
        if json_path is not None:
            check_writable(json_path, "--json")
        folder = None if no_record else record or default_folder(seed, mode)
        with Progress(
            TextColumn("{task.description}", justify="left"),
            BarColumn(bar_width=20),
            TextColumn("{task.completed:5.1f} s of play"),
            TimeElapsedColumn(),
            console=console,
            transient=True,
        ) as bar:
            task = bar.add_task("starting", total=LONGEST)

            def show(time: float, doing: str) -> None:
                bar.update(task, completed=time, description=doing.rsplit(" > ", 1)[-1] or "starting")

            if mode == "graph":
                summary = play_graph(
                    seed,
                    scenario,
                    folder,
                    show,
                    lambda line: console.print(line, highlight=False, markup=False),
                    parameters or (),
                    referee_port=referee_port,
                    logs=logs,
                    perception=EYES[eyes],
                )
            else:
                beside = (os.cpu_count() or 1) > 1 and EYES[eyes] is None
                settings = Settings(perception=EYES[eyes])
                summary = play_lockstep(seed, scenario, settings, folder, show, eyes_beside=beside)
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        held = f"; {folder} holds what was played" if folder is not None and folder.exists() else ""
        print(f"stopped{held}", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    report(summary, console)
    if json_path is not None:
        json_path.write_text(json.dumps(summary.as_dict(), indent=2) + "\n")
    raise typer.Exit(0 if summary.scored else 1)


def default_folder(seed: int, mode: str) -> Path:
    """Return a new folder under recordings/."""
    moment = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    return _environment.ROOT / "recordings" / f"{moment}_{mode}_{seed}"


def report(summary: TrialSummary, console: Console) -> None:
    """Print the summary."""
    verdict = "GOAL" if summary.scored else "no goal"
    console.print(f"[bold]{verdict}[/] (seed {summary.seed}, {summary.mode})")
    for name, value in summary.lines():
        console.print(f"{name:<21}{value}", highlight=False, markup=False, soft_wrap=True)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    typer.run(main)
