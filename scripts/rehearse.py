"""Play a motion in the simulator from the robot's present state, before it goes to hardware."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from _rehearsal import EVERYTHING, REFUSED, motion_parameters, passes
from rich.console import Console

from tulip_description.robot import load_robot
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_writable, require
from tulip_ros.plan import make_plan
from tulip_sim.parameters import ENGINES, WorldParameters
from tulip_sim.rehearsal.motions import GRAMMAR, everything, parse
from tulip_sim.rehearsal.play import play
from tulip_sim.rehearsal.present import Present, standing
from tulip_sim.rehearsal.run import SEEDS
from tulip_view.present_sensors import recorded, running

app = typer.Typer(add_completion=False)


@app.command(context_settings={"ignore_unknown_options": True})  # else -0.2 would be one
def main(
    motions: Annotated[
        list[str] | None,
        typer.Argument(help=f"One after the other: {GRAMMAR}. None: some of everything that the walk may do."),
    ] = None,
    seconds: Annotated[float, typer.Option(help="Of walks and stands that do not say it.")] = 10.0,
    begin: Annotated[
        str | None, typer.Option("--from", help="RECORDING@SECONDS: from how the robot stood there.")
    ] = None,
    live: Annotated[bool, typer.Option("--live", help="From how the running robot stands.")] = False,
    namespace: Annotated[str, typer.Option(help="Of that robot.")] = "",
    params: Annotated[list[Path] | None, typer.Option(help="YAML file `node: {name: value}`; repeatable.")] = None,
    seeds: Annotated[int, typer.Option(help="Plays, each with other masses and friction.", min=1, max=100)] = SEEDS,
    engine: Annotated[str, typer.Option(help=f"Physics: {' or '.join(ENGINES)}.")] = WorldParameters.engine,
    picture: Annotated[Path | None, typer.Option(help="File for a picture of torques, speeds and ZMP margin.")] = None,
) -> None:
    """Play motions in the simulator, and say whether they may go to hardware.

    The exit code is 0 within the limits, 1 beyond them, 2 for bad input.
    """
    console = Console()
    try:
        if engine not in ENGINES:
            raise BadInputError(f"--engine is {engine!r}; expected {' or '.join(ENGINES)}.")
        if engine == "mujoco":
            require("mujoco", "mujoco")
        if picture is not None:
            check_writable(picture, "--picture")
        parameters = motion_parameters(make_plan(["motion"], None, parameter_files=params or ()))
        try:
            parts = parse(motions, parameters, seconds) if motions else everything(parameters)
        except ValueError as error:
            raise BadInputError(f"{error}.") from error
        present = _present(begin, live, namespace)
        if present.note:
            console.print(f"{'note':<18}{present.note}", highlight=False)
        what = " ".join(motions) if motions else EVERYTHING
        well = passes(partial(play, parts, parameters, present, engine=engine), console, what, seeds, picture)
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    raise typer.Exit(0 if well else REFUSED)


def _present(begin: str | None, live: bool, namespace: str) -> Present:
    """Return how the robot stands.

    Raises:
        BadInputError: if that cannot be told.
    """
    robot = load_robot()
    if begin is not None and live:
        raise BadInputError("--from and --live exclude each other; give one of them.")
    if live:
        return running(robot, namespace)
    if begin is None:
        return standing(robot)
    path, mark, moment = begin.rpartition("@")
    try:
        at = float(moment)
    except ValueError:
        at = None
    if not mark or at is None:
        raise BadInputError(f"--from is {begin!r}; expected RECORDING@SECONDS, as in recordings/trial@12.5.")
    return recorded(robot, Path(path), at, namespace)


if __name__ == "__main__":
    app()
